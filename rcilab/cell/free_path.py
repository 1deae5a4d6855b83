"""A path of joint angles between obstacles: OMPL's RRT-Connect, then shortcuts, both with continuous distances.

J. Kuffner, S. LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.optional_deps import require_library

STEP = 5e-3  # [m]
"""Travel of the arm between two distances, unless they allow more: that of the check."""
_SHORTCUTS = 150
"""Attempts to shorten the path; tuning value: more shorten it by less than a percent."""
_INSIDE = 1e-6  # [rad] Of the joint ranges, whose ends are not allowed.

Clearance = Callable[[JointVector], float]
"""The smallest distance in a configuration, less the required one, [m]; the path must stay above 0."""


def find_path(
    start: JointVector,
    goal: JointVector,
    ranges: tuple[JointVector, JointVector],
    clearance: Clearance,
    levers: Array,
    *,
    seed: int,
    budget: float,
    progress: Callable[[float], None],
) -> JointPath | None:
    """Returns the corners of a free path, shape (m, n), [rad]; None if none was found in time.

    Args:
        start: Joint angles at the start, shape (n,), [rad].
        goal: Joint angles at the end, shape (n,), [rad].
        ranges: Lower and upper ends of the joints' ranges, each of shape (n,), [rad].
        clearance: The distance to keep above 0.
        levers: Largest distance of the arm from each joint's axis, shape (n,), [m].
        seed: Of the random numbers; the same path for the same seed.
        budget: Time to search, [s].
        progress: Receives the share of the budget that is used; an exception that it raises ends the search.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    if is_free(start, goal, clearance, levers):
        return np.stack((start, goal))
    corners = _search(start, goal, ranges, clearance, levers, seed, budget, progress)
    return None if corners is None else _shortened(corners, clearance, levers, np.random.default_rng(seed))


def is_free(a: JointVector, b: JointVector, clearance: Clearance, levers: Array) -> bool:
    """Returns whether the straight line between two configurations is free, by conservative advancement."""
    travel, at = float(np.abs(b - a) @ levers), 0.0
    while True:
        distance = clearance(a + at * (b - a))
        if distance <= 0.0:
            return False
        if at >= 1.0:
            return True
        at = min(1.0, at + max(distance, STEP) / max(travel, STEP))


def _search(
    start: JointVector,
    goal: JointVector,
    ranges: tuple[JointVector, JointVector],
    clearance: Clearance,
    levers: Array,
    seed: int,
    budget: float,
    progress: Callable[[float], None],
) -> JointPath | None:
    base, geometric, util = (
        require_library(f"ompl.{part}", "planning around obstacles", "planning", "ompl")
        for part in ("base", "geometric", "util")
    )
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed + 1)  # 0 would be a random one.
    n = len(start)

    def angles(state: Any) -> JointVector:
        return np.array([state[i] for i in range(n)])

    class Lines(base.MotionValidator):
        def checkMotion(self, first: Any, second: Any, *_: Any) -> bool:
            return is_free(angles(first), angles(second), clearance, levers)

    space = base.RealVectorStateSpace(n)
    bounds = base.RealVectorBounds(n)
    for i, (low, high) in enumerate(zip(ranges[0] + _INSIDE, ranges[1] - _INSIDE, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(lambda state: clearance(angles(state)) > 0.0)
    validator = Lines(information)
    information.setMotionValidator(validator)
    ends = space.allocState(), space.allocState()
    for state, values in zip(ends, (start, goal), strict=True):
        for i, angle in enumerate(values.tolist()):
            state[i] = angle
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(information))
    begin, ended = time.monotonic(), list[BaseException]()

    def is_over() -> bool:
        used = (time.monotonic() - begin) / budget
        try:
            progress(min(used, 1.0))
        except BaseException as error:  # An exception must not cross OMPL; it is raised again below.
            ended.append(error)
        return used >= 1.0 or bool(ended)

    setup.solve(base.PlannerTerminationCondition(is_over))
    if ended:
        raise ended[0]
    if not setup.haveExactSolutionPath():
        return None
    return np.array([angles(state) for state in setup.getSolutionPath().getStates()])


def _shortened(corners: JointPath, clearance: Clearance, levers: Array, rng: np.random.Generator) -> JointPath:
    """Returns the path with random pieces replaced by straight ones, as long as these are free."""
    for _ in range(_SHORTCUTS):
        if len(corners) == 2:
            break
        lengths = np.abs(np.diff(corners, axis=0)) @ levers
        places = np.cumsum(np.concatenate(([0.0], lengths)))
        first, last = np.sort(rng.uniform(0.0, places[-1], 2))
        i, j = (int(np.clip(np.searchsorted(places, at) - 1, 0, len(lengths) - 1)) for at in (first, last))
        if i == j:
            continue
        a, b = (
            corners[k] + (at - places[k]) / lengths[k] * (corners[k + 1] - corners[k])
            for k, at in ((i, first), (j, last))
        )
        if is_free(a, b, clearance, levers):
            corners = np.concatenate((corners[: i + 1], [a, b], corners[j + 1 :]))
            corners = _without_idle(corners, clearance, levers)
    return corners


def _without_idle(corners: JointPath, clearance: Clearance, levers: Array) -> JointPath:
    """Returns the path without corners that a straight line can skip."""
    k = 1
    while k < len(corners) - 1:
        if is_free(corners[k - 1], corners[k + 1], clearance, levers):
            corners = np.delete(corners, k, axis=0)
        else:
            k += 1
    return corners
