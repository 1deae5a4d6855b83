"""Motions around obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell, required_distance
from rcilab.cell.clearance_path import clearance_path
from rcilab.cell.clearance_query import DistanceQuery, build_query
from rcilab.cell.free_path import FreeSpace, find_path
from rcilab.core.arrays import Array, JointPath, JointVector, as_number, as_vector, require_radians
from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit, LinkPair
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.joint import DEFAULT_JOINT_SPEED, JointLaw, plan_joint
from rcilab.motion.motion import Motion
from rcilab.motion.plan_program import plan_program
from rcilab.motion.program import Program
from rcilab.motion.waypoint import Waypoint

BUDGET = 5.0  # [s]
"""Default time to search: most paths in the example cells are found in less than a tenth of a second."""
_ROOM = 2e-3  # [m] More than required, for the roundings between path and motion.
_BLENDS = (0.2, 0.1, 0.05, 0.02, 0.0)  # [m] Radii that are tried at the corners; the last one is a stop.


def plan_free(
    model: RobotModel,
    start: ArrayLike,
    goal: ArrayLike,
    cell: Cell,
    *,
    speed: float = DEFAULT_JOINT_SPEED,
    law: JointLaw = "jerk_limited",
    distance: ClearanceLimit = STANDARD_DISTANCE,
    seed: int = 0,
    budget: float = BUDGET,
    progress: Callable[[float], None] | None = None,
) -> Motion:
    """Returns a motion in joint space around the obstacles of a cell, the arm itself and the floor.

    OMPL searches the path (extra `planning`), random shortcuts shorten it, and its corners are rounded as far as the
    distances allow; where they do not, the arm stops. Every distance stays above that of `distance`, as `check` finds
    it. If the straight line is free, it is the motion of `plan_joint`.

    Args:
        model: The arm; the cell's tool, load and part count.
        start: Joint angles at the start, shape (n,), [rad].
        goal: Joint angles at the end, shape (n,), [rad].
        cell: What the arm carries and what stands around it.
        speed: Part of the velocity and acceleration limits to use, see `plan_joint`.
        law: Time law, see `plan_joint`.
        distance: Required distances; the floor is that of the cell.
        seed: Of the random numbers, 0 to 4294967294; the same motion for the same seed.
        budget: Time to search, above 0, [s].
        progress: Receives the share of the budget that is used, 0 to 1; an exception that it raises cancels the search.

    Raises:
        PlanningError: Start or goal is not free, or no path was found in the time; the message says what is nearest.
        InvalidValueError: An argument is not valid.
        MissingExtraError: OMPL is not installed.
    """
    model = cell.applied_to(require_model(model))
    start = require_radians(as_vector(start, model.n, "start", "rad"), "start")
    goal = require_radians(as_vector(goal, model.n, "goal", "rad"), "goal")
    seconds = as_number(budget, "budget", "s")
    if not 0.0 < seconds < float("inf"):
        raise InvalidValueError("budget", seconds, "must be a time above 0 [s]")
    if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**32 - 1):
        raise InvalidValueError("seed", seed, "must be a whole number from 0 to 4294967294")
    straight = plan_joint(model, start, goal, speed=speed, law=law)  # Refuses what is outside the limits.
    required = required_distance(distance, cell)
    assert required is not None
    query, levers = build_query(model, required, cell)
    for name, q in (("start", start), ("goal", goal)):
        _require_free(query, required, q, name)
    joint, room = model.limits.joint, _room(query, required, start, goal)
    space = FreeSpace(
        lower=joint.lower,
        upper=joint.upper,
        clearance=lambda q: _excess(query, required, q)[0] - room,
        levers=levers,
    )
    report = progress or _ignore
    corners = find_path(space, start, goal, seed=int(seed), budget=seconds, progress=report)
    if corners is None:
        raise PlanningError(
            f"no path around the obstacles was found in {seconds:g} s: give the search more time (budget=...), another "
            "seed, or make room in the cell"
        ).coded("no_free_path", seconds=f"{seconds:g}")
    if len(corners) == 2:
        return straight
    waypoints = [Waypoint.joint(q, speed=speed) for q in corners[1:]]
    for blend in _BLENDS:
        rounded = tuple(replace(waypoint, blend=blend) for waypoint in waypoints)
        program = Program(model=model.name, start=tuple(corners[0].tolist()), waypoints=rounded)
        motion = plan_program(model, program, law=law, progress=lambda _: report(1.0))
        if _is_clear(motion.q, query, required, levers):
            return motion
    raise PlanningError("the motion along the path comes too near: use another seed, or require less distance").coded(
        "free_too_near"
    )


def _excess(query: DistanceQuery, required: ClearanceLimit, q: JointVector) -> tuple[float, LinkPair]:
    """Returns the smallest distance less the required one, [m], and its pair."""
    found = ((query.links(q), required.links), (query.floor(q), required.floor), (query.cell(q), required.cell))
    return min((distance - least, pair) for (distance, pair), least in found)


def _room(query: DistanceQuery, required: ClearanceLimit, start: JointVector, goal: JointVector) -> float:
    """Returns what the path keeps in addition, [m]: less if an end has less."""
    return min(_ROOM, *(_excess(query, required, q)[0] / 2.0 for q in (start, goal)))


def _require_free(query: DistanceQuery, required: ClearanceLimit, q: JointVector, name: str) -> None:
    excess, pair = _excess(query, required, q)
    if excess <= 0.0:
        remedy = f"choose another {name}, or move the obstacle"
        if not any((required.links, required.floor, required.cell)):
            raise PlanningError(f"the {name} is not free: {pair} overlap by {-1e3 * excess:.3g} mm; {remedy}").coded(
                "not_free_overlap", end=name, pair=pair, distance=-excess
            )
        raise PlanningError(
            f"the {name} is not free: {pair} are {-1e3 * excess:.3g} mm nearer than required; {remedy}"
        ).coded("not_free", end=name, pair=pair, distance=-excess)


def _is_clear(path: JointPath, query: DistanceQuery, required: ClearanceLimit, levers: Array) -> bool:
    """Returns whether a motion keeps the distances in every cycle, as `check` finds them."""
    pairs = ((query.links, required.links), (query.floor, required.floor), (query.cell, required.cell))
    found = ((clearance_path(compute, path, path[0], levers, (least,)), least) for compute, least in pairs)
    return all(float(distances.distance.min()) > least for distances, least in found)


def _ignore(share: float) -> None:
    del share
