"""The exceptions of the package, one family built from facts.

    RcilabError
      ModelError                 an unknown robot, an invalid description of an arm
      KinematicsError
        UnreachableError         no joint angles give this pose
        SingularError            the result is not defined at this configuration
      PlanningError
      ConformanceError           .violations: the motion violates a condition
        CertificateError         .changed: the certificate does not match the motion or the robot
      ProtocolError
        DecodeError              .offset: these bytes are not a valid message
        VersionMismatchError     .found, .expected
      CommandRejectedError       .command, .status: the controller refused a command
        ManualRecoveryError      the arm is too far outside its range or its safety box
      RecordedError              .run: the motion that it ended
        ConnectionLostError
        ControlError             .faults, .stop: the controller stopped the motion
      DeadlineError              also a TimeoutError
      UsageError                 also a RuntimeError: wrong call order
        InvalidValueError        also a ValueError: .name, .value

Facts are attributes of the exception, so that no code has to parse a message.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from rcilab.core.error_base import InvalidValueError, RcilabError, UsageError, plain_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "CertificateError",
    "CommandRejectedError",
    "ConformanceError",
    "ConnectionLostError",
    "ControlError",
    "DeadlineError",
    "DecodeError",
    "InvalidValueError",
    "KinematicsError",
    "ManualRecoveryError",
    "ModelError",
    "PlanningError",
    "ProtocolError",
    "RcilabError",
    "RecordedError",
    "SingularError",
    "UnreachableError",
    "UsageError",
    "VersionMismatchError",
    "plain_text",
]


class ModelError(RcilabError):
    """An unknown robot, or an invalid description of an arm."""


class KinematicsError(RcilabError):
    """A geometric problem without a solution."""


class UnreachableError(KinematicsError):
    """No joint angles give this pose.

    Attributes:
        distance: Distance of the wrist centre from the reachable shell, [m]; 0 when reach is not the reason.
        joint: Number of the joint (from 1) whose limit prevents it, or None.
        excess: Angle by which that joint would exceed its limit, [rad].
    """

    def __init__(self, message: str, *, distance: float = 0.0, joint: int | None = None, excess: float = 0.0) -> None:
        super().__init__(message)
        self.distance = distance
        self.joint = joint
        self.excess = excess


class SingularError(KinematicsError):
    """The result is not defined at this configuration: an axis vanishes or an angle has no reference."""


class PlanningError(RcilabError):
    """No motion can be planned for this request.

    Attributes:
        share: Point at which a path cannot be followed, as a fraction of its length, 0 to 1; None without such a point.
        waypoint: Number of the program's waypoint whose segment fails, from 1; None without a program.
    """

    def __init__(self, message: str, *, share: float | None = None, waypoint: int | None = None) -> None:
        super().__init__(message)
        self.share = share
        self.waypoint = waypoint


class ConformanceError(RcilabError):
    """A motion violates at least one necessary condition.

    Attributes:
        violations: The violated conditions, worst first.
    """

    def __init__(self, message: str, violations: Sequence[object] = ()) -> None:
        super().__init__(message)
        self.violations = tuple(violations)


class CertificateError(ConformanceError):
    """The motion was never checked, or something has changed since the check.

    Attributes:
        changed: The parts that differ: any of motion, model, limits, tool, load, safety box, start state.
    """

    def __init__(self, message: str, changed: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.changed = tuple(changed)


class ProtocolError(RcilabError):
    """The peer violates the protocol."""


class DecodeError(ProtocolError):
    """These bytes are not a valid message.

    Attributes:
        problem: What is wrong, without the offset.
        offset: Offset of the first wrong byte.
    """

    def __init__(self, message: str, offset: int = 0) -> None:
        super().__init__(f"{message} (at byte {offset})")
        self.problem, self.offset = message, offset


class VersionMismatchError(ProtocolError):
    """The two sides of an interface have different versions."""

    def __init__(
        self, what: str, found: object, expected: object, advice: str = "restart both sides from one rcilab"
    ) -> None:
        super().__init__(f"{what}: found version {found}, need {expected}; {advice}")
        self.found = found
        self.expected = expected
        self.coded("version", found=str(found), expected=str(expected))


class RecordedError(RcilabError):
    """An error that ended a motion, with the last recorded cycles.

    Attributes:
        record: The last cycles before the end, a structured array, one row per cycle; or None.
        run: The whole motion up to its end, an `rcilab.Run`, to plot, save and replay; None without a motion, or
            if it ran in another process.
        advice: The end of the message: what to do next, with the calls of Python. A user interface sets its own.
    """

    run: Any = None  # `rcilab.recording` is above this layer.
    advice: str = ""

    def __init__(self, message: str, record: NDArray[np.void] | None = None) -> None:
        super().__init__(message)
        self.record = record

    def __str__(self) -> str:
        return "; ".join(filter(None, (super().__str__(), self.advice)))

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the last cycles to a file; its ending selects the format: .csv or .npz. `run.save` writes all.

        Raises:
            UsageError: There is no record.
            InvalidValueError: The ending is unknown, or the file cannot be written.
        """
        from rcilab.core.cycle_log import save_cycles

        if self.record is None:
            raise UsageError("this error has no record: no cycle was recorded before it")
        save_cycles(self.record, file)


class ConnectionLostError(RecordedError):
    """The robot, the controller or a process of rcilab cannot be reached, or the connection to it ended."""


class CommandRejectedError(RcilabError):
    """The controller refused a command.

    Attributes:
        command: Name of the command.
        status: The status it returned.
    """

    def __init__(self, command: str, status: object, advice: str = "", *, reason: str = "") -> None:
        name = getattr(status, "name", str(status)).lower().replace("_", " ")
        super().__init__(f"{command} was refused: {name}" + (f"; {advice}" if advice else ""))
        self.coded("rejected", command=command, status=reason or name)
        self.command = command
        self.status = status


class ManualRecoveryError(CommandRejectedError):
    """The controller does not recover an arm that is so far outside its joint range or its safety box."""


SAFETY_STOP = "safety_stop"
"""Code of the `ControlError` of a motion that an emergency stop or the safety gate ended."""


class ControlError(RecordedError):
    """The controller reported faults and stopped the motion.

    Attributes:
        faults: The faults that were set, in wire order.
        finding: Joint, value and bound that the cycles show, an `i18n.translator.Remark`; "" if not known.
        stop: The cycles after `record` in which the controller stopped the arm; None if they were not received.
    """

    finding: str = ""
    stop: NDArray[np.void] | None = None

    def __init__(self, message: str, faults: Sequence[object] = (), record: NDArray[np.void] | None = None) -> None:
        super().__init__(message, record)
        self.faults = tuple(faults)


class DeadlineError(RcilabError, TimeoutError):
    """A deadline was missed."""
