"""Messages between supervisor and control process: one frozen dataclass per request, and the reply.

Messages are pickled. That is safe: both ends run the same build, and only these two processes have the shared block
open.
"""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass
from typing import TypeAlias

from rcilab.control_process.layout import MESSAGE_SIZE
from rcilab.core.errors import RcilabError, RecordedError
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose
from rcilab.core.state import Mode
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ExpectedArm, GuideKind, GuideSpace
from rcilab.motion.motion_event import CycleEvent
from rcilab.motion.speed_scaling import Shift

_OVERHEAD = 256  # [bytes] Of a reply, in addition to its error.
_MAX_TEXT = 1000  # Characters; longer texts are cut.


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerSettings:
    """The data of the arm that the control process needs when it starts."""

    arm: ExpectedArm
    limits: Limits
    T_flange_tool: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class Connect:
    """Connect to a controller; replaces the present connection."""

    address: str
    timeout: float
    """For the connection and every response, [s]."""
    configuration: RobotConfiguration


@dataclass(frozen=True, slots=True)
class Configure:
    """Send the controller a configuration."""

    configuration: RobotConfiguration


@dataclass(frozen=True, slots=True)
class SetPower:
    """Switch motor power."""

    on: bool


@dataclass(frozen=True, slots=True)
class SetOutput:
    """Set a digital output, and read the inputs again."""

    signal: int
    level: bool


@dataclass(frozen=True, slots=True)
class ReadInputs:
    """Read the digital inputs."""


@dataclass(frozen=True, slots=True)
class Reboot:
    """Restart the controller."""


@dataclass(frozen=True, slots=True)
class Recover:
    """Clear the controller's faults."""


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop the motion or the hand guiding in progress."""

    number: int
    """Number of stops requested so far, including this one."""


@dataclass(frozen=True, slots=True)
class StartGuiding:
    """Free the arm for hand guiding."""

    space: GuideSpace
    kind: GuideKind


@dataclass(frozen=True, slots=True)
class StopGuiding:
    """End hand guiding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Execute:
    """Stream the motion: the first rows of the block's motion region."""

    rows: int
    duration: float
    """[s]"""
    mode: Mode
    events: tuple[CycleEvent, ...] = ()
    """What happens on the way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchRows:
    """Continue the motion in progress with other rows of the block's motion region."""

    first: int
    """First cycle of the motion that streams them."""
    start: int
    """Index of the first row in the region."""
    rows: int
    holds: bool
    """Whether the arm waits at the last row."""
    duration: float
    """New duration of the motion, [s]."""
    events: tuple[CycleEvent, ...] = ()
    """All events of the motion, with their new cycles."""


@dataclass(frozen=True, slots=True)
class Jog:
    """Follow the jog in the block."""


@dataclass(frozen=True, slots=True)
class End:
    """Stop the arm and end the process."""


Request: TypeAlias = (
    Connect | Configure | SetPower | SetOutput | ReadInputs | Reboot | Recover | Stop
    | StartGuiding | StopGuiding | Execute | SwitchRows | Jog | End
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class NumberedRequest:
    """A request with its number."""

    id: int
    """The reply has the same number."""
    body: Request


@dataclass(frozen=True, slots=True)
class Reply:
    """The result of a request."""

    id: int
    error: RcilabError | None = None
    reported: RobotConfiguration | None = None
    """What the controller reports of its configuration, after it was connected or configured."""
    shifts: tuple[Shift, ...] = ()
    """Where a motion waited or left cycles out."""


def as_sendable(error: Exception) -> RcilabError:
    """Returns an error that fits into a reply.

    It has no recorded cycles: they are in the ring. An error that is not an RcilabError is reported as a defect.
    """
    if not isinstance(error, RcilabError):
        return _shortened(
            RcilabError, f"the control process failed with {type(error).__name__}: {error}; this is a defect"
        )
    if isinstance(error, RecordedError):
        error = copy.copy(error)
        error.record = None
        error.__dict__.pop("stop", None)
        error.__dict__.pop("run", None)
    try:
        if len(pickle.dumps(error)) <= MESSAGE_SIZE - _OVERHEAD:
            return error
    except Exception:  # The value of an InvalidValueError may be any object, and pickling it may raise anything.
        pass
    return _shortened(type(error), str(error))


def _shortened(kind: type[RcilabError], text: str) -> RcilabError:
    error: RcilabError = kind.__new__(kind)
    error.args = (text[:_MAX_TEXT],)
    return error
