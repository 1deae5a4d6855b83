"""The feasible ranges of the arm angle at a pose, and the reasons against the other ranges."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, remainder, tau
from typing import Literal, TypeAlias

Reason: TypeAlias = Literal["joint limits", "singularity", "safety box", "reach"]
"""Reason against an arm angle; "reach": no solution at this angle, possible for an arm with offsets."""

INSIDE = 0.1
"""Distance inside a range of an automatically selected arm angle, [rad]. Tuning value: about six degrees."""

_TOLERANCE = 1e-12  # [rad] Rounding of arm angles.
_LIMITING: frozenset[Reason] = frozenset({"joint limits", "reach"})
"""Reasons for which no branch exists inside the joint limits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Arc:
    """A range of arm angles with the same branches and reasons."""

    start: float
    """Start, [rad] in [-pi, pi)."""
    end: float
    """End, [rad], above start by at most a full turn."""
    reasons: tuple[Reason, ...]
    """Reasons against it; empty if it is feasible."""
    joints: tuple[int, ...]
    """Numbers (from 1) of the joints beyond their limits in the branch with the fewest; empty if a branch has none."""
    branches: tuple[int, ...]
    """Branches inside every joint limit, counted from 0 as in `Solutions.all`; empty for an arm with offsets, whose
    branches begin and end within the circle."""

    @property
    def ok(self) -> bool:
        """Whether at least one branch is feasible here."""
        return not self.reasons

    def contains(self, psi: float) -> bool:
        """Returns whether an arm angle, [rad], is in this range, ends included."""
        return (psi - self.start) % tau <= self.end - self.start


@dataclass(frozen=True, slots=True, kw_only=True)
class FeasibleArcs:
    """The whole circle of arm angles at one pose."""

    arcs: tuple[Arc, ...]
    """In order, from the smallest start; together a full turn."""

    @property
    def feasible(self) -> tuple[tuple[float, float], ...]:
        """Ranges (start, end) of arm angles with at least one feasible branch, [rad], end above start."""
        return _joined([(arc.start, arc.end) for arc in self.arcs if arc.ok])

    def nearest(self, psi: float, branch: int | None = None) -> float | None:
        """Returns the arm angle closest to `psi`, [rad], at which a branch is inside every joint limit, or None.

        Unless `psi` itself is possible, it is `INSIDE` a feasible range, or in the middle of a narrower one. If no
        range is feasible (the whole circle is singular, or the tool is outside the safety box), only joint limits
        count.

        Args:
            psi: Desired arm angle, [rad].
            branch: Required branch, 0 to 7; None for any.
        """
        within_limits = [arc for arc in self.arcs if _LIMITING.isdisjoint(arc.reasons)]
        possible = within_limits if branch is None else [arc for arc in self.arcs if branch in arc.branches]
        if any(_is_within(psi, *ends) for ends in _joined([(arc.start, arc.end) for arc in possible])):
            return remainder(psi, tau)
        found: float | None = None
        free = [arc for arc in possible if arc.ok] or possible
        for start, end in _joined([(arc.start, arc.end) for arc in free]):
            middle, inner = 0.5 * (start + end), max(0.5 * (end - start) - INSIDE, 0.0)
            offset = remainder(psi - middle, tau)
            angle = middle + min(max(offset, -inner), inner)
            if found is None or abs(remainder(angle - psi, tau)) < abs(remainder(found - psi, tau)):
                found = angle
        return None if found is None else remainder(found, tau)

    def at(self, psi: float) -> Arc:
        """Returns the arc that contains an arm angle, [rad]."""
        return next((arc for arc in self.arcs if arc.contains(psi)), self.arcs[0])

    def __repr__(self) -> str:
        ranges = ", ".join(f"{degrees(start):.1f} to {degrees(end):.1f}" for start, end in self.feasible)
        where = f"at {ranges} deg" if ranges else "at no arm angle"
        why = sorted({reason for arc in self.arcs for reason in arc.reasons})
        return f"<FeasibleArcs {where}; forbidden by: {', '.join(why) or 'nothing'}>"


def _is_within(psi: float, start: float, end: float) -> bool:
    """Returns whether an arm angle is in a range, without its ends, at which a joint is at its limit."""
    return end - start > tau - _TOLERANCE or 0.0 < (psi - start) % tau < end - start


def _joined(ranges: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Returns ordered ranges of a circle, with adjacent ones merged."""
    joined: list[tuple[float, float]] = []
    for start, end in ranges:
        if joined and start - joined[-1][1] < _TOLERANCE:
            start = joined.pop()[0]
        joined.append((start, end))
    if len(joined) > 1 and abs(joined[0][0] + tau - joined[-1][1]) < _TOLERANCE:
        joined[-1] = joined[-1][0], joined[0][1] + tau
        del joined[0]
    return tuple(joined)
