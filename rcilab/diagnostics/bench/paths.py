"""Cost of planning tool paths: lines, arcs, and replanning while a target is dragged."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from rcilab.conformance.check import check
from rcilab.core.arrays import JointVector
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.measure import Measurement, cost_by_length, summarise, time_calls
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion.cartesian import plan_arc, plan_line
from rcilab.motion.joint import plan_joint
from rcilab.motion.motion import Motion

_ROBOT = "xMatePro7"
_ROUNDS = 20
_FRAME = 1.0 / 30.0  # [s] A drag is smooth from 30 updates per second on.
_SLOWEST = 0.01  # Speed at which one metre takes about 100 s.


def bench_plan_line() -> Measurement:
    """A line of one metre within the limits of joints, tool and arm angle; other durations in the note."""
    return _bench_path("plan_line", _line)


def bench_plan_arc() -> Measurement:
    """An arc between the same ends, through the orientation of its middle pose."""
    return _bench_path("plan_arc", _arc)


def bench_replan() -> Measurement:
    """One update while a target is dragged: inverse kinematics, a motion and its check, without collisions."""
    model = load_model(_ROBOT)
    start = model.home
    T = model.forward(start)
    phases = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    center = T.position - (0.15, 0.0, 0.1)
    poses = [Pose(center + 0.1 * np.array((np.sin(2.0 * a), np.cos(a), np.sin(a))), T.wxyz) for a in phases]

    def joint(goal: Pose) -> bool:
        return check(plan_joint(model, start, model.inverse(goal, near=start).nearest(start)), model).ok

    def line(goal: Pose) -> bool:
        return check(plan_line(model, start, goal), model).ok

    lines = time_calls(line, poses)
    note = (
        f"{_ROBOT}, {len(poses)} targets, in joint space; straight at speed 0.2: {1e3 * float(np.median(lines)):.1f} ms"
    )
    return summarise("replan", time_calls(joint, poses), "ms", 1e3 * _FRAME, note)


def _bench_path(name: str, plan: Callable[[RobotModel, float], Motion]) -> Measurement:
    model = load_model(_ROBOT)
    times = time_calls(partial(plan, model), [0.2] * _ROUNDS)
    speeds = (1.0, 0.1, _SLOWEST)
    growth = cost_by_length(partial(plan, model), [(plan(model, speed).duration, [speed] * 3) for speed in speeds])
    note = f"{_ROBOT}, a metre from end to end at speed 0.2; {growth}"
    return summarise(name, times, "ms", 50.0, note)


def _line(model: RobotModel, speed: float) -> Motion:
    start, _, goal = _ends(model)
    return plan_line(model, start, goal, speed=speed)


def _arc(model: RobotModel, speed: float) -> Motion:
    start, via, goal = _ends(model)
    return plan_arc(model, start, via, goal, speed=speed)


def _ends(model: RobotModel) -> tuple[JointVector, Pose, Pose]:
    """Returns the start of a path of one metre in front of the arm, a via pose near its middle, and its end."""
    T = model.forward(model.home)
    first, via, goal = (
        Pose(T.position + step, T.wxyz) for step in ((-0.1, -0.5, -0.1), (0.1, 0, -0.1), (-0.1, 0.5, -0.1))
    )
    tilted = via @ Pose.from_rpy((0.0, 0.0, 0.0), (0.1, 0.2, 0.0))
    return model.inverse(first, psi=0.0).nearest(model.home), tilted, goal
