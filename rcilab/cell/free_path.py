"""A path of joint angles between obstacles: OMPL's RRT-Connect, then shortcuts, both with continuous distances.

J. Kuffner, S. LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rcilab.cell.clearance_path import MAX_TRAVEL
from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.optional_deps import require_library

_SHORTCUTS = 150
"""Attempts to shorten the path; tuning value: more shorten it by less than a percent."""
_INSIDE = 1e-6  # [rad] Of the joint ranges, whose ends are not allowed.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FreeSpace:
    """The configurations that an arm may take."""

    lower: JointVector
    """Lower ends of the joints' ranges, shape (n,), [rad]."""
    upper: JointVector
    """Upper ends, shape (n,), [rad]."""
    clearance: Callable[[JointVector], float]
    """Returns the smallest distance in a configuration, less the required one, [m]; a free one is above 0."""
    levers: Array
    """Largest distance of the arm from each joint's axis, shape (n,), [m]."""

    def has_line(self, a: JointVector, b: JointVector) -> bool:
        """Returns whether the straight line between two configurations is free, by conservative advancement."""
        travel, at = float(np.abs(b - a) @ self.levers), 0.0
        while True:
            distance = self.clearance(a + at * (b - a))
            if distance <= 0.0:
                return False
            if at >= 1.0:
                return True
            at = min(1.0, at + max(distance, MAX_TRAVEL) / max(travel, MAX_TRAVEL))


def find_path(
    space: FreeSpace,
    start: JointVector,
    goal: JointVector,
    *,
    seed: int,
    budget: float,
    progress: Callable[[float], None],
) -> JointPath | None:
    """Returns the corners of a free path, shape (m, n), [rad]; None if none was found in time.

    Args:
        space: Where the arm may be.
        start: Joint angles at the start, shape (n,), [rad].
        goal: Joint angles at the end, shape (n,), [rad].
        seed: Of the random numbers; the same path for the same seed.
        budget: Time to search, [s].
        progress: Receives the share of the budget that is used; an exception that it raises ends the search.

    Raises:
        MissingExtraError: OMPL is not installed.
    """
    if space.has_line(start, goal):
        return np.stack((start, goal))
    base, geometric, util = (
        require_library(f"ompl.{part}", "planning around obstacles", "planning", "ompl")
        for part in ("base", "geometric", "util")
    )

    watch, level = _Watch(budget, progress), util.getLogLevel()
    util.setLogLevel(util.LogLevel.LOG_NONE)
    try:
        util.RNG.setSeed(seed + 1)  # Of all generators that are made from here on; 0 would be a random one.
        corners = _search(base, geometric, space, start, goal, watch)
    finally:
        util.setLogLevel(level)
    if watch.error is not None:
        raise watch.error
    return None if corners is None else _shortened(corners, space, np.random.default_rng(seed), progress)


def _search(
    base: Any, geometric: Any, space: FreeSpace, start: JointVector, goal: JointVector, watch: _Watch
) -> JointPath | None:
    """Returns the corners that RRT-Connect finds; None if the search is ended before.

    The first two arguments are the modules of OMPL with these names.
    """

    class Lines(base.MotionValidator):
        def checkMotion(self, first: Any, second: Any, *_: Any) -> bool:
            return space.has_line(_angles(first, n), _angles(second, n))

    n, states = len(start), base.RealVectorStateSpace(len(start))
    bounds = base.RealVectorBounds(n)
    for i in range(n):
        bounds.setLow(i, float(space.lower[i]) + _INSIDE)
        bounds.setHigh(i, float(space.upper[i]) - _INSIDE)
    states.setBounds(bounds)
    setup = geometric.SimpleSetup(states)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(lambda state: space.clearance(_angles(state, n)) > 0.0)
    lines = Lines(information)
    information.setMotionValidator(lines)
    ends = states.allocState(), states.allocState()
    for state, values in zip(ends, (start, goal), strict=True):
        for i, angle in enumerate(values.tolist()):
            state[i] = angle
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(information))
    setup.solve(base.PlannerTerminationCondition(watch.is_over))
    if not setup.haveExactSolutionPath():
        return None
    return np.array([_angles(state, n) for state in setup.getSolutionPath().getStates()])


class _Watch:
    """Ends a search when its time is over, or when the callback raises; owned by one search."""

    def __init__(self, budget: float, progress: Callable[[float], None]) -> None:
        self._begin, self._budget, self._progress = time.monotonic(), budget, progress
        self.error: BaseException | None = None

    def is_over(self) -> bool:
        used = (time.monotonic() - self._begin) / self._budget
        try:
            self._progress(min(used, 1.0))
        except BaseException as error:  # It must not cross OMPL; the caller raises it.
            self.error = error
        return used >= 1.0 or self.error is not None


def _angles(state: Any, n: int) -> JointVector:
    return np.array([state[i] for i in range(n)])


def _shortened(
    corners: JointPath, space: FreeSpace, rng: np.random.Generator, progress: Callable[[float], None]
) -> JointPath:
    """Returns the path with random pieces replaced by straight ones, as long as these are free."""
    for _ in range(_SHORTCUTS):
        if len(corners) == 2:
            break
        progress(1.0)
        lengths = np.abs(np.diff(corners, axis=0)) @ space.levers
        at = np.cumsum(np.concatenate(([0.0], lengths)))
        ends = np.sort(rng.uniform(0.0, at[-1], 2))
        i, j = np.clip(np.searchsorted(at, ends) - 1, 0, len(lengths) - 1).tolist()
        if i == j:
            continue
        a, b = (
            corners[k] + (end - at[k]) / lengths[k] * (corners[k + 1] - corners[k])
            for k, end in zip((i, j), ends, strict=True)
        )
        if space.has_line(a, b):
            corners = _without_idle(np.concatenate((corners[: i + 1], [a, b], corners[j + 1 :])), space)
    return corners


def _without_idle(corners: JointPath, space: FreeSpace) -> JointPath:
    """Returns the path without corners that a straight line can skip."""
    k = 1
    while k < len(corners) - 1:
        if space.has_line(corners[k - 1], corners[k + 1]):
            corners = np.delete(corners, k, axis=0)
        else:
            k += 1
    return corners
