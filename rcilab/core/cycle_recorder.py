"""The recorder of cycles: one fixed-size row per cycle in reserved memory."""

from __future__ import annotations

import math
import mmap
import struct
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import cycle_dtype

RECORD_TIME = 60.0  # [s] Default capacity: longer than most motions, about 50 MB.
_NO_POSE = (math.nan,) * 16


class Recorder:
    """A ring of cycles. Owned by the thread that runs the loop; others read copies.

    Args:
        n: Number of joints.
        capacity: Number of rows; a full recorder overwrites the oldest row.
        buffer: Writable memory to use, such as a part of a shared block; None allocates it.
        complete: Whether rows store every field of the state.
    """

    def __init__(
        self,
        n: int,
        capacity: int = round(RECORD_TIME / CYCLE_TIME),
        buffer: memoryview | bytearray | mmap.mmap | None = None,
        *,
        complete: bool = False,
    ) -> None:
        dtype = cycle_dtype(n, complete=complete)
        self.n = n
        self.complete = complete
        self.capacity = capacity
        self.count = 0
        """Number of rows written; the newest is number `count - 1`."""
        self._size = dtype.itemsize
        memory = _reserve(capacity * self._size) if buffer is None else buffer
        self._memory = memory
        self._rows: NDArray[np.void] = np.frombuffer(memory, dtype=dtype, count=capacity)
        start = f"<Qdqqdd{4 * n}dQIBBBB{2 * n + 17}d"
        rest = self._size - struct.calcsize(start)
        self._unknown = np.full(rest // 8, math.nan).tobytes()
        self._pack = struct.Struct(f"{start}{rest}s").pack_into
        self._pack_start = struct.Struct("<Qdqqd").pack_into
        self._pack_lost = struct.Struct("<I").pack_into
        self._lost_offset = struct.calcsize(f"<Qdqqdd{4 * n}dQ")
        self._nothing = (math.nan,) * n

    def write(
        self,
        message_id: int,
        t: float,
        received_ns: int,
        sent_ns: int,
        lateness: float,
        success_rate: float,
        q: Sequence[float],
        q_c: Sequence[float],
        dq: Sequence[float],
        command: Sequence[float],
        faults: int,
        lost: int,
        modes: Sequence[int],
        tau: Sequence[float] | None = None,
        pose: Sequence[float] = _NO_POSE,
        psi: float = math.nan,
        command_tau: Sequence[float] | None = None,
        *,
        braking: bool = False,
        rest: bytes = b"",
    ) -> None:
        """Writes one row; see `cycle_dtype` for the meaning.

        `modes`: robot, controller, motion generator. `pose`: 16 numbers, row-major, sent in answer like `psi`. `rest`:
        the fields from `STATE_FIELDS` on, as bytes.
        """
        self._pack(
            self._memory,
            self.count % self.capacity * self._size,
            message_id, t, received_ns, sent_ns, lateness, success_rate,
            *q, *q_c, *dq, *command,
            faults, lost, *modes, braking,
            *(tau or self._nothing), *pose, psi, *(command_tau or self._nothing), rest or self._unknown,
        )  # fmt: skip
        self.count += 1

    def repeat(self, message_id: int, received_ns: int, lateness: float, lost: int) -> None:
        """Writes a copy of the newest row with these values, for a cycle without an answer."""
        memory, size = self._memory, self._size
        newest, start = (self.count - 1) % self.capacity * size, self.count % self.capacity * size
        memory[start : start + size] = memory[newest : newest + size]
        self._pack_start(memory, start, message_id, math.nan, received_ns, 0, lateness)
        self._pack_lost(memory, start + self._lost_offset, lost)
        self.count += 1

    @property
    def truncated(self) -> bool:
        """Whether the oldest rows have been overwritten."""
        return self.count > self.capacity

    def rows(self, start: int = 0) -> NDArray[np.void]:
        """Returns a copy of the rows that were not overwritten, oldest first.

        Args:
            start: Number of the first row to return.
        """
        first = max(start, self.count - self.capacity, 0)
        return self._rows[np.arange(first, self.count) % self.capacity]

    def last(self, count: int) -> NDArray[np.void]:
        """Returns a copy of the newest rows, at most `count`, oldest first."""
        return self.rows(self.count - count)


def _reserve(size: int) -> mmap.mmap:
    """Returns memory whose pages cost nothing until they are written, each less than a microsecond then."""
    memory = mmap.mmap(-1, size)
    with suppress(OSError):  # A kernel without huge pages.
        memory.madvise(mmap.MADV_NOHUGEPAGE)  # To clear a huge one takes a part of the cycle.
    return memory
