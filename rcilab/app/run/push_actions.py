"""Requests that push the virtual arm. Owned by the dispatcher's thread; it never waits for the arm."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from rcilab.app.connection import PageConnection
from rcilab.app.request import Handlers, Request
from rcilab.app.run.active_force import (
    DIRECTIONS,
    GUIDING_KINDS,
    STRONGEST,
    TOOL,
    ActiveForce,
    can_grab,
    no_push,
    place_of,
    spring_force,
)
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.arrays import JointVector, Vector3
from rcilab.execution.external_force_hold import HOLD_TIMEOUT, ExternalForceHold
from rcilab.execution.simulation_control import SimulationControl

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

_NO_MOMENT = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPush(Request):
    """Settings of pushes and hand guiding; None leaves a value unchanged."""

    link: int | None = None
    """From 1; 0: the tool."""
    direction: str | None = None
    newtons: float | None = None
    grab: bool | None = None
    guiding_kind: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldPush(Request):
    """The push button is held; sent ten times a second."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"HoldPush.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class DragLink(Request):
    """The mouse drags a link of the arm."""

    link: int
    """From 1."""
    grabbed: tuple[float, ...]
    """Grabbed point, base axes, [m]."""
    hand: tuple[float, ...]
    """Position of the mouse, base axes, [m]."""
    phase: Literal["start", "update", "end"]

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"pull.{self.page}" if self.phase == "update" else None


@dataclass(frozen=True, eq=False)
class _Grip:
    """The grabbed point of the arm."""

    page: int | None
    link: int
    point: Vector3
    """Point in the link's frame, [m]."""
    hand: Vector3
    """Position of the mouse, base axes, [m]."""


class PushActions:
    """The push button and the mouse in the scene; both press on the arm only while they are held."""

    def __init__(self, store: Store, connection: PageConnection) -> None:
        self._store, self._connection = store, connection
        self._grip: _Grip | None = None
        self._button: tuple[int | None, float] | None = None  # Page that holds it, and time of its last message, [s].
        self._push: ExternalForceHold | None = None
        self._address: str | None = None

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            SetPush: self.set_push,
            HoldPush: self.hold,
            DragLink: self.pull,
        }

    def set_push(self, request: SetPush) -> None:
        """Changes settings of pushes and guiding; invalid values are ignored, a force is clipped to its bounds."""
        state = self._store.state
        changes: dict[str, object] = {}
        if request.link is not None and request.link in range(state.model.n + 1):
            changes["link"] = request.link
        if request.direction in DIRECTIONS:
            changes["direction"] = request.direction
        if request.newtons is not None and math.isfinite(request.newtons):
            changes["newtons"] = min(max(request.newtons, 0.0), STRONGEST)
        if request.grab is not None:
            changes["grab"] = request.grab
        if request.guiding_kind in GUIDING_KINDS:
            changes["guiding_kind"] = request.guiding_kind
        self._store.update(push=replace(state.push, **changes))

    def hold(self, request: HoldPush) -> None:
        """Continues the push of the button as long as messages that it is held arrive."""
        reason = no_push(self._connection.status())
        if reason is not None:
            self._store.notify("warn", reason)
            return
        self._button = request.page, time.monotonic()

    def pull(self, request: DragLink) -> None:
        """Grabs a link at the mouse, follows the mouse, releases the link."""
        state, status = self._store.state, self._connection.status()
        numbers = np.array((request.grabbed, request.hand), dtype=float)
        if request.phase == "end" or not can_grab(state, status) or status.q is None:
            self._grip = None
        elif not np.isfinite(numbers).all() or request.link not in range(1, state.model.n + 1):
            self._grip = None
        elif request.phase == "start":
            T = state.model.rigid_body.link_pose(status.q, request.link)
            point = T.rotation.T @ (numbers[0] - T.position)
            self._grip = _Grip(request.page, request.link, point, numbers[1])
        elif self._grip is not None and self._grip.page == request.page:
            self._grip = replace(self._grip, hand=numbers[1])

    def tick(self, status: SupervisorStatus) -> None:
        """Applies the force to the arm at its current position, or removes it; reports errors."""
        state = self._store.state
        self._follow(status.world_address)
        self._drop_stale()
        acting, point = None, np.zeros(3)
        if status.q is not None and self._push is not None:
            acting, point = self._judge(status.q)
        if acting is not None and self._push is not None:
            link = None if acting.link == TOOL else acting.link
            self._push.hold((*acting.force.tolist(), *_NO_MOMENT), link, point)
        elif state.push.acting is not None and self._push is not None:
            self._push.release()
        if acting is not None or state.push.acting is not None:
            self._store.update(push=replace(state.push, acting=acting))
        error = None if self._push is None else self._push.pop_error()
        if error is not None:
            self._grip = self._button = None
            self._store.notify("bad", explain_error(error))

    def close(self) -> None:
        """Removes the force."""
        self._follow(None)

    def _judge(self, q: JointVector) -> tuple[ActiveForce | None, Vector3]:
        """Returns the force and its point in the link's frame; the mouse comes before the button."""
        state, grip = self._store.state, self._grip
        if grip is not None:
            start = place_of(state.model, q, grip.link, grip.point)
            return ActiveForce(link=grip.link, start=start, force=spring_force(start, grip.hand)), grip.point
        point = np.zeros(3)
        if self._button is None:
            return None, point
        start = place_of(state.model, q, state.push.link, point)
        return ActiveForce(link=state.push.link, start=start, force=state.push.force), point

    def _drop_stale(self) -> None:
        """Releases the arm for a page that has fallen silent or has lost the controls."""
        lock = self._store.state.control_lock
        if self._grip is not None and not lock.allows(self._grip.page):
            self._grip = None
        if self._button is not None:
            page, last_seen = self._button
            if time.monotonic() - last_seen > HOLD_TIMEOUT or not lock.allows(page):
                self._button = None

    def _follow(self, address: str | None) -> None:
        """Connects to the simulation port of the current controller."""
        if address == self._address:
            return
        if self._push is not None:
            self._push.release()
            self._push.close()
        self._push = self._address = None
        self._grip = self._button = None
        if address is not None:
            host, _, port = address.partition(":")
            self._push = ExternalForceHold(SimulationControl(host, int(port)))
        self._address = address
