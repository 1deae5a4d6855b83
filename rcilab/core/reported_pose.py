"""A pose as a robot reports it: 16 numbers of a datagram, decoded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import DTypeLike

from rcilab.core.arrays import Array, Matrix
from rcilab.core.spatial import Pose


class ReportedPose(Pose):
    """A `Pose` that is decoded on first use, because a state with two of them arrives every millisecond.

    Args:
        numbers: A homogeneous transform, shape (4, 4) or (16,) row-major, [m]. Not checked, never modified.
    """

    __slots__ = ("_numbers",)

    def __init__(self, numbers: Array) -> None:
        self._numbers = numbers

    if not TYPE_CHECKING:  # A type checker would accept every attribute name.

        def __getattr__(self, name: str) -> object:
            """Decodes rotation and position at the first access to one of them; then they are attributes."""
            if name not in ("_r", "_p"):
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            a, b, c, x, d, e, f, y, g, h, i, z = self._numbers.ravel()[:12].tolist()
            self._r = a, b, c, d, e, f, g, h, i
            self._p = x, y, z
            return getattr(self, name)

    def as_row_major(self) -> tuple[float, ...]:
        """Returns the 16 numbers as reported."""
        return tuple(self._numbers.ravel().tolist())

    def tobytes(self) -> bytes:
        """Returns the numbers as 16 little-endian doubles."""
        return self._numbers.tobytes()

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Matrix:
        return np.array(self._numbers, dtype=dtype).reshape(4, 4)
