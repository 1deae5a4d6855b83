"""Drives a planner cycle by cycle, and measures what it did."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.limits import JointLimits
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.sim.planner import Planner, PlannerEvent, PlannerState

LONGEST = 60_000  # Cycles.

Actions = Mapping[int, Callable[[Planner], object]]


def drive(planner: Planner, actions: Actions | None = None) -> tuple[Array, list[tuple[int, PlannerEvent]]]:
    """Returns the joint angles of all cycles until the planner is idle, and the events with their cycles.

    Args:
        planner: The planner.
        actions: What is called before a cycle.
    """
    actions = actions or {}
    rows, events = [planner.q], list[tuple[int, PlannerEvent]]()
    for cycle in range(LONGEST):
        if cycle in actions:
            actions[cycle](planner)
        q, new = planner.step()
        rows.append(q)
        events += [(cycle, event) for event in new]
        if cycle > max(actions, default=0) and planner.state is PlannerState.IDLE:
            return np.array(rows), events
    raise AssertionError("the planner did not come to an end")


def largest_shares(rows: Array, limits: JointLimits) -> list[float]:
    """Returns the largest parts of the limits on velocity, acceleration and jerk that backward differences reach."""
    still = np.vstack((rows[:1], rows[:1], rows[:1], rows, rows[-1:], rows[-1:]))
    bounds = limits.velocity, limits.acceleration, limits.jerk
    return [
        float((np.abs(np.diff(still, order, axis=0)) / (1e-3**order * bound)).max())
        for order, bound in enumerate(bounds, start=1)
    ]


def speeds(model: RobotModel, rows: Array) -> Array:
    """Returns the speeds of the tool in all cycles, [m/s]."""
    return np.linalg.norm(np.diff(model.position_path(rows), axis=0), axis=1) / 1e-3


def shifted(pose: Pose, x: float, y: float, z: float) -> Pose:
    """Returns a pose moved in base, [m]."""
    return Pose.from_parts(pose.parts[0], (pose.parts[1][0] + x, pose.parts[1][1] + y, pose.parts[1][2] + z))


def distances_from_line(points: Array, start: Array, end: Array) -> Array:
    """Returns the distances of points, (N, 3), from the line through two others, [m]."""
    along = (end - start) / np.linalg.norm(end - start)
    offsets = points - start
    return np.linalg.norm(offsets - np.outer(offsets @ along, along), axis=1)
