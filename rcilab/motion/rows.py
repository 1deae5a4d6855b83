"""Rows of long motions in blocks that fit into the cache, and the slowdown at rows that exceed a limit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rcilab.core.arrays import Array

_BLOCK = 4096
"""Rows that are computed together. A table of them for 7 joints has 230 kB: it stays in the cache and is not returned
to the system. With larger tables, motions of 100 s took half as long again."""


def blocks(count: int) -> Iterator[slice]:
    """Yields the rows 0 to `count` in slices, one after the other."""
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
    """Returns the largest of each value and of so many before and after it, shape (N,); beyond the ends counts as 1."""
    beyond = np.ones(reach)
    wide = np.concatenate((beyond, values, beyond))
    width, span = 2 * reach + 1, 1
    while span < width:
        step = min(span, width - span)
        wide = np.maximum(wide[:-step], wide[step:])
        span += step
    return wide
