"""Where a plan comes nearest to an obstacle, if that is too near."""

from __future__ import annotations

from rcilab.app.planning import Plan
from rcilab.cell.cell import has_obstacles, required_distance
from rcilab.cell.cell_geometry import ClosestPoints, closest_points
from rcilab.core.clearance import STANDARD_DISTANCE


def compute_closest(plan: Plan) -> ClosestPoints | None:
    """Returns where arm and obstacle are nearest to each other; None if every distance is as recommended."""
    cell = plan.cell
    rows = {row.id: row for row in plan.report.rows}
    near = next((rows[name] for name in _ROWS if name in rows and not rows[name].ok), None)
    distance = required_distance(STANDARD_DISTANCE, cell)
    if near is None or cell is None or distance is None or not has_obstacles(cell):
        return None
    time = min(max(near.time, 0.0), plan.motion.duration)
    return closest_points(plan.model, cell, distance, plan.motion.at(time).q)


_ROWS = ("clearance.cell", "clearance.cell.advised")
