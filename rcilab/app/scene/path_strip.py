"""The planned path as the scene shows it: how much of its limits it uses where, and a bead at each violation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rcilab.app.planning import Plan, sampled_rows
from rcilab.core.arrays import Array

if TYPE_CHECKING:
    from rcilab.conformance.report import Report, Violation

MAX_MARKERS = 24
"""More hide the path; the worst are kept."""
_TOGETHER = 0.02  # [s] Violations closer in time than this share a bead.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ViolationMarker:
    """One or more violations at a place of the path."""

    playhead: float
    """Where in the motion, 0 to 1."""
    position: Array
    """Where the tool is then, shape (3,), [m]."""
    violations: tuple[Violation, ...]
    """Worst first."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PathStrip:
    """One path."""

    report: Report
    """Whose path it is."""
    path: Array
    """Positions of the tool, shape (N, 3), [m]."""
    usage: Array
    """The most that is used of a limit between each of these and the next, shape (N,); 1 or more is a violation."""
    markers: tuple[ViolationMarker, ...]


def compute_path_strip(plan: Plan) -> PathStrip:
    """Returns what is to be drawn of a plan's path."""
    rows = sampled_rows(plan.motion)
    usage = plan.report.usage().at_most(rows)
    return PathStrip(report=plan.report, path=plan.path, usage=usage, markers=_beads(plan))


def _beads(plan: Plan) -> tuple[ViolationMarker, ...]:
    groups: list[list[Violation]] = []
    for violation in plan.report.violations:  # Worst first.
        near = next((g for g in groups if abs(g[0].worst_time - violation.worst_time) < _TOGETHER), None)
        if near is not None:
            near.append(violation)
        elif len(groups) < MAX_MARKERS:
            groups.append([violation])
    if not groups:
        return ()
    duration = max(plan.motion.duration, 1e-3)
    times = [min(max(group[0].worst_time, 0.0), plan.motion.duration) for group in groups]
    positions = plan.model.position_path(np.stack([plan.motion.at(t).q for t in times]))
    return tuple(
        ViolationMarker(playhead=t / duration, position=position, violations=tuple(group))
        for t, position, group in zip(times, positions, groups, strict=True)
    )
