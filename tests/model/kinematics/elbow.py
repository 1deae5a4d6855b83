"""Ranges of arm angles of one branch."""

from __future__ import annotations

from dataclasses import replace

from rcilab.model.kinematics.elbow_ranges import FeasibleArcs


def branch_ranges(found: FeasibleArcs, branch: int) -> tuple[tuple[float, float], ...]:
    """Returns the ranges (start, end), [rad], in which one branch, 0 to 7, stays possible all along."""
    return replace(found, arcs=tuple(arc for arc in found.arcs if branch in arc.branches)).feasible
