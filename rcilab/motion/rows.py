"""Block-wise access to the rows of long motions, and the slowdown at rows that exceed a limit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rcilab.core.arrays import Array

_BLOCK = 4096
"""Number of rows that are computed together. A table of them for 7 joints has 230 kB: it fits into the cache, and its
memory is not returned to the system. With larger tables, planning a motion of 100 s takes 1.5 times as long."""

OVERCORRECTION = 1.002
"""Factor on the square of the required slowdown, applied also slightly below a limit, so that few rounds are needed and
rows inside the limits stay inside when the cycles shift. Tuning value: 1 or 2 rounds on nine of ten single paths, whose
motions become 0.06 % longer."""


def blocks(count: int) -> Iterator[slice]:
    """Yields the rows 0 to `count` as consecutive slices."""
    for first in range(0, count, _BLOCK):
        yield slice(first, min(first + _BLOCK, count))


def spread(factor: Array, s: Array, knots: Array, reach: int) -> Array:
    """Returns the slowdown at each knot, shape (K + 1,), from the slowdown at each row.

    Args:
        factor: Slowdown of each row, 1 or more, shape (N,).
        s: Parameter of each row, not decreasing, shape (N,).
        knots: Parameters of the knots, increasing, shape (K + 1,).
        reach: Number of rows before and after a row that are slowed down as well.
    """
    factor = largest_around(factor, reach)
    result = np.interp(knots, s, factor)
    below = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    np.maximum.at(result, below, factor)
    np.maximum.at(result, below + 1, factor)
    return result


def largest_around(values: Array, reach: int) -> Array:
    """Returns the maximum over each value and `reach` neighbours on both sides, shape (N,); beyond the ends it is 1."""
    beyond = np.ones(reach)
    wide = np.concatenate((beyond, values, beyond))
    width, span = 2 * reach + 1, 1
    while span < width:
        step = min(span, width - span)
        wide = np.maximum(wide[:-step], wide[step:])
        span += step
    return wide
