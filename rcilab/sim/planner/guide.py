"""Joint angles close to those of a path of the tool, as a smooth function of its share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.motion.hermite import State, quintic

_Columns: TypeAlias = "list[tuple[float, ...]]"


class Guide:
    """A curve with continuous second derivative, from which the inverse kinematics find the exact joint angles.

    The angles that a redundant arm reaches with least motion depend on the steps that lead there. Those near the
    guide depend on the share alone, so that a path may be entered anywhere.

    Args:
        pieces: Coefficients of the quintic on each of the even intervals, by ascending power, shape (N, n) each.
    """

    def __init__(self, pieces: tuple[Array, ...]) -> None:
        self._table: list[_Columns] = [
            list(zip(*rows, strict=True)) for rows in zip(*(power.tolist() for power in pieces), strict=True)
        ]

    @classmethod
    def through(cls, rows: Sequence[Sequence[float]]) -> Guide:
        """Returns the guide through joint angles at even shares, N + 1 rows of n, N >= 2."""
        q = np.array(rows)
        step = 1.0 / (len(q) - 1)
        first = np.gradient(q, step, axis=0, edge_order=2)
        second = np.empty_like(q)
        second[1:-1] = np.diff(q, 2, axis=0) / step**2
        second[0], second[-1] = second[1], second[-2]
        left = q[:-1], first[:-1], second[:-1]
        return cls(quintic(left, (q[1:], first[1:], second[1:]), step))

    @classmethod
    def between(cls, left: State, right: State) -> Guide:
        """Returns the guide of a single quintic, from states at share 0 and 1."""
        return cls(tuple(power[np.newaxis] for power in quintic(left, right, 1.0)))

    def at(self, share: float) -> list[float]:
        """Returns the joint angles at a share, n plain floats, [rad]."""
        n = len(self._table)
        position = share * n
        piece = min(max(int(position), 0), n - 1)
        u = position - piece
        return [a + u * (b + u * (c + u * (d + u * (e + u * f)))) for a, b, c, d, e, f in self._table[piece]]
