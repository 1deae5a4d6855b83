"""Lines and arcs as joint motions: the tool is on the path, and what cannot be followed is told with its place."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rcilab
from rcilab.conformance.check import check
from rcilab.core.errors import InvalidValueError, PlanningError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_arc, plan_circle, plan_line, plan_nullspace
from tests.arms import ANY_POSE
from tests.model.kinematics.elbow import branch_ranges

SEVEN, SIX = load_model("xMatePro7"), load_model("xMate3")
ALL = pytest.mark.parametrize("name", ANY_POSE)


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
        match=r"the line cannot be followed at 0\.\d+ of 2\.000 m \(t = .* s, .* % of the path, tool .* out of reach",
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
        ({"speed": 0.0}, "speed must be from 0.001 to 1.*, got 0.0"),
        ({"speed": 1.5}, "speed must be from 0.001 to 1.*, got 1.5"),
        ({"law": "trapezoid"}, "is unknown for a path; known: jerk_limited, torque_rate_limited, s_profile"),
        ({"psi": 4.0}, "psi must be from -pi to pi.*, got 4.0"),
        ({"psi": math.nan}, "psi must be from -pi to pi.*, got nan"),
        ({"start": [0.0] * 6}, r"needs \(7,\)"),
        ({"goal": "x"}, "goal must be a Pose"),
        ({"goal": Pose.from_parts((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), (math.nan, 0, 0))}, "must be finite"),
    ],
)
def test_a_bad_argument_is_named(options, hint):
    arguments = {"start": SEVEN.home, "goal": moved(SEVEN, (0.1, 0.0, 0.0)), **options}
    with pytest.raises(InvalidValueError, match=hint):
        plan_line(SEVEN, arguments.pop("start"), arguments.pop("goal"), **arguments)


def test_the_angle_of_a_joint_as_arm_angle_is_inside_its_range():
    fr3 = load_model("FR3")
    with pytest.raises(
        InvalidValueError, match=r"psi: 2\.95 is the angle of joint 3 and must be from -2\.9065 to 2\.9065"
    ):
        plan_line(fr3, fr3.home, fr3.forward(fr3.home), psi=2.95)


def test_a_pose_that_is_hardly_out_of_reach_is_said_to_be():
    stretched = SEVEN.forward(np.zeros(7))
    away = Pose(stretched.position + [0.0, 0.0, 2e-5], stretched.wxyz)
    with pytest.raises(UnreachableError, match=r"out of reach by less than 0\.1 mm"):
        SEVEN.inverse(away, 0.0)


def test_an_arm_angle_is_refused_for_six_axes_and_a_start_outside_the_limits_for_all():
    with pytest.raises(InvalidValueError, match="a 6-axis arm has no arm angle"):
        plan_line(SIX, SIX.home, moved(SIX, (0.0, 0.1, 0.0)), psi=0.1)
    with pytest.raises(PlanningError, match=r"joint 2: start 130\.00° \(2\.2689 rad\) is not strictly between"):
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
        ({}, InvalidValueError, "and axis are both required, or two poses as through"),
        ({"center": (0.5, 0.0, 0.5)}, InvalidValueError, "and axis are both required"),
        ({"through": SEVEN.forward(SEVEN.home)}, InvalidValueError, "must be a tuple of two poses"),
        (
            {"through": (moved(SEVEN, (0.1, 0.0, 0.0)), moved(SEVEN, (0.2, 0.0, 0.0)))},
            PlanningError,
            "lie on a line",
        ),
        ({"center": (0.5, 0.0, 0.5), "axis": (0.0, 0.0, 0.0)}, InvalidValueError, "axis: .* has no direction"),
        ({"center": (0.5, 0.0, 0.4), "axis": (0.0, 0.0, 1.0)}, PlanningError, r"mm out of the plane .* choose the"),
        ({"center": moved(SEVEN, (0, 0, 0)).position, "axis": (0, 0, 1.0)}, PlanningError, "is the tool's position"),
        (
            {"center": moved(SEVEN, (-0.1, 0, 0)).position, "axis": (0, 0, 1.0), "angle": 7.0},
            InvalidValueError,
            "angle must be more than 0, up to 2 pi.*, got 7.0",
        ),
    ],
)
def test_what_makes_no_circle_is_named(options, error, hint):
    with pytest.raises(error, match=hint):
        plan_circle(SEVEN, SEVEN.home, **options)


def test_six_axes_have_no_null_space():
    with pytest.raises(InvalidValueError, match="a 6-axis arm has no arm angle"):
        plan_nullspace(SIX, SIX.home, 0.1)


@ALL
@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
def test_an_arc_turns_through_the_orientation_of_its_middle_pose(name, law):
    model = load_model(name)
    via = moved(model, (0.03, 0.03, 0.0), (0.3, 0.2, -0.1))
    goal = moved(model, (0.0, 0.1, 0.0), (-0.2, 0.1, 0.2))
    motion = plan_arc(model, model.home, via, goal, speed=0.1, law=law)
    assert check(motion, model).ok
    T = model.forward_path(motion.q)
    assert np.allclose(T[-1], goal.matrix, atol=1e-9)
    nearest = int(np.linalg.norm(T[:, :3, 3] - via.position, axis=1).argmin())
    off = np.linalg.norm(T[nearest, :3, 3] - via.position)
    # Between two rows, so off by as much in orientation as in place.
    assert np.abs(T[nearest, :3, :3] - via.rotation).max() < 10.0 * off + 1e-9
    times = np.linspace(0.0, motion.duration, 20 * len(motion))
    T = model.forward_path(motion.polynomial.sample(times))
    nearest = int(np.linalg.norm(T[:, :3, 3] - via.position, axis=1).argmin())
    assert np.abs(T[nearest, :3, :3] - via.rotation).max() < 1e-4


def test_the_vendors_arc_ignores_the_orientation_of_its_middle_pose():
    goal = moved(SEVEN, (0.0, 0.1, 0.0), (0.2, 0.0, 0.0))
    options = {"orientation": "start_to_goal", "law": "s_profile"}
    q = [
        plan_arc(SEVEN, SEVEN.home, moved(SEVEN, (0.05, 0.05, 0.0), rpy), goal, **options).q
        for rpy in ((0.0, 0.0, 0.0), (0.5, -0.4, 0.3))
    ]
    assert np.array_equal(*q)


@ALL
def test_a_circle_may_turn_the_tool_with_it(name):
    model = load_model(name)
    center = moved(model, (-0.05, 0.0, 0.0)).position
    around = {"center": center, "axis": (0.0, 0.0, 1.0), "angle": 2.0, "orientation": "turning"}
    motion = plan_circle(model, model.home, **around)
    assert check(motion, model).ok
    T = model.forward_path(motion.q)
    # Seen from the tool, the centre stays where it is.
    seen = np.einsum("nji,nj->ni", T[:, :3, :3], center - T[:, :3, 3])
    assert np.abs(seen - seen[0]).max() < 1e-9
    x, y = (T[-1, :3, :3] @ T[0, :3, :3].T)[:2, 0]
    assert math.atan2(y, x) == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize(
    ("plan", "options"),
    [
        (plan_arc, {"via": moved(SEVEN, (0.05, 0.05, 0)), "goal": moved(SEVEN, (0, 0.1, 0))}),
        (plan_circle, {"center": moved(SEVEN, (-0.05, 0, 0)).position, "axis": (0, 0, 1.0)}),
    ],
)
def test_an_unknown_orientation_is_named(plan, options):
    with pytest.raises(InvalidValueError, match=r"orientation: 'free' is unknown; known: \w+, \w+"):
        plan(SEVEN, SEVEN.home, **options, orientation="free")


def elbow_below(model, psi) -> np.ndarray:
    """Joint angles on a branch that leaves the elbow from about 0 over +-pi to about 0 again, but not across 0."""
    T = model.forward([-0.528, 0.204, -2.747, 1.041, 0.222, -0.699, 3.552])
    ((low, high),) = branch_ranges(model.feasible_arcs(T), 5)
    assert (low, high) == pytest.approx((0.1, math.tau - 0.1), abs=0.1)
    return np.array(model.inverse(T, psi=psi).all[5].q)


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7"])
@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
@pytest.mark.parametrize(("first", "last"), [(2.5, -2.5), (-2.0, 1.5)])
def test_the_elbow_takes_the_shorter_way_round_across_pi_without_a_jump(name, law, first, last):
    model = load_model(name)
    q = elbow_below(model, first)
    motion = plan_nullspace(model, q, last, law=law, speed=0.1)
    assert check(motion, model).ok
    psi = np.unwrap([model.arm_angle(row) for row in motion.q])
    assert psi[0] == pytest.approx(first, abs=1e-9)
    assert psi[-1] == pytest.approx(first + math.remainder(last - first, math.tau), abs=1e-9)
    assert (np.diff(psi) * math.copysign(1.0, first) > -1e-9).all()
    assert np.allclose(model.forward_path(motion.q), model.forward(q).matrix, atol=1e-9)
    assert np.abs(np.diff(motion.q, axis=0)).max() < 1e-2


@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
def test_where_the_shorter_way_round_is_blocked_the_longer_is_named_and_goes(law):
    q = elbow_below(SEVEN, 1.0)
    with pytest.raises(
        PlanningError, match=r'null-space motion .* the longer direction is free: way="longer"'
    ) as caught:
        plan_nullspace(SEVEN, q, -1.0, law=law)
    assert caught.value.share == pytest.approx(0.45, abs=0.1)
    motion = plan_nullspace(SEVEN, q, -1.0, law=law, way="longer", speed=0.1)
    assert SEVEN.arm_angle(motion.q[-1]) == pytest.approx(-1.0, abs=1e-9)
    assert check(motion, SEVEN).ok
    with pytest.raises(PlanningError, match='the shorter direction is free: way="shorter"'):
        plan_nullspace(SEVEN, q, 1.5, law=law, way="longer")
    with pytest.raises(PlanningError, match=r"the longer direction is not free either; model\.feasible_arcs returns"):
        plan_nullspace(SEVEN, q, 0.0, law=law)


def test_a_line_too_leads_the_elbow_the_shorter_way_round():
    q = elbow_below(SEVEN, 2.9)
    T = SEVEN.forward(q)
    motion = plan_line(SEVEN, q, Pose(T.position + (0.02, 0.0, 0.0), T.wxyz), psi=-2.9, speed=0.1)
    psi = np.unwrap([SEVEN.arm_angle(row) for row in motion.q])
    assert psi[-1] == pytest.approx(math.tau - 2.9, abs=1e-9)


def test_an_unknown_way_round_is_named():
    with pytest.raises(InvalidValueError, match="way: 'left' is unknown; known: shorter, longer"):
        plan_nullspace(SEVEN, SEVEN.home, 0.3, way="left")
