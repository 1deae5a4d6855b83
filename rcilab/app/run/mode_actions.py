"""Choosing a mode, its parameters or a speed override. Owned by the dispatcher's thread."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, cast

from rcilab.app.app_state import AppState
from rcilab.app.connection import Connection
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.run.drive_state import choose_mode, control_field, is_pending
from rcilab.app.run.mode_parameters import (
    CONFIRM_TIMEOUT,
    ask_to_send,
    find_group,
    typed_range,
    typed_scale,
    typed_value,
    with_number,
)
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.requested_speed import RequestedSpeed, describe_override_refusal, is_running
from rcilab.app.setup.configuration_sender import ConfigurationSender
from rcilab.app.state_store import StateStore
from rcilab.core.errors import RcilabError
from rcilab.core.state import MODES, Mode
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import default_parameters
from rcilab.motion.speed_scaling import MIN_SPEED_OVERRIDE

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest, SupervisorStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class SetDrive(Request):
    """Settings of the execution; None leaves a value unchanged."""

    mode: str | None = None
    """One of `rcilab.core.state.MODES`."""
    speed_override: float | None = None
    """Speed override, as a part of the planned speed, 0.1 to 1."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.speed_override is None else f"speed_override.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class PressControl(Request):
    """A button of the modes' parameters."""

    what: Literal["send", "reset"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetControl(Request):
    """Change one number of the modes' parameters."""

    group: str
    """Name of the group."""
    index: int
    """Index in the group."""
    value: float
    """In the unit of the parameter."""


class ModeActions:
    """Mode, parameters, pause, speed override. A virtual controller gets them at once, others after a confirmation.

    Args:
        store: The state.
        connection: The robot.
        keeps_rest: Whether the controller keeps its other parameters; otherwise it gets the standard values of these
            with the first change.
    """

    def __init__(self, store: StateStore[AppState], connection: Connection, *, keeps_rest: bool = False) -> None:
        self._store, self._connection, self._keeps_rest = store, connection, keeps_rest
        self._was_running = False
        self._sender = ConfigurationSender(connection, self._refuse)
        self._requested = RequestedSpeed()
        self._changing: tuple[float, PendingRequest] | None = None  # A speed override that awaits its answer.
        self._asked_to_send = -math.inf
        self._arm = store.state.model.name

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            SetDrive: self.set_drive,
            PressControl: self.press,
            SetControl: self.set_control,
        }

    def set_drive(self, request: SetDrive) -> None:
        """Chooses a mode, by whose conditions the plan is then checked, or a speed override; ignores invalid ones."""
        state, status = self._store.state, self._connection.status()
        if request.mode in MODES and request.mode != state.drive.mode:
            if is_moving(status):
                self._store.notify("warn", message("notice.moving"))
                return
            choose_mode(self._store, cast("Mode", request.mode))
            self._store.update(asked=None)
        if request.speed_override is not None and math.isfinite(request.speed_override):
            typed = parse_number(f"{100.0 * request.speed_override:g}", 100.0 * MIN_SPEED_OVERRIDE, 100.0, "%")
            if typed.problem is not None:
                self._store.notify("warn", typed.problem, page=request.page)
            speed_override = min(max(request.speed_override, MIN_SPEED_OVERRIDE), 1.0)
            self._store.update(drive=replace(self._store.state.drive, speed_override=speed_override))
            self._requested.choose(speed_override, status)

    def pause(self) -> None:
        """Pauses the motion in progress."""
        if self._require_motion():
            self._requested.hold()

    def resume(self) -> None:
        """Resumes a paused motion."""
        if self._require_motion():
            self._requested.go_on(self._store.state.drive.speed_override)

    def type_field(self, request: TypeField) -> None:
        """Takes a typed parameter, or shows the problem next to its field."""
        state = self._store.state
        found = control_field(state.model, request.field)
        if found is None:
            return
        group, index = found
        item = group.parameters[index]
        parsed = parse_number(request.text, *typed_range(item), typed_scale(item)[1])
        if parsed.value is None:
            assert parsed.problem is not None
            self._store.set_problem(request.field, parsed.problem)
            return
        self._store.clear_problems(request.field)
        self.set_control(SetControl(group=group.name, index=index, value=typed_value(item, parsed.value)))

    def set_control(self, request: SetControl) -> None:
        """Changes a parameter; an earlier refusal is dropped."""
        state = self._store.state
        groups, before = parameters_of(state.model), state.drive.control
        group = find_group(groups, request.group)
        if group is None:
            return
        if before is None and not self._keeps_rest:
            before = default_parameters(groups)
        control = with_number(before, group, request.index, request.value)
        self._take(control)

    def press(self, request: PressControl) -> None:
        """Sends the parameters, or resets them to the controller's defaults."""
        state, now = self._store.state, time.monotonic()
        if request.what == "reset":
            self._store.clear_problems("control.")
            self._take(default_parameters(parameters_of(state.model)))
            return
        if state.target != "virtual" and now - self._asked_to_send > CONFIRM_TIMEOUT:
            self._asked_to_send = now
            self._store.notify("warn", ask_to_send(state.target))
            return
        self._asked_to_send = -math.inf
        self._store.update(drive=replace(state.drive, refusal=None))
        self._send(self._connection.status())

    def tick(self, status: SupervisorStatus) -> None:
        """Collects answers, sends changes to a virtual controller, changes the speed override."""
        name = self._store.state.model.name
        if name != self._arm:
            self._arm = name
            self.forget()
        if self._sender.is_underway:
            self._sender.collect()
            status = self._connection.status()  # Values that were acknowledged meanwhile are not sent again.
        state = self._store.state
        if state.target == "virtual" and state.drive.refusal is None and status.phase == "idle":
            self._send(status)
        self._change_speed_override(status)

    def forget(self) -> None:
        """Drops requests without an answer: another robot was chosen."""
        self._requested.forget()
        self._sender.forget()
        self._changing, self._was_running = None, False
        self._store.update(drive=replace(self._store.state.drive, override_refusal=None))

    def _take(self, control: ControllerParameters) -> None:
        """Replaces the parameters, and the limits of the arm among them."""
        state = self._store.state
        model = RobotConfiguration(control=control).applied_to(state.model)
        self._store.update(drive=replace(state.drive, control=control, refusal=None), model=model)

    def _send(self, status: SupervisorStatus) -> None:
        state = self._store.state
        if not self._sender.is_underway and is_pending(state, status):
            self._sender.send(RobotConfiguration(control=state.drive.control))

    def _refuse(self, why: Message) -> None:
        self._store.update(drive=replace(self._store.state.drive, refusal=why))

    def _require_motion(self) -> bool:
        if is_running(self._connection.status()):
            return True
        self._store.notify("warn", message("speed_override.nothing"))
        return False

    def _change_speed_override(self, status: SupervisorStatus) -> None:
        running, before = is_running(status), self._was_running
        self._was_running = running
        if self._changing is not None and self._changing[1].done:
            (speed_override, request), self._changing = self._changing, None
            self._report_override_refusal(request.error, speed_override)
        elif running and not before:
            self._set_override_refusal(None)
        requested = self._requested.due(status, is_pending=self._changing is not None)
        if requested is None:
            return
        self._set_override_refusal(None)
        supervisor = self._connection.robot()
        try:
            self._changing = requested, supervisor.set_speed_override(requested) if requested else supervisor.pause()
        except RcilabError as error:
            self._report_override_refusal(error, requested)

    def _report_override_refusal(self, error: RcilabError | None, speed_override: float) -> None:
        refusal = None if error is None else describe_override_refusal(error, speed_override, self._connection.status())
        if refusal is not None:
            self._set_override_refusal(refusal)
            self._store.notify("warn", refusal)

    def _set_override_refusal(self, refusal: Message | None) -> None:
        drive = self._store.state.drive
        if drive.override_refusal is not refusal:
            self._store.update(drive=replace(drive, override_refusal=refusal))
