"""Rows of long motions: in blocks that stay in the cache, and how much slower to pass where a limit is exceeded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rcilab.core.arrays import Array

_BLOCK = 4096
"""Rows that are computed together. Tuning value: a table of them, of 7 joints, has 230 kB and is neither given back to
the system nor fetched from memory again and again, which would make motions of 100 s half as slow again."""


def blocks(count: int) -> Iterator[slice]:
    """Yields the rows 0 to `count` in slices, one after the other."""
    for first in range(0, count, _BLOCK):
        yield slice(first, min(first + _BLOCK, count))


def spread(factor: Array, s: Array, knots: Array, reach: int) -> Array:
    """Returns by how much to slow down at each knot, shape (K + 1,), given by how much to do so at each row.

    Args:
        factor: How much slower to pass each row, 1 or more, shape (N,).
        s: Where each row is, not decreasing, shape (N,).
        knots: Where the knots are, increasing, shape (K + 1,).
        reach: How many rows before and after a row it concerns as well.
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
