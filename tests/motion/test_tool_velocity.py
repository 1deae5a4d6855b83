"""Motions in joint angles keep the bound on the tool's velocity that an arm has for them."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Jog, Motion, Program, Waypoint, plan_joint, plan_program
from rcilab.motion._ruckig import Stepper
from rcilab.motion.tool_velocity import TOOL_VELOCITY_PART
from tests.motion.test_online import command_anything, until_rest

MODELS = {name: load_model(name, tool=Pose((0.0, 0.02, 0.1))) for name in ("xArm6", "xArm7")}
FAR = {
    "xArm6": (0.0, 0.6, -1.8, 0.0, 1.2, 0.0),
    "xArm7": (0.0, 0.6, 0.0, 1.8, 0.0, 1.2, 0.0),
}  # From the axis of joint 1.
arms = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def fastest(model, rows):
    """The largest share of what plans use of the bound that the tool reaches."""
    steps = np.linalg.norm(np.diff(model.position_path(np.asarray(rows)), axis=0), axis=1)
    return steps.max() / CYCLE_TIME / (TOOL_VELOCITY_PART * model.limits.joint_tool_velocity)


@arms
def test_a_joint_motion_is_slowed_to_the_bound_and_not_below_it(model):
    start = np.array(FAR[model.name])
    goal = start.copy()
    goal[0] += 2.0
    motion = plan_joint(model, start, goal, speed=1.0)
    assert 0.99 < fastest(model, motion.q) <= 1.0
    assert check(motion, model, distance=None).ok
    slow = plan_joint(model, start, goal, speed=0.1)
    assert np.abs(np.diff(slow.q, axis=0)).max() / CYCLE_TIME > 0.099 * model.limits.joint.velocity[0]


def test_a_start_beyond_the_bound_is_refused():
    model = MODELS["xArm6"]
    dq = np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(PlanningError, match="the tool starts faster"):
        plan_joint(model, FAR["xArm6"], np.add(FAR["xArm6"], 1.0), start_velocity=dq, speed=1.0)


def test_a_program_with_blends_keeps_it():
    model = MODELS["xArm6"]
    start = np.array(FAR["xArm6"])
    corner, end = (start + np.array([angle, 0.2, 0.0, 0.0, 0.3, 0.0]) for angle in (1.5, 3.0))
    there = Waypoint.joint(corner, blend=0.05, speed=1.0), Waypoint.joint(end, speed=1.0)
    motion = plan_program(model, Program(model=model.name, start=start, waypoints=there))
    assert 0.9 < fastest(model, motion.q) <= 1.0


@arms
@pytest.mark.parametrize("seed", range(3))
def test_no_sequence_of_jogs_exceeds_it(model, seed):
    rng = np.random.default_rng(seed)
    jog = Jog(model, model.home)
    rows = [model.home]
    for _ in range(8):
        command_anything(jog, model, rng)
        rows += [jog.step() for _ in range(150)]
    jog.stop()
    rows += until_rest(jog)
    assert check(Motion.from_cycles(rows), model, distance=None).ok


def test_one_joint_is_jogged_up_to_the_bound():
    model = MODELS["xArm6"]
    jog = Jog(model, FAR["xArm6"])
    jog.set_joint_velocity([np.pi, 0.0, 0.0, 0.0, 0.0, 0.0])
    rows = [jog.step() for _ in range(400)]
    assert 0.3 < fastest(model, rows) < 1.0
    assert jog.part == pytest.approx(jog.dq[0] / np.pi)


def test_an_axis_without_a_curve_brakes_from_where_it_is_in_every_cycle():
    axis = Stepper([0.0], [1.0], [0.0], [10.0], [500.0])
    q = []
    for _ in range(5):
        axis.step_to_positions([3.0], [1e-6])  # Ruckig represents no curve of so many seconds.
        q.append(axis.q[0])
    assert np.abs(np.diff(q, 2)).max() < 10.0 * CYCLE_TIME**2
