"""What supervisor and control process send each other: one frozen dataclass for each request, and the reply.

Both ends are one build, and the shared block is memory without a name that only these two processes have open. So
messages are pickled; nothing else can put one there.
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

_OVERHEAD = 256  # [bytes] Left for what surrounds an error in its reply.
_LONGEST = 1000  # Characters that are kept of a sentence that does not fit.


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The arm, as far as the control process needs it when it starts."""

    arm: ExpectedArm
    limits: Limits
    T_flange_tool: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class Connect:
    """Make a connection to a controller, in place of the present one."""

    address: str
    timeout: float
    """For the connection and every answer, [s]."""
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
    """Stop what moves."""

    number: int
    """How many stops were requested so far, this one included."""


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
    """Stream the first rows of the block's motion region."""

    rows: int
    duration: float
    """[s]"""
    mode: Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchRows:
    """Continue the motion in progress with other rows of the block's motion region."""

    first: int
    """Cycle of the motion from which on they are streamed."""
    start: int
    """Index of the first row in the region."""
    rows: int
    holds: bool
    """Whether the arm waits at the last one."""
    duration: float
    """New duration of the motion, [s]."""


@dataclass(frozen=True, slots=True)
class Jog:
    """Follow the jog that is held in the block."""


@dataclass(frozen=True, slots=True)
class End:
    """Stop what moves and end the process."""


Request: TypeAlias = (
    Connect | Configure | SetPower | SetOutput | ReadInputs | Reboot | Recover | Stop
    | StartGuiding | StopGuiding | Execute | SwitchRows | Jog | End
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class NumberedRequest:
    """A request as it is sent."""

    id: int
    """Its number, which the reply repeats."""
    body: Request


@dataclass(frozen=True, slots=True)
class Reply:
    """What became of a request."""

    id: int
    error: RcilabError | None = None


def as_sendable(error: Exception) -> RcilabError:
    """Returns an error that fits into a reply.

    The recorded cycles are left out: they are in the ring. An error that is not an RcilabError is a defect, and its
    sentence says so.
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
    except Exception:  # Any object may be the value of an InvalidValueError, and pickle raises what that raises.
        pass
    return _shortened(type(error), str(error))


def _shortened(kind: type[RcilabError], sentence: str) -> RcilabError:
    error: RcilabError = kind.__new__(kind)
    error.args = (sentence[:_LONGEST],)
    return error
