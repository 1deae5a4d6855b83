"""What can go wrong, as one family of exceptions built from facts.

    RcilabError
      ModelError                 an unknown robot, a description that is no arm
      KinematicsError
        UnreachableError         no joint angles give this pose
        SingularError            the answer is not defined at this place
      PlanningError
      ConformanceError           .violations: the motion breaks a condition
        CertificateError         .changed: judged, but not this motion, or not any more
      ProtocolError
        DecodeError              .offset: these bytes are no message
        VersionMismatchError     .found, .expected
      ConnectionLostError
      CommandRejectedError       .command, .status: the controller said no
      ControlError               .faults, .record: the controller stopped the motion
      DeadlineError              also a TimeoutError
      UsageError                 also a RuntimeError: wrong call order
        InvalidValueError        also a ValueError: .name, .value

Facts stay on the exception as attributes; nobody has to search a message for meaning.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from os import PathLike
from typing import Any

from rcilab.core.error_base import InvalidValueError, RcilabError, UsageError, plain_text

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
    """An unknown robot, or a description that is no arm."""


class KinematicsError(RcilabError):
    """A geometric question without an answer."""


class UnreachableError(KinematicsError):
    """No joint angles give this pose.

    Attributes:
        distance: How far the wrist centre is from the reachable shell, [m]; 0 when reach is not the reason.
        joint: Number of the joint (from 1) whose limit is in the way, or None.
        excess: How far that joint would have to pass its limit, [rad].
    """

    def __init__(self, message: str, *, distance: float = 0.0, joint: int | None = None, excess: float = 0.0) -> None:
        super().__init__(message)
        self.distance = distance
        self.joint = joint
        self.excess = excess


class SingularError(KinematicsError):
    """The answer is not defined here: an axis is lost or an angle has no reference."""


class PlanningError(RcilabError):
    """No motion could be made from this request.

    Attributes:
        share: Where a path cannot be followed, as a part of the way, 0 to 1; None where it is no matter of place.
        waypoint: Number of the waypoint of a program on the way to which it is, from 1; None where it is no program's.
    """

    def __init__(self, message: str, *, share: float | None = None, waypoint: int | None = None) -> None:
        super().__init__(message)
        self.share = share
        self.waypoint = waypoint


class ConformanceError(RcilabError):
    """A motion breaks at least one necessary condition.

    Attributes:
        violations: The violated conditions, worst first.
    """

    def __init__(self, message: str, violations: Sequence[object] = ()) -> None:
        super().__init__(message)
        self.violations = tuple(violations)


class CertificateError(ConformanceError):
    """The motion was never judged, or something it was judged with has changed since.

    Attributes:
        changed: What differs: any of motion, model, limits, tool, load, safety box, start state.
    """

    def __init__(self, message: str, changed: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.changed = tuple(changed)


class ProtocolError(RcilabError):
    """The other side does not speak as agreed."""


class DecodeError(ProtocolError):
    """These bytes are no message.

    Attributes:
        problem: What is wrong, without the place.
        offset: Where the first wrong byte stands.
    """

    def __init__(self, message: str, offset: int = 0) -> None:
        super().__init__(f"{message} (at byte {offset})")
        self.problem, self.offset = message, offset


class VersionMismatchError(ProtocolError):
    """Two sides of an interface were built from different versions of it."""

    def __init__(
        self, what: str, found: object, expected: object, advice: str = "restart both sides from one rcilab"
    ) -> None:
        super().__init__(f"{what}: found version {found}, need {expected}; {advice}")
        self.found = found
        self.expected = expected
        self.coded("version", found=str(found), expected=str(expected))


class RecordedError(RcilabError):
    """Something ended a motion, and this is what the last cycles were.

    Attributes:
        record: The last cycles before the end, as recorded: a structured array, one row a cycle; or None.
        run: The whole motion up to its end, an `rcilab.Run`: to be plotted, saved and replayed; None where none was
            under way, or where it ran in another process.
    """

    run: Any = None

    def __init__(self, message: str, record: Any = None) -> None:
        super().__init__(message)
        self.record = record

    def save(self, file: str | PathLike[str]) -> None:
        """Writes the last cycles to a file; its ending chooses the format: .csv or .npz. `run.save` writes them all.

        Raises:
            UsageError: There is no record.
            InvalidValueError: The ending is unknown, or the file cannot be written.
        """
        from rcilab.core.cycle_log import save_cycles

        if self.record is None:
            raise UsageError("this error carries no record: nothing was recorded before it")
        save_cycles(self.record, file)


class ConnectionLostError(RecordedError):
    """The robot, the controller or a process of ours is not there, or is there no longer."""


class CommandRejectedError(RcilabError):
    """The controller answered a command with a refusal.

    Attributes:
        command: Name of the command.
        status: The status that came back.
    """

    def __init__(self, command: str, status: object, advice: str = "", *, reason: str = "") -> None:
        name = getattr(status, "name", str(status)).lower().replace("_", " ")
        super().__init__(f"{command} was refused: {name}" + (f"; {advice}" if advice else ""))
        self.coded("rejected", command=command, status=reason or name)
        self.command = command
        self.status = status


SAFETY_STOP = "safety_stop"
"""Code of the `ControlError` of a motion that an emergency stop or the safety gate ended."""


class ControlError(RecordedError):
    """The controller reported faults and stopped the motion.

    Attributes:
        faults: The faults that were set, in wire order.
        stop: The cycles after `record`, in which the controller brought the arm to rest, alike; None where not seen.
    """

    stop: Any = None

    def __init__(self, message: str, faults: Sequence[object] = (), record: Any = None) -> None:
        super().__init__(message, record)
        self.faults = tuple(faults)


class DeadlineError(RcilabError, TimeoutError):
    """Something did not happen in time."""
