"""Requests of the private protocol: what each function does, and what it answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rcilab.core.errors import InvalidValueError, KinematicsError, PlanningError
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.controller.information_requests import INFORMATION_HANDLERS
from rcilab.makers.ufactory.controller.io_requests import IO_HANDLERS, IoRequests
from rcilab.makers.ufactory.controller.motion_requests import MOTIONS, handle_motion
from rcilab.makers.ufactory.controller.pose_search import find_nearest_angles
from rcilab.makers.ufactory.controller.reporter import padded, servo_codes, user_pose
from rcilab.makers.ufactory.controller.settings import (
    MILLIMETRE,
    RESETTING,
    SPEED_FACTOR_PARAMETER,
    apply_setting,
)
from rcilab.makers.ufactory.controller.tasks import Task, Tasks
from rcilab.makers.ufactory.controller.xarm_controller import TaskEvent, XArmController
from rcilab.makers.ufactory.errors import UfactoryWarning
from rcilab.makers.ufactory.wire.frame import Frame
from rcilab.makers.ufactory.wire.functions import Function, encode_values
from rcilab.makers.ufactory.wire.identity import Identity
from rcilab.makers.ufactory.wire.poses import (
    pose_as_mm_rotation,
    pose_as_mm_rpy,
    pose_from_mm_rotation,
    pose_from_mm_rpy,
)
from rcilab.makers.ufactory.wire.refused_answers import refused_payload
from rcilab.sim.channels import Peer
from rcilab.sim.planner import EventKind
from rcilab.sim.planner.preparation import refusal_of


class Reply(NamedTuple):
    """What is answered: payload, and bits of the status besides those of the state."""

    payload: bytes = b""
    is_invalid: bool = False
    is_refused: bool = False
    """Whether a motion command is refused, which a client sees as "not ready"."""
    is_setting: bool = False
    """Whether "not ready" is left out: the client library would take it for a refusal of a load."""


class RequestHandlers:
    """Carries out requests. Owned by the server.

    Attributes:
        feedback: The bits of feedback that each client asked for.

    Args:
        controller: The controller.
        identity: What the arm reports itself as.
        tasks: Commands that wait for their turn.
        log: Logs a refusal, by the name of its request and the reason.
    """

    def __init__(
        self, controller: XArmController, identity: Identity, tasks: Tasks, log: Callable[[str, str], None]
    ) -> None:
        self._controller, self._identity, self._tasks, self._log = controller, identity, tasks, log
        self.feedback: dict[Peer, int] = {}
        self.io = IoRequests(controller)
        self._loading: Peer | None = None  # Has just set a load, and may end its wish for feedback.

    def handle(self, peer: Peer, request: Frame, function: Function, values: tuple[Any, ...]) -> Reply:
        """Carries out a request; what is invalid raises a warning and changes nothing."""
        try:
            if function in MOTIONS:
                return self._move(peer, request, function, values)
            if function in IO_HANDLERS:
                return self._handle_io(peer, request, function, values)
            settings = apply_setting(self._controller.settings, function, values)
            if settings is not None:
                self._controller.require_settings(settings)
                if function in RESETTING:
                    self._controller.reset_state()
                self._controller.configure(settings)
                if function is not Function.SET_LOAD:
                    return Reply()
                self._trigger(peer, request)
                self._loading = peer
                return Reply(is_setting=True)
            return self._get(peer, request, function, values)
        except InvalidValueError as error:
            self.refuse(function.name, UfactoryWarning.PARAMETER, str(error))
            return Reply(refused_payload(function, values), is_invalid=function not in MOTIONS)

    def _move(self, peer: Peer, request: Frame, function: Function, values: tuple[Any, ...]) -> Reply:
        controller = self._controller
        if controller.is_full:
            self.refuse(function.name, UfactoryWarning.QUEUE_FULL, "the queue is full")
            return Reply()
        number = self._tasks.add(Task(peer, request, self.feedback.get(peer, 0)))
        try:
            outcome = handle_motion(controller, function, values, number)
        except InvalidValueError:
            self._tasks.drop(number)
            raise
        except (KinematicsError, PlanningError) as error:
            self._tasks.drop(number)
            controller.refuse(refusal_of(error, 1.0))
            return Reply()
        if not outcome.answer.is_taken or outcome.is_check or outcome.is_dropped:
            self._tasks.drop(number)
        if not outcome.answer.is_taken:
            where = f"in mode {controller.mode.value}, state {controller.shown_state.value}"
            self._log(function.name, f"{outcome.answer.value} {where}")
            return Reply(is_refused=True)
        return Reply(bytes((0, 0, outcome.error)))

    def _trigger(self, peer: Peer, request: Frame) -> None:
        """Sends the feedback of a request that is carried out at once."""
        task = Task(peer, request, self.feedback.get(peer, 0), lambda: None)
        self._controller.on_task(TaskEvent(self._tasks.add(task), EventKind.REACHED))

    def _handle_io(self, peer: Peer, request: Frame, function: Function, values: tuple[Any, ...]) -> Reply:
        act = IO_HANDLERS[function](self.io, values)
        if isinstance(act, bytes):
            return Reply(act)
        if act.is_queued:
            task = Task(peer, request, self.feedback.get(peer, 0), act.run)
            self._controller.queue_marker(self._tasks.add(task))
        else:
            act.run()
        return Reply()

    def _get(self, peer: Peer, request: Frame, function: Function, values: tuple[Any, ...]) -> Reply:
        controller = self._controller
        match function:
            case Function.SET_FEEDBACK:
                self.feedback[peer] = values[0]
                after_load, self._loading = self._loading is peer, None
                return Reply(is_setting=after_load)
            case Function.CHECK_FEEDBACK:
                number = self._tasks.add(Task(peer, request, self.feedback.get(peer, 0)))
                controller.queue_marker(number)
                return Reply()
            case Function.GET_IK:
                return self._solve(values)
            case _:
                if function in INFORMATION_HANDLERS:
                    return Reply(INFORMATION_HANDLERS[function](controller, values))
                return Reply(_SIMPLE[function](controller, self._identity, values))

    def _solve(self, values: tuple[Any, ...]) -> Reply:
        """Answers the joint angles of a pose, nearest to those given, or to the arm's."""
        controller = self._controller
        is_limited = bool(values[6]) if len(values) > 6 else True
        near = values[7 : 7 + controller.model.n] or controller.planner.q
        try:
            q = _find_angles(controller, values[:6], near, is_limited=is_limited)
        except KinematicsError as error:
            self.refuse(Function.GET_IK.name, UfactoryWarning.NO_SOLUTION, str(error))
            return Reply(refused_payload(Function.GET_IK), is_invalid=True)
        return Reply(encode_values("f", *padded(q)))

    def refuse(self, name: str, warning: UfactoryWarning, reason: str) -> None:
        """Raises a warning, and logs why a request, by its name, is refused."""
        self._controller.warn(warning)
        self._log(name, f"{warning.manual_name}, {warning.cause}: {reason}")


def _find_angles(
    controller: XArmController, values: tuple[float, ...], near: Sequence[float], *, is_limited: bool = False
) -> list[float]:
    """Returns the joint angles inside the ranges of motions, [rad], that put the tool at a pose of the user frame."""
    pose = controller.settings.T_base_user @ pose_from_mm_rpy(values)
    return find_nearest_angles(controller.model, controller.motion_limits.joint, pose, near, is_limited=is_limited)


def _forward(controller: XArmController, q: tuple[float, ...]) -> Pose:
    return controller.settings.T_base_user.inverse() @ controller.model.forward(q[: controller.model.n])


def _joints(controller: XArmController, blocks: int) -> bytes:
    measured = controller.arm.measured_state.measured
    rows = (measured.q, measured.dq, measured.tau)[: max(1, blocks & 0x0F)]
    return b"".join(encode_values("f", *padded(row.tolist())) for row in rows)


def _is_joint_limit(controller: XArmController, q: tuple[float, ...]) -> bytes:
    joint = controller.motion_limits.joint
    inside = (low <= x <= high for x, low, high in zip(q, joint.lower, joint.upper, strict=False))
    return bytes([not all(inside)])


def _is_tcp_limit(controller: XArmController, values: tuple[float, ...]) -> bytes:
    try:
        _find_angles(controller, values, controller.planner.q)
    except KinematicsError:
        return b"\1"
    return b"\0"


def _reduced_state(controller: XArmController) -> bytes:
    settings = controller.settings
    ranges = [angle for pair in zip(settings.reduced_lower, settings.reduced_upper, strict=True) for angle in pair]
    return (
        bytes([settings.reduced])
        + encode_values("h", *settings.boundary)
        + encode_values("f", settings.reduced_tool_speed / MILLIMETRE, settings.reduced_joint_speed)
        + encode_values("f", *ranges, *(0.0,) * (14 - len(ranges)))
        + bytes([settings.fence, settings.rebound])
    )


def _pose_offset(values: tuple[Any, ...]) -> bytes:
    """Returns the pose of the second in the frame of the first, each in its form of orientation."""
    is_vector_in, is_vector_out = values[12:]
    read = pose_from_mm_rotation if is_vector_in else pose_from_mm_rpy
    offset = read(values[:6]).inverse() @ read(values[6:12])
    return encode_values("f", *(pose_as_mm_rotation if is_vector_out else pose_as_mm_rpy)(offset))


def _set(is_valid: bool, name: str, value: object, problem: str) -> bytes:
    if not is_valid:
        raise InvalidValueError(name, value, problem)
    return b""


def _common_parameter(controller: XArmController, number: int) -> bytes:
    _set(number == SPEED_FACTOR_PARAMETER, "parameter", number, f"is not known; known: {SPEED_FACTOR_PARAMETER}")
    return encode_values("f", controller.settings.servo_speed_factor)


def _set_mode(controller: XArmController, mode: int, is_undetected: int = 0) -> bool:
    return controller.set_mode(mode, detects_motion=not is_undetected)


def _clean_error(controller: XArmController) -> bytes:
    controller.clean_error()
    return b""


def _clean_warning(controller: XArmController) -> bytes:
    controller.warning = None
    return b""


def _count(controller: XArmController, value: int) -> bytes:
    controller.counter = value & 0xFFFFFFFF
    return b""


_Simple = Callable[[XArmController, Identity, tuple[Any, ...]], bytes]
_SIMPLE: dict[Function, _Simple] = {
    Function.GET_VERSION: lambda c, identity, v: identity.encode_version(),
    Function.GET_SERIAL_NUMBERS: lambda c, identity, v: identity.encode_serials(),
    Function.CHECK_VERIFICATION: lambda c, i, v: b"\0",
    Function.RELOAD_DYNAMICS: lambda c, i, v: b"",
    Function.GET_REPORT_CURRENT: lambda c, i, v: bytes([c.settings.reports_currents]),
    Function.GET_APPROXIMATE: lambda c, i, v: bytes([c.settings.approximate]),
    Function.SYSTEM_CONTROL: lambda c, i, v: b"",
    Function.MOTION_ENABLE: lambda c, i, v: _set(c.enable(v[0], bool(v[1])), "joint", v[0], "must be a joint, or 8"),
    Function.SET_BRAKE: lambda c, i, v: _set(c.enable(v[0], not v[1]), "joint", v[0], "must be a joint, or 8"),
    Function.SET_STATE: lambda c, i, v: _set(c.set_state(v[0]), "state", v[0], "must be 0, 3, 4 or 6"),
    Function.SET_MODE: lambda c, i, v: _set(_set_mode(c, *v), "mode", v[0], "must be 0, 1, 2, 4, 5, 6 or 7"),
    Function.GET_STATE: lambda c, i, v: bytes([c.shown_state]),
    Function.GET_COMMAND_COUNT: lambda c, i, v: encode_values("H", min(c.queued, 0xFFFF)),
    Function.GET_ERROR: lambda c, i, v: bytes([c.error or 0, c.warning or 0]),
    Function.CLEAN_ERROR: lambda c, i, v: _clean_error(c),
    Function.CLEAN_WARNING: lambda c, i, v: _clean_warning(c),
    Function.CLEAN_CONFIGURATION: lambda c, i, v: b"",
    Function.SAVE_CONFIGURATION: lambda c, i, v: b"",
    Function.GET_TCP_POSE: lambda c, i, v: encode_values("f", *pose_as_mm_rpy(user_pose(c))),
    Function.GET_TCP_POSE_AXIS_ANGLE: lambda c, i, v: encode_values("f", *pose_as_mm_rotation(user_pose(c))),
    Function.GET_JOINTS: lambda c, i, v: _joints(c, v[0] if v else 1),
    Function.GET_FK: lambda c, i, v: encode_values("f", *pose_as_mm_rpy(_forward(c, v))),
    Function.IS_JOINT_LIMIT: lambda c, i, v: _is_joint_limit(c, v),
    Function.IS_TCP_LIMIT: lambda c, i, v: _is_tcp_limit(c, v),
    Function.GET_REDUCED_MODE: lambda c, i, v: bytes([c.settings.reduced]),
    Function.GET_REDUCED_STATE: lambda c, i, v: _reduced_state(c),
    Function.GET_JOINT_TORQUE: lambda c, i, v: encode_values("f", *padded(c.arm.measured_state.measured.tau.tolist())),
    Function.GET_MOVEMENT: lambda c, i, v: bytes([c.is_moving]),
    Function.RESET_COUNTER: lambda c, i, v: _count(c, 0),
    Function.INCREASE_COUNTER: lambda c, i, v: _count(c, c.counter + 1),
    Function.GET_POSE_OFFSET: lambda c, i, v: _pose_offset(v),
    Function.SERVO_READ_16: lambda c, i, v: bytes(4),
    Function.SERVO_READ_32: lambda c, i, v: bytes(4),
    Function.SERVO_STATUS: lambda c, i, v: servo_codes(c) + bytes(2),
    Function.GET_COMMON_PARAMETER: lambda c, i, v: _common_parameter(c, v[0]),
    Function.GET_POWER_VERSION: lambda c, i, v: bytes(6),
    Function.GET_HARDWARE_TYPES: lambda c, i, v: bytes(2),
}
