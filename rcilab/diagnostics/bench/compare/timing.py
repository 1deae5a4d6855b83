"""Timing of straight lines by rcilab and by TOPP-RA, within the same limits on velocity and acceleration."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.compare.peer import absent
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.model.robot_model import RobotModel
from rcilab.motion.cartesian import arm_angles, plan_line
from rcilab.motion.path import Path, build_line
from rcilab.motion.path_timing import require_path

_SEED = 21
_SHORTEST, _LONGEST = 0.2, 0.8  # [m]
_TRIES = 50  # Per line; most random lines leave the workspace.


@dataclass(slots=True)
class _Timed:
    """Results for all lines."""

    ours: list[float] = field(default_factory=list)
    """Processor times, [s]."""
    theirs: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    """Duration of rcilab's motion relative to TOPP-RA's."""
    jerks: list[float] = field(default_factory=list)
    """Largest jerk of TOPP-RA's motion on the 1 ms grid, relative to the limit."""


def compare_timing(model: RobotModel, count: int = 20) -> Iterator[Measurement | Absent]:
    """Yields the planning times of random lines and the durations of the motions.

    Args:
        model: The arm.
        count: Number of lines.
    """
    try:
        theirs = _toppra()
    except ModuleNotFoundError as error:
        theirs = absent("line/toppra", error)
    found = _Timed()
    for q, path in _lines(model, count):
        begin = time.process_time()
        motion = plan_line(model, q, path.goal, speed=1.0)
        found.ours.append(time.process_time() - begin)
        if not isinstance(theirs, Absent):
            columns, limits = _columns(model, q, path)
            begin = time.process_time()
            trajectory = theirs(columns, limits)
            found.theirs.append(time.process_time() - begin)
            found.ratios.append(motion.duration / trajectory.duration)
            found.jerks.append(_largest_jerk(model, trajectory))
    longer = ""
    if found.ratios:
        longer = f"; lasts {np.median(found.ratios):.3f} times as long as TOPP-RA's, {max(found.ratios):.3f} at most"
    what = f"plan_line on {count} random lines of {_SHORTEST:g} to {_LONGEST:g} m, jerk limited, sampled every 1 ms"
    yield summarise("line/rcilab", found.ours, "ms", None, what + longer)
    if isinstance(theirs, Absent):
        yield theirs
        return
    note = (
        f"toppra {version('toppra')}, the same lines within the same velocities and accelerations of joints and tool, "
        "without inverse kinematics and sampling; "
        f"jerk on the 1 ms grid {np.median(found.jerks):.0f} times the limit, {max(found.jerks):.0f} at most: "
        "the controller refuses such a motion"
    )
    yield summarise("line/toppra", found.theirs, "ms", None, note)


def _lines(model: RobotModel, count: int) -> Iterator[tuple[JointVector, Path]]:
    """Yields random feasible lines, with the joint angles at their starts."""
    random, joint = np.random.default_rng(_SEED), model.limits.joint
    found = 0
    for _ in range(count * _TRIES):
        q = random.uniform(0.6 * joint.lower, 0.6 * joint.upper)
        displacement = random.normal(size=3)
        displacement *= random.uniform(_SHORTEST, _LONGEST) / np.linalg.norm(displacement)
        start = model.forward(q)
        try:
            path = build_line(start, Pose(start.position + displacement, start.wxyz), *arm_angles(model, q, None))
            plan_line(model, q, path.goal, speed=1.0)
        except PlanningError:
            continue
        yield q, path
        found += 1
        if found == count:
            return


def _columns(model: RobotModel, q: JointVector, path: Path) -> tuple[Array, Array]:
    """Returns the bounded quantities along a line, one per column (joints, [rad], distance, [m]), and their bounds.

    Returns:
        Shape (M, n + 1), and velocities and accelerations, shape (2, n + 1). The tool does not turn on these lines, and
        the arm angle is constant, so that no other bound is active.
    """
    rows = require_path(model, q, path)
    joint, tool = model.limits.joint, model.limits.cartesian
    distance = path.distance * np.linspace(0.0, 1.0, len(rows))
    velocity = np.append(joint.velocity, tool.translation_velocity)
    acceleration = np.append(joint.acceleration, tool.translation_acceleration)
    return np.column_stack((rows, distance)), np.stack((velocity, acceleration))


def _toppra() -> Callable[[Array, Array], Any]:
    """Returns TOPP-RA as in its first example, with the knots of rcilab as grid.

    Raises:
        ModuleNotFoundError: toppra is not installed.
    """
    from toppra import SplineInterpolator  # pyright: ignore[reportMissingImports]
    from toppra.algorithm import TOPPRA  # pyright: ignore[reportMissingImports]
    from toppra.constraint import (  # pyright: ignore[reportMissingImports]
        JointAccelerationConstraint,
        JointVelocityConstraint,
    )

    def plan(columns: Array, limits: Array) -> Any:
        grid = np.linspace(0.0, 1.0, len(columns))
        velocity, acceleration = (np.column_stack((-bound, bound)) for bound in limits)
        bounds = [JointVelocityConstraint(velocity), JointAccelerationConstraint(acceleration)]
        trajectory = TOPPRA(bounds, SplineInterpolator(grid, columns), gridpoints=grid).compute_trajectory()
        if trajectory is None:
            raise RuntimeError("TOPP-RA found no timing for a feasible line")
        return trajectory

    return plan


def _largest_jerk(model: RobotModel, trajectory: Any) -> float:
    """Returns the largest joint jerk relative to its limit, by backward differences at 1 ms, from rest to rest."""
    times = np.arange(0.0, trajectory.duration, CYCLE_TIME)
    q = np.asarray(trajectory(np.append(times, trajectory.duration)))[:, : model.n]
    q = np.concatenate((np.repeat(q[:1], 3, axis=0), q, np.repeat(q[-1:], 3, axis=0)))
    return float((np.abs(np.diff(q, 3, axis=0)) / CYCLE_TIME**3 / model.limits.joint.jerk).max())
