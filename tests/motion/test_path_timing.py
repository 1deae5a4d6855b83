"""Jerk-limited motions along paths: on the path, inside every limit, smooth, and hardly slower than without jerk."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.check import check
from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import path_timing as along
from rcilab.motion import plan_arc, plan_circle, plan_line, plan_nullspace
from rcilab.motion.path import build_arc, build_line
from rcilab.motion.time_parametrization import FastestLaw
from tests.arms import REPRESENTATIVE

MODELS = {name: load_model(name, tool=Pose((0.0, 0.02, 0.1))) for name in REPRESENTATIVE}
SEVEN = MODELS["xMatePro7"]
names, seeds, speeds = st.sampled_from(sorted(MODELS)), st.integers(0, 2**32), st.sampled_from([1.0, 0.5, 0.2])
SOME = settings(max_examples=20)


def ends(model, seed, size=0.5):
    rng = np.random.default_rng(seed)
    q = model.home + rng.uniform(-size, size, model.n)
    goal = q + rng.uniform(-size, size, model.n)
    via = (q + goal) / 2.0 + rng.uniform(-0.2, 0.2, model.n)
    psi = model.arm_angle(goal) if model.n == 7 else None
    return q, model.forward(via), model.forward(goal), psi


def planned(plan, model, *arguments, **options):
    """The motion, or no example where the path cannot be followed or comes too close to the floor."""
    try:
        motion = plan(model, *arguments, **options)
    except PlanningError:
        assume(False)
    assume(not any(found.condition.id.startswith("clearance.") for found in check(motion, model).violations))
    return motion


def angles(model, q):
    return model.arm_angle(q) if model.n == 7 else None


def require_allowed(model, motion, speed):
    """Joints by `check`, tool and arm angle by the monitor, joints between the cycles by the curve."""
    assert check(motion, model).ok
    monitor = CartesianMonitor(model.limits)
    monitor.reset(model.forward(motion.q[0]), angles(model, motion.q[0]))
    for q in [*motion.q, *[motion.q[-1]] * 3]:
        assert monitor.step(model.forward(q), angles(model, q)) == [], monitor.violations()
    times = np.linspace(0.0, motion.duration, 7 * len(motion))
    joint = model.limits.joint
    for order, bound in ((1, speed * joint.velocity), (2, speed * joint.acceleration), (3, 1.0001 * joint.jerk)):
        assert (np.abs(motion.polynomial.sample(times, order)) < bound).all()
    assert ((joint.lower < motion.q) & (motion.q < joint.upper)).all()


def require_smooth(motion):
    """Position, velocity and acceleration continuous, rest at both ends."""
    coefficients = motion.polynomial.coefficients
    powers = 1e-3 ** np.arange(6)
    for order, tolerance in ((0, 1e-12), (1, 1e-9), (2, 1e-6)):
        last = (coefficients * powers[: coefficients.shape[2]]).sum(axis=2)
        assert np.abs(last[:-1] - coefficients[1:, :, 0]).max() < tolerance, order
        coefficients = coefficients[:, :, 1:] * np.arange(1.0, coefficients.shape[2])
    for sample in (motion.at(0.0), motion.end()):
        assert np.abs(sample.dq).max() < 1e-9
        assert np.abs(sample.ddq).max() < 1e-6


@SOME
@given(names, seeds, speeds)
def test_a_line_is_straight_allowed_smooth_and_exact_at_its_ends(name, seed, speed):
    model = MODELS[name]
    q, _, goal, psi = ends(model, seed)
    motion = planned(plan_line, model, q, goal, psi=psi, speed=speed)
    require_allowed(model, motion, speed)
    require_smooth(motion)
    T = model.forward_path(motion.q)
    assert np.array_equal(motion.q[0], q)
    assert np.allclose(T[-1], goal.matrix, atol=1e-9)
    way = goal.position - T[0, :3, 3]
    length = float(np.linalg.norm(way))
    shares = (T[:, :3, 3] - T[0, :3, 3]) @ way / length**2
    expected, psis = build_line(model.forward(q), goal, angles(model, q), psi).sample(shares)
    assert np.abs(T - expected).max() < 1e-9 / length
    if psis is not None:
        assert np.abs(np.array([model.arm_angle(row) for row in motion.q]) - psis).max() < 1e-8 / length


@SOME
@given(names, seeds, speeds)
@example("xMatePro3", 9108064, 1.0)  # It ends below the floor.
@example("xArm6", 80, 1.0)  # The jerk jumps where the tool passes via.
@example("xArm6", 84848801, 1.0)  # It is largest between the instants at which the other derivatives are checked.
def test_an_arc_is_round_allowed_and_smooth(name, seed, speed):
    model = MODELS[name]
    q, via, goal, psi = ends(model, seed, 0.4)
    try:
        circle = build_arc(model.forward(q), via, goal).circle
    except PlanningError:
        assume(False)
    motion = planned(plan_arc, model, q, via, goal, psi=psi, speed=speed)
    require_allowed(model, motion, speed)
    require_smooth(motion)
    T = model.forward_path(motion.q)
    offset = T[:, :3, 3] - circle.center
    assert np.abs(np.linalg.norm(offset, axis=1) - math.hypot(*circle.first)).max() < 1e-9
    assert np.abs(offset @ np.cross(circle.first, circle.second)).max() < 1e-9
    assert np.allclose(T[-1], goal.matrix, atol=1e-9)


@SOME
@given(st.sampled_from(["xMatePro3", "xMatePro7"]), seeds, speeds, st.floats(-1.5, 1.5))
def test_in_the_null_space_the_tool_stands_and_the_arm_angle_arrives(name, seed, speed, psi):
    model = MODELS[name]
    q = ends(model, seed)[0]
    motion = planned(plan_nullspace, model, q, psi, speed=speed)
    require_allowed(model, motion, speed)
    require_smooth(motion)
    assert np.abs(model.forward_path(motion.q) - model.forward(q).matrix).max() < 1e-9
    assert model.arm_angle(motion.q[-1]) == pytest.approx(psi, abs=1e-9)


@SOME
@given(names, st.floats(0.3, math.tau), st.floats(0.03, 0.15), speeds, st.sampled_from(["held", "turning"]))
@example("FR3", 2.0, 0.125, 0.2, "turning")  # More rows than are computed together.
def test_a_circle_comes_back_or_goes_as_far_as_told(name, angle, radius, speed, orientation):
    model = MODELS[name]
    T = model.forward(model.home)
    center = T.position - (radius, 0.0, 0.0)
    around = {"center": center, "axis": (0.0, 0.0, 2.0), "angle": angle, "orientation": orientation}
    motion = planned(plan_circle, model, model.home, **around, speed=speed)
    require_allowed(model, motion, speed)
    require_smooth(motion)
    poses = model.forward_path(motion.q)
    assert np.abs(np.linalg.norm(poses[:, :3, 3] - center, axis=1) - radius).max() < 1e-9
    if orientation == "held":
        assert np.abs(poses[:, :3, :3] - T.rotation).max() < 1e-9
    else:
        seen = np.einsum("nji,nj->ni", poses[:, :3, :3], center - poses[:, :3, 3])
        assert np.abs(seen - seen[0]).max() < 1e-9
    end = center + radius * np.array([math.cos(angle), math.sin(angle), 0.0])
    assert np.allclose(poses[-1, :3, 3], end, atol=1e-9)


@SOME
@given(names, seeds, st.sampled_from([0.3, 0.1]), st.sampled_from(["line", "arc", "circle", "elbow"]))
@example("FR3", 1405, 0.3, "arc")  # Joint 5 turns fast close to a singular pose.
@example("RM65", 22, 0.3, "arc")
def test_the_s_profile_is_as_smooth_and_between_the_cycles_not_faster_than_at_them(name, seed, speed, kind):
    model = MODELS[name]
    q, via, goal, psi = ends(model, seed, 0.4)
    options = {"speed": speed, "law": "s_profile"}
    if kind == "line":
        motion = planned(plan_line, model, q, goal, psi=psi, **options)
    elif kind == "arc":
        motion = planned(plan_arc, model, q, via, goal, psi=psi, **options)
    elif kind == "circle":
        center = model.forward(q).position - (0.05, 0.0, 0.0)
        motion = planned(plan_circle, model, q, center=center, axis=(0.0, 0.0, 1.0), **options)
    else:
        model, q = SEVEN, ends(SEVEN, seed)[0]
        motion = planned(plan_nullspace, model, q, model.arm_angle(q) + 0.3, **options)
    require_smooth(motion)
    times = np.linspace(0.0, motion.duration, 7 * len(motion))
    joint = model.limits.joint
    for order, rows, limit in ((1, motion.dq, joint.velocity), (2, motion.ddq, joint.acceleration)):
        between = np.abs(motion.polynomial.sample(times, order)) / limit
        highest = (np.abs(rows) / limit).max(axis=0)
        if kind == "arc":  # The jerk jumps at via, where the path's acceleration may thus peak between two rows.
            near = int(np.linalg.norm(model.forward_path(motion.q)[:, :3, 3] - via.position, axis=1).argmin())
            highest += np.abs(np.diff(rows[max(near - 2, 0) : near + 3], axis=0)).max(axis=0) / (2.0 * limit)
        assert (between.max(axis=0) <= 1.001 * highest + 1e-4).all()
    assume(check(motion, model).ok)
    assert (np.abs(motion.polynomial.sample(times, 3)) < joint.jerk).all()


@SOME
@given(names, seeds)
def test_a_bounded_jerk_costs_little(name, seed):
    model = MODELS[name]
    q, _, goal, psi = ends(model, seed)
    motion = planned(plan_line, model, q, goal, psi=psi, speed=1.0)
    path = build_line(model.forward(q), goal, angles(model, q), psi)
    bounds = along._bounds(model, 1.0)
    allowed = along._path_bounds(path, along.require_path(model, q, path), bounds)
    squares = FastestLaw(allowed).slowed(np.ones(len(allowed.knots)))
    speed, steps = np.sqrt(squares), np.diff(allowed.knots)
    without = float((2.0 * steps / (speed[:-1] + speed[1:])).sum())
    assume(without > 0.2)
    joint, tool = model.limits.joint, model.limits.cartesian
    tool_acceleration = (
        math.dist(model.forward(q).position, goal.position) * np.abs(np.diff(squares) / steps).max() / 2.0
    )
    reversal = 2.0 * max((joint.acceleration / joint.jerk).max(), tool_acceleration / tool.translation_jerk)
    assert motion.duration <= 1.13 * without + reversal


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("length", [2e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("speed", [1.0, 0.01])
def test_the_shortest_line_is_a_motion_too(name, length, speed):
    model = MODELS[name]
    T = model.forward(model.home)
    motion = plan_line(model, model.home, Pose(T.position + (length, 0.0, 0.0), T.wxyz), speed=speed)
    require_allowed(model, motion, speed)
    assert model.forward(motion.q[-1]).position[0] == pytest.approx(T.position[0] + length, abs=1e-12)


def test_a_joint_goes_up_to_its_limit_and_not_past_it():
    model = load_model("xMatePro7")
    q = model.home.copy()
    q[6] = model.limits.joint.upper[6] - 0.1
    near, past = (model.forward(q) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, turn)) for turn in (0.0999, 0.1001))
    assert plan_line(model, q, near).q[-1, 6] == pytest.approx(q[6] + 0.0999, abs=1e-9)
    with pytest.raises(PlanningError, match=r"joint 7 would pass its limit at 360\.01 deg \(-360 to 360 deg\)"):
        plan_line(model, q, past)


def test_a_path_through_a_singularity_in_the_arms_plane_is_a_motion():
    q = np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0])
    T = SEVEN.forward(q)
    motion = plan_line(SEVEN, q, T @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, -0.8, 0.0)), speed=0.5)
    require_allowed(SEVEN, motion, 0.5)
    assert motion.q[:, 5].min() < -0.1


@pytest.mark.parametrize("roll", [1e-7, 1e-5, 1e-4, 1e-3])
def test_a_path_beside_a_singularity_is_refused_with_its_place(roll):
    q = np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0])
    goal = SEVEN.forward(q) @ Pose.from_rpy((0.0, 0.0, 0.0), (roll, -0.8, 0.0))
    with pytest.raises(PlanningError, match=r"line cannot be followed at 0\.\d+ of .* rad \(.* singularity") as caught:
        plan_line(SEVEN, q, goal, speed=0.5)
    assert caught.value.share == pytest.approx(0.5, abs=0.25)


@pytest.mark.parametrize(
    ("step", "reason"),
    [((2.0, 0.0, 0.0), "out of reach by"), ((0.0, 0.0, 0.5), r"joint \d would pass its limit at")],
)
def test_what_cannot_be_followed_is_told_with_its_place_and_reason(step, reason):
    T = SEVEN.forward(SEVEN.home)
    with pytest.raises(PlanningError, match=rf"line cannot be followed at \d.* % of the path, tool at .*{reason}"):
        plan_line(SEVEN, SEVEN.home, Pose(T.position + step, T.wxyz))
