"""Requests on the electronic fence. Stored fences, and virtual walls, which act on hand guiding, are not simulated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rcilab.core.errors import InvalidValueError
from rcilab.makers.realman.controller.fence import Fence
from rcilab.makers.realman.controller.handler import Getter, Setter, setter
from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.wire.line import Request

_WHOLE_ARM = 0


def _set_fence(controller: RealManController, request: Request) -> None:
    controller.change(replace(controller.settings, fence=Fence.read(request)))


def _enable(controller: RealManController, request: Request) -> None:
    is_on, side, region = (
        request.flag("set_enable"),
        request.integer("in_out_side"),
        request.integer("effective_region"),
    )
    if side not in (0, 1):
        raise InvalidValueError("in_out_side", side, "must be 0 (inside) or 1 (outside)")
    if region != _WHOLE_ARM:
        raise InvalidValueError("effective_region", region, "must be 0: a fence is for the whole arm")
    settings = controller.settings
    if is_on and settings.fence is None:
        raise InvalidValueError("set_enable", is_on, "needs a fence: set_electronic_fence_config")
    controller.change(replace(settings, is_fenced=is_on, fence_side="outside" if side else "inside"))


def _fence(controller: RealManController, request: Request) -> dict[str, Any]:
    fence = controller.settings.fence
    answer: dict[str, Any] = {"command": "get_electronic_fence_config"}
    return answer | ({"form": 0} if fence is None else {"form": fence.form, **fence.fields})


def _state(controller: RealManController, request: Request) -> dict[str, Any]:
    settings = controller.settings
    return {
        "command": "get_electronic_fence_enable",
        "enable_state": settings.is_fenced,
        "in_out_side": int(settings.fence_side == "outside"),
        "effective_region": _WHOLE_ARM,
    }


SETTERS: dict[str, Setter] = {
    "set_electronic_fence_config": setter("set_config", _set_fence),
    "set_electronic_fence_enable": setter("set_state", _enable),
}
GETTERS: dict[str, Getter] = {
    "get_electronic_fence_config": _fence,
    "get_electronic_fence_enable": _state,
}
