"""Lines and arcs as joint motions: the tool is on the path, and what cannot be followed is told with its place."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rcilab
from rcilab.conformance import check
from rcilab.errors import InvalidValueError, PlanningError
from rcilab.model import load_model
from rcilab.motion import plan_arc, plan_circle, plan_line, plan_nullspace
from rcilab.robots import ROBOT_NAMES
from rcilab.spatial import Pose

SEVEN, SIX = load_model("xMatePro7"), load_model("xMate3")
ALL = pytest.mark.parametrize("name", ROBOT_NAMES)


def moved(model, step, rpy=(0.0, 0.0, 0.0)) -> Pose:
    """The pose of the tool at home, moved in base and turned in its own axes."""
    T = model.forward(model.home)
    return Pose(T.position + step, (T @ Pose.from_rpy((0, 0, 0), rpy)).wxyz)


@ALL
def test_the_tool_runs_straight_at_the_s_profiles_time_and_the_motion_is_allowed(name):
    model = load_model(name)
    goal = moved(model, (0.05, 0.1, -0.05), (0.2, -0.1, 0.1))
    motion = plan_line(model, model.home, goal, speed=0.2, law="s_profile")
    assert check(motion, model).ok
    T = model.forward_path(motion.q)
    assert np.allclose(T[-1], goal.matrix, atol=1e-9)
    start, end = T[0, :3, 3], T[-1, :3, 3]
    length = np.linalg.norm(end - start)
    off = np.cross(T[:, :3, 3] - start, (end - start) / length)
    assert np.abs(off).max() < 1e-9
    # T = 1.5 V / a + D / V, or the shorter way's time (manual 3.5), in whole cycles.
    exact = 1.5 * 0.2 / 0.5 + length / 0.2 if length >= 1.5 * 0.2**2 / 0.5 else math.sqrt(6.0 * length / 0.5)
    assert len(motion) == math.ceil(exact * 1000.0 - 1e-9) + 1
    assert motion.law == "s_profile"
    assert motion.speed == 0.2


@ALL
def test_the_tool_runs_on_the_arc(name):
    model = load_model(name)
    via, goal = moved(model, (0.05, 0.05, 0.0)), moved(model, (0.0, 0.1, 0.0))
    motion = plan_arc(model, model.home, via, goal, speed=0.2, law="s_profile")
    assert check(motion, model).ok
    position = model.forward_path(motion.q)[:, :3, 3]
    center = moved(model, (0.0, 0.05, 0.0)).position
    assert np.allclose(np.linalg.norm(position - center, axis=1), 0.05, atol=1e-9)
    assert np.allclose(position[-1], goal.position, atol=1e-9)
    assert np.linalg.norm(position - via.position, axis=1).min() < 1e-4


def test_the_arm_angle_is_held_or_led():
    goal = moved(SEVEN, (0.0, 0.1, 0.0))
    held = [SEVEN.arm_angle(q) for q in plan_line(SEVEN, SEVEN.home, goal).q[::50]]
    assert np.allclose(held, SEVEN.arm_angle(SEVEN.home), atol=1e-9)
    led = plan_line(SEVEN, SEVEN.home, goal, psi=0.4)
    assert SEVEN.arm_angle(led.q[-1]) == pytest.approx(0.4, abs=1e-9)
    alone = plan_line(SEVEN, SEVEN.home, SEVEN.forward(SEVEN.home), psi=0.4)
    assert SEVEN.arm_angle(alone.q[-1]) == pytest.approx(0.4, abs=1e-9)
    assert np.allclose(SEVEN.forward_path(alone.q), SEVEN.forward(SEVEN.home).matrix, atol=1e-9)


def test_a_line_to_where_the_tool_is_has_no_length():
    motion = rcilab.plan_line(SEVEN, SEVEN.home, SEVEN.forward(SEVEN.home))
    assert motion.duration == 0.0
    assert np.array_equal(motion.q, [SEVEN.home])


def test_a_tool_is_what_moves():
    model = SEVEN.with_tool(Pose((0.0, 0.0, 0.15)))
    goal = moved(model, (0.0, 0.1, 0.05))
    assert model.forward(plan_line(model, model.home, goal).q[-1]).is_close(goal, 1e-9)


@pytest.mark.parametrize("model", [SEVEN, SIX], ids=["7", "6"])
def test_a_pose_out_of_reach_is_told_with_its_place_and_reason(model):
    goal = moved(model, (2.0, 0.0, 0.0))
    with pytest.raises(
        PlanningError,
        match=r"the line cannot be followed at 0\.\d+ of 2\.000 m \(t = .* s, .* % of the way, tool .* out of reach by",
    ):
        plan_line(model, model.home, goal, law="s_profile")


def test_a_wrist_flip_is_a_singularity_and_no_motion():
    q = np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0])
    T = SEVEN.forward(q)
    # The wrist passes q6 = 0 beside, so that joints 5 and 7 would have to turn half round at once.
    goal = T @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) @ Pose.from_rpy((0, 0, 0), (1e-4, -0.8, 0.0))
    with pytest.raises(
        PlanningError, match=r"joints? \d.* would have to jump by .* because a singularity is in the way"
    ):
        plan_line(SEVEN, q, Pose(T.position, goal.wxyz), speed=0.3, law="s_profile")


def test_a_stretched_arm_has_no_arm_angle_to_hold():
    with pytest.raises(PlanningError, match=r"at the start .*bent pose in joint space first"):
        plan_line(SEVEN, np.zeros(7), Pose((0.3, 0.0, 0.8)))


@pytest.mark.parametrize(
    ("options", "hint"),
    [
        ({"speed": 0.0}, "speed: 0.0 must be from 0.001 to 1"),
        ({"speed": 1.5}, "speed: 1.5 must be from 0.001 to 1"),
        ({"law": "trapezoid"}, "is unknown for a path; known: jerk_limited, s_profile"),
        ({"psi": 4.0}, "psi: 4.0 must be from -pi to pi"),
        ({"psi": math.nan}, "psi: nan must be from -pi to pi"),
        ({"start": [0.0] * 6}, r"needs \(7,\)"),
        ({"goal": "x"}, "goal: 'x' is no Pose"),
        ({"goal": Pose.from_parts((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), (math.nan, 0, 0))}, "must be finite"),
    ],
)
def test_a_bad_argument_is_named(options, hint):
    arguments = {"start": SEVEN.home, "goal": moved(SEVEN, (0.1, 0.0, 0.0)), **options}
    with pytest.raises(InvalidValueError, match=hint):
        plan_line(SEVEN, arguments.pop("start"), arguments.pop("goal"), **arguments)


def test_an_arm_angle_is_refused_for_six_axes_and_a_start_outside_the_limits_for_all():
    with pytest.raises(InvalidValueError, match="a 6-axis arm has no arm angle"):
        plan_line(SIX, SIX.home, moved(SIX, (0.0, 0.1, 0.0)), psi=0.1)
    with pytest.raises(PlanningError, match=r"joint 2: start 130\.00 deg is not strictly between"):
        plan_line(SIX, [0.0, math.radians(130.0), 0.0, 0.0, 0.0, 0.0], SIX.forward(SIX.home))


@ALL
def test_a_full_circle_by_the_s_profile_comes_back(name):
    model = load_model(name)
    others = moved(model, (-0.05, 0.05, 0.0)), moved(model, (-0.1, 0.0, 0.0), (0.3, 0.0, 0.0))
    motion = plan_circle(model, model.home, through=others, speed=0.1, law="s_profile")
    assert motion.law == "s_profile"
    T = model.forward_path(motion.q)
    center = moved(model, (-0.05, 0.0, 0.0)).position
    assert np.allclose(np.linalg.norm(T[:, :3, 3] - center, axis=1), 0.05, atol=1e-9)
    assert np.allclose(T[:, :3, :3], T[0, :3, :3], atol=1e-9)
    assert np.allclose(motion.q[-1], model.home, atol=1e-9)
    for other in others:
        assert np.linalg.norm(T[:, :3, 3] - other.position, axis=1).min() < 2e-4
    # T = 1.5 V / a + D / V (manual 3.5).
    assert motion.duration == pytest.approx(1.5 * 0.1 / 0.25 + math.tau * 0.05 / 0.1, abs=2e-3)


def test_a_circle_through_poses_and_one_around_an_axis_are_the_same():
    others = moved(SEVEN, (-0.05, 0.05, 0.0)), moved(SEVEN, (-0.1, 0.0, 0.0))
    through = plan_circle(SEVEN, SEVEN.home, through=others, angle=2.0)
    center = moved(SEVEN, (-0.05, 0.0, 0.0)).position
    around = plan_circle(SEVEN, SEVEN.home, center=center, axis=(0.0, 0.0, 1.0), angle=2.0)
    assert len(through) == len(around)
    assert np.allclose(through.q, around.q, atol=1e-9)


def test_the_elbow_alone_by_the_s_profile():
    motion = rcilab.plan_nullspace(SEVEN, SEVEN.home, 0.4, law="s_profile")
    assert motion.duration == pytest.approx(1.5 * 0.2 / 0.5 + 0.4 / 0.2, abs=2e-3)
    assert np.allclose(SEVEN.forward_path(motion.q), SEVEN.forward(SEVEN.home).matrix, atol=1e-9)
    assert SEVEN.arm_angle(motion.q[-1]) == pytest.approx(0.4, abs=1e-9)
    assert plan_nullspace(SEVEN, SEVEN.home, SEVEN.arm_angle(SEVEN.home)).duration == 0.0


@pytest.mark.parametrize(
    ("options", "error", "hint"),
    [
        ({}, InvalidValueError, "and axis are both needed, or two poses as through"),
        ({"center": (0.5, 0.0, 0.5)}, InvalidValueError, "and axis are both needed"),
        ({"through": SEVEN.forward(SEVEN.home)}, InvalidValueError, "must be a tuple of two poses"),
        (
            {"through": (moved(SEVEN, (0.1, 0.0, 0.0)), moved(SEVEN, (0.2, 0.0, 0.0)))},
            PlanningError,
            "lie on a line",
        ),
        ({"center": (0.5, 0.0, 0.5), "axis": (0.0, 0.0, 0.0)}, InvalidValueError, "axis: .* has no direction"),
        ({"center": (0.5, 0.0, 0.4), "axis": (0.0, 0.0, 1.0)}, PlanningError, r"mm out of the plane .* choose the"),
        ({"center": moved(SEVEN, (0, 0, 0)).position, "axis": (0, 0, 1.0)}, PlanningError, "where the tool is"),
        (
            {"center": moved(SEVEN, (-0.1, 0, 0)).position, "axis": (0, 0, 1.0), "angle": 7.0},
            InvalidValueError,
            "angle: 7.0 must be more than 0, up to 2 pi",
        ),
    ],
)
def test_what_makes_no_circle_is_named(options, error, hint):
    with pytest.raises(error, match=hint):
        plan_circle(SEVEN, SEVEN.home, **options)


def test_six_axes_have_no_null_space():
    with pytest.raises(InvalidValueError, match="a 6-axis arm has no arm angle"):
        plan_nullspace(SIX, SIX.home, 0.1)
