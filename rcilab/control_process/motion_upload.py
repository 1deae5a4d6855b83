"""Hand-over of a motion to the control process: its preconditions, its rows in the shared block, and later changes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.conformance.certificate import Certificate, require_certificate
from rcilab.control_process.layout import MOTION_ROWS, MOTION_TIME, OPERATOR_TIMEOUT, ControlBlock
from rcilab.control_process.messages import SwitchRows
from rcilab.control_process.requests import PendingRequest
from rcilab.control_process.status import SupervisorStatus
from rcilab.core.arrays import JointVector
from rcilab.core.errors import CertificateError, PlanningError, RcilabError, UsageError
from rcilab.core.state import Mode, require_mode
from rcilab.execution.command_validation import find_start_mismatch
from rcilab.makers.driver import require_signals
from rcilab.makers.maker import commanded_start, start_tolerance_of
from rcilab.motion import Motion, require_motion
from rcilab.motion.motion_event import cycle_events
from rcilab.motion.speed_scaling import SpeedScaledMotion

if TYPE_CHECKING:
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel


def require_admissible(
    motion: Motion,
    certificate: Certificate | None,
    model: RobotModel,
    status: SupervisorStatus,
    *,
    is_operator_overdue: bool,
    box: SafetyBox | None = None,
    mode: Mode = "joint_position",
) -> None:
    """Requires that the motion may begin now.

    Args:
        motion: The motion.
        certificate: Its certificate from `check`.
        model: The arm.
        status: Present status of the arm.
        is_operator_overdue: Whether an operator is expected and absent.
        box: The safety box of the controller.
        mode: How the arm is to be commanded.

    Raises:
        InvalidValueError: The motion or the certificate has another type, such as a report.
        CertificateError: The certificate is missing, or does not fit the motion, the model, or the position of the
            arm.
        UsageError: The arm is moving, no controller is connected, no operator is present, or the motion is too long.
    """
    require_motion(motion)
    require_certificate(certificate)
    require_mode(mode)
    require_signals(motion.events, model)
    q_c = require_ready(status, is_operator_overdue=is_operator_overdue)
    q_c = commanded_start(motion.q[0], q_c, model)
    if certificate is None:
        raise CertificateError("the motion has not been checked: check(motion, model) first", ["certificate"])
    mismatch = find_start_mismatch(motion.q[0], q_c, start_tolerance_of(model))
    if mismatch is not None:
        raise CertificateError(mismatch, ["start state"])
    certificate.verify(motion, model, q_c, box, mode=mode)
    if len(motion.q) > MOTION_ROWS:
        raise UsageError(
            f"the motion takes {motion.duration:.1f} s, at most {MOTION_TIME:g} s are possible; split it"
        ).coded("long_motion", duration=f"{motion.duration:.1f}", most=f"{MOTION_TIME:g}")


def require_ready(status: SupervisorStatus, *, is_operator_overdue: bool) -> JointVector:
    """Returns the commanded joint angles, shape (n,), [rad], if the arm may be moved now.

    Args:
        status: Present status of the arm.
        is_operator_overdue: Whether an operator is expected and absent.

    Raises:
        UsageError: The arm is moving, no controller is connected, or no operator is present.
    """
    if status.phase in ("moving", "stopping"):
        raise UsageError("the arm is moving; stop it first, or wait until it has arrived").coded("moving")
    if status.q_c is None or status.phase not in ("idle", "fault"):
        raise UsageError(f"no motion is possible now: {status.message}").coded("not_ready")
    if is_operator_overdue:
        raise UsageError(f"the operator's page does not respond: no heartbeat for {OPERATOR_TIMEOUT:g} s").coded(
            "no_operator", seconds=f"{OPERATOR_TIMEOUT:g}"
        )
    return status.q_c


_REPLY_TIMEOUT = 0.5  # [s] For the control process to handle a switch; it polls requests in every cycle.
_MIN_LEAD = 5  # Cycles that the control process needs to read a request.


@dataclass(frozen=True, slots=True)
class _Region:
    """A range of rows in the block, with the cycle of its first row."""

    first: int
    """Cycle of the first row."""
    start: int
    """Index of the first row in the block."""
    count: int


class SharedRows:
    """The `RowSink` of a supervisor.

    Args:
        block: The shared block.
        lock: Guards the requests.
        read_cycle: Returns the present cycle of the motion; raises UsageError if none is in progress.
        send: Sends a `SwitchRows` request.
    """

    def __init__(
        self,
        block: ControlBlock,
        lock: AbstractContextManager[object],
        read_cycle: Callable[[], int],
        send: Callable[[SwitchRows], PendingRequest],
    ) -> None:
        self._block = block
        self._lock = lock
        self._send = send
        self.cycle = read_cycle
        self._in_use: list[_Region] = []
        self._last: tuple[PendingRequest, list[_Region]] | None = None  # The last switch, and the regions before it.

    def begin(self, motion: SpeedScaledMotion) -> None:
        """Writes the rows of a new motion.

        Raises:
            PlanningError: The region is too small: at this speed the motion takes too long.
        """
        rows = motion.q
        if len(rows) > MOTION_ROWS:
            raise _too_long_error(motion)
        self._block.motion[: len(rows)] = rows
        self._in_use, self._last = [_Region(0, 0, len(rows))], None

    def switch(self, first: int, changed: SpeedScaledMotion) -> PendingRequest | None:
        """Writes changed rows into a free part of the region and requests the switch; None: it is too late for that.

        Raises:
            PlanningError: No free part is large enough: the motion would take too long.
        """
        with self._lock:
            cycle = self.cycle()
            if first < cycle + _MIN_LEAD:
                return None
            started = [region for region in self._in_use if region.first <= cycle]
            used = [*started[-1:], *(region for region in self._in_use if region.first > cycle)]
            rows = changed.q[first:]
            start = _find_room(used, len(rows))
            if start is None:
                raise _too_long_error(changed)
            self._block.motion[start : start + len(rows)] = rows
            pending = self._send(
                SwitchRows(
                    first=first,
                    start=start,
                    rows=len(rows),
                    holds=changed.is_held,
                    duration=changed.duration,
                    events=cycle_events(changed),
                )
            )
            self._last = pending, self._in_use
            self._in_use = [*self._in_use[-2:], _Region(first, start, len(rows))]
            return pending

    def was_refused(self) -> bool:
        """Returns whether the control process refused the last switch; waits for the reply.

        Raises:
            UsageError: The reply has not arrived yet.
        """
        if self._last is None:
            return False
        pending, in_use = self._last
        with suppress(RcilabError):
            pending.wait(_REPLY_TIMEOUT)
        if not pending.done:
            raise UsageError("the last change of the speed override is still being sent; try again").coded(
                "override_busy"
            )
        self._last = None
        if pending.error is None:
            return False
        self._in_use = in_use
        return True


def _too_long_error(motion: SpeedScaledMotion) -> PlanningError:
    return PlanningError(
        f"at this speed override the motion would take {motion.duration:.0f} s, and at most {MOTION_TIME:g} s, less "
        "the part in progress, can be sent; choose a higher one"
    ).coded("override_too_long", duration=f"{motion.duration:.0f}", most=f"{MOTION_TIME:g}")


def _find_room(used: list[_Region], count: int) -> int | None:
    """Returns the first index of `count` free rows; None if no gap is large enough."""
    start = 0
    for region in sorted(used, key=lambda region: region.start):
        if start + count <= region.start:
            return start
        start = max(start, region.start + region.count)
    return start if start + count <= MOTION_ROWS else None
