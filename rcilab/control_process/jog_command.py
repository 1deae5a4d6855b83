"""The jog that somebody holds: one small record in the shared block, renewed as long as it is held."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from numpy.typing import ArrayLike

from rcilab.control_process.layout import Counter
from rcilab.core.arrays import as_vector
from rcilab.core.errors import InvalidValueError

JogKind: TypeAlias = Literal["joint", "base", "tool"]
"""What the numbers are: joint velocities, or a twist of the tool in axes of the base or of the tool."""

HOLD_TIMEOUT = 0.3  # [s] A jog that is not renewed for that long was let go; a page renews it ten times a second.

_KINDS: tuple[JogKind, ...] = get_args(JogKind)
_RECORD = struct.Struct("<qq7d")  # place of the kind, count of the numbers, the numbers
_ATTEMPTS = 3  # The writer needs a microsecond; who meets it in mid-sentence goes on with the last jog.


@dataclass(frozen=True, slots=True)
class JogCommand:
    """How the arm shall move while it is held."""

    kind: JogKind
    values: tuple[float, ...]
    """n joint velocities, [rad/s], or six numbers of a twist, linear first, [m/s, rad/s]."""

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise InvalidValueError("kind", self.kind, f"is no way to jog; there are {', '.join(_KINDS)}")


def build_jog(kind: JogKind, values: ArrayLike, n: int) -> JogCommand:
    """Returns a jog of an arm with n joints.

    Raises:
        InvalidValueError: The kind is unknown, or the values are not as many finite numbers as it needs.
    """
    size, unit = (n, "rad/s") if kind == "joint" else (6, "m/s, rad/s")
    return JogCommand(kind, tuple(as_vector(values, size, "values", unit).tolist()))


def hold_jog(memory: memoryview, counters: memoryview, command: JogCommand) -> None:
    """Writes the jog that is held now, and when."""
    write_jog(memory, counters, command)
    counters[Counter.JOG_BEAT] = time.monotonic_ns()


def release_jog(counters: memoryview) -> None:
    """Says that nothing is held any more."""
    counters[Counter.JOG_BEAT] = 0


def is_held(counters: memoryview) -> bool:
    """Returns whether a jog has been held within the last `HOLD_TIMEOUT`."""
    return time.monotonic_ns() - counters[Counter.JOG_BEAT] <= HOLD_TIMEOUT * 1e9


def write_jog(memory: memoryview, counters: memoryview, command: JogCommand) -> None:
    """Writes the jog; the sequence word is odd meanwhile."""
    numbers = (*command.values, *(0.0,) * (7 - len(command.values)))
    sequence = counters[Counter.JOG] | 1
    counters[Counter.JOG] = sequence
    _RECORD.pack_into(memory, 0, _KINDS.index(command.kind), len(command.values), *numbers)
    counters[Counter.JOG] = sequence + 1


def read_jog(memory: memoryview, counters: memoryview) -> JogCommand | None:
    """Returns the jog as a whole, or None when it is just being written."""
    for _ in range(_ATTEMPTS):
        before = counters[Counter.JOG]
        kind, count, *numbers = _RECORD.unpack_from(memory, 0)
        if before % 2 == 0 and counters[Counter.JOG] == before:
            return JogCommand(_KINDS[kind], tuple(numbers[:count]))
    return None
