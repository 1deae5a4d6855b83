"""Long motions in blocks: tables that stay in the cache."""

from __future__ import annotations

from collections.abc import Iterator

_BLOCK = 4096
"""Rows that are computed together. A choice: a table of them, of 7 joints, has 230 kB and is neither given back to the
system nor fetched from memory again and again, which made motions of 100 s cost half as much again for each second."""


def blocks(count: int) -> Iterator[slice]:
    """Yields the rows 0 to `count` in slices, one after the other."""
    for first in range(0, count, _BLOCK):
        yield slice(first, min(first + _BLOCK, count))
