"""Solutions of the inverse: every analytic branch, and those inside the joint limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import degrees, tau

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_vector, readonly_copy
from rcilab.core.errors import UnreachableError
from rcilab.core.limits import JointLimits

_AT_LIMIT = 1e-3  # [rad] A smaller excess, below 0.1 deg, is not given as a number.


@dataclass(frozen=True, slots=True)
class Branch:
    """One analytic solution, inside the joint limits or not."""

    q: tuple[float, ...]
    """Joint angles, [rad]."""
    joint: int | None
    """Number (from 1) of the joint farthest beyond its limit; None inside all limits."""
    excess: float
    """Excess of that joint over its limit, [rad]; 0 inside all limits."""

    @property
    def ok(self) -> bool:
        """Whether every joint is inside its limits."""
        return self.joint is None


class Solutions(Sequence[JointVector]):
    """The joint configurations for a pose of the tool that are inside the joint limits.

    Iteration gives arrays of shape (n,), [rad]. `all` also has the branches outside the limits.
    """

    __slots__ = ("_all", "_branches", "_feasible", "_limits", "_lower", "_upper", "psi")

    def __init__(
        self,
        branches: Sequence[tuple[float, ...]],
        lower: list[float],
        upper: list[float],
        psi: float | None,
        limits: JointLimits,
    ) -> None:
        self.psi, self._limits = psi, limits
        self._branches, self._lower, self._upper = branches, lower, upper
        self._all: tuple[Branch, ...] | None = None
        inside = [q for q in branches if _is_inside(q, lower, upper)]
        self._feasible = readonly_copy(inside) if inside else readonly_copy(np.empty((0, len(lower))))

    @property
    def all(self) -> tuple[Branch, ...]:
        """Every analytic branch with the joint that exceeds its limit; computed on first access."""
        if self._all is None:
            self._all = tuple(_branch(q, self._lower, self._upper) for q in self._branches)
        return self._all

    def __len__(self) -> int:
        return len(self._feasible)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]  # Sequence's overloads add nothing here.
        return self._feasible[index]

    def __iter__(self) -> Iterator[JointVector]:
        return iter(self._feasible)

    def nearest(self, q: ArrayLike) -> JointVector:
        """Returns the solution closest to q, [rad], shape (n,).

        A joint whose range is longer than a full turn may be moved by full turns to come closer.

        Raises:
            UnreachableError: No branch is inside the joint limits.
        """
        if not len(self._feasible):
            raise self.refusal()
        reference = as_vector(q, len(self._lower), "q", "rad")
        turns = np.round((reference - self._feasible) / tau) * tau
        shifted = self._feasible + turns
        inside = (shifted > self._lower) & (shifted < self._upper)
        candidates = np.where(inside, shifted, self._feasible)
        return readonly_copy(candidates[np.argmin(((candidates - reference) ** 2).sum(axis=1))])

    def refusal(self, *, everywhere: bool = False) -> UnreachableError:
        """Returns the error with the exceeded joint limit, for the branch with the smallest excess.

        Args:
            everywhere: Whether every arm angle was tried.
        """
        if not self.all:
            where = "" if self.psi is None else f" at arm angle {degrees(self.psi):.1f} deg"
            error = UnreachableError(f"no joint angles put the tool there{where}; use another arm angle")
            return error.coded("no_angles")
        best = min(self.all, key=lambda branch: branch.excess)
        joint = best.joint or 1
        angle, lower, upper = best.q[joint - 1], self._lower[joint - 1], self._upper[joint - 1]
        place, advice = f"in the best of {len(self.all)} branches", "move the target"
        if everywhere:
            place += " at the best arm angle"
        elif self.psi is not None:
            place += f" at arm angle {degrees(self.psi):.1f} deg"
            advice += " or change the arm angle"
        soft = None if best.joint is None else self._limits.exceeded_soft_limit(joint, angle)
        limit = "its limit" if soft is None else f"the soft limit of {degrees(soft):.2f} deg that was set"
        beyond = f"{degrees(best.excess):.1f} deg beyond {limit}"
        if best.excess < _AT_LIMIT:
            beyond = f"right at {limit}, and has to stay inside"
        error = UnreachableError(
            f"joint {joint} would have to be at {degrees(angle):.1f} deg, {beyond} "
            f"({degrees(lower):.0f} to {degrees(upper):.0f} deg), {place}; {advice}"
            f"{'' if soft is None else ', or widen the soft limit'}",
            joint=joint,
            excess=best.excess,
        )
        facts = {"joint": joint, "angle": float(angle), "low": float(lower), "high": float(upper)}
        if soft is None:
            return error.coded("joint_beyond", **facts)
        return error.coded("joint_beyond_soft", **facts, limit=soft)

    def __repr__(self) -> str:
        rows = "\n".join("  " + " ".join(f"{degrees(angle):8.2f}" for angle in q) for q in self._feasible)
        psi = "" if self.psi is None else f" at arm angle {degrees(self.psi):.2f} deg"
        return f"{len(self)} of {len(self._branches)} branches inside the limits{psi}, [deg]:\n{rows}"


def _is_inside(q: tuple[float, ...], lower: list[float], upper: list[float]) -> bool:
    for low, angle, high in zip(lower, q, upper, strict=True):
        if not low < angle < high:
            return False
    return True


def _branch(q: tuple[float, ...], lower: list[float], upper: list[float]) -> Branch:
    joint, worst = None, 0.0
    for number, (angle, low, high) in enumerate(zip(q, lower, upper, strict=True), start=1):
        if not low < angle < high:
            excess = max(low - angle, angle - high)
            if joint is None or excess > worst:
                joint, worst = number, excess
    return Branch(q, joint, worst)
