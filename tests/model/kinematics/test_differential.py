"""Velocity and acceleration of every frame, and their inverses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.least_norm import NEAR_SINGULAR
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from tests.arms import ANY_POSE

TOOL = Pose.from_rpy((0.03, -0.02, 0.12), (0.3, -0.4, 0.5))
STIFFNESS = Pose.from_rpy((0.01, 0.05, -0.02), (-0.2, 0.6, 1.5))
ARMS = {name: load_model(name, tool=TOOL).with_stiffness_frame(STIFFNESS) for name in ROBOT_NAMES}
seeds = st.integers(0, 2**32 - 1)


def frames(model):
    return [f"joint{number}" for number in range(1, model.n + 1)] + ["flange", "tool", "stiffness"]


def states(model, seed, count=6):
    rng, limits = np.random.default_rng(seed), model.limits.joint
    q = rng.uniform(limits.lower, limits.upper, (count, model.n))
    return q, *rng.uniform(-1, 1, (2, count, model.n))


def twist_between(before, after, dt):
    """Central difference of poses, (N, 6): velocity of the origin, and angular velocity from R' R^T."""
    middle = 0.5 * (before + after)
    slope = (after - before) / dt
    turn = slope[:, :3, :3] @ middle[:, :3, :3].transpose(0, 2, 1)
    return np.concatenate((slope[:, :3, 3], turn[:, (2, 0, 1), (1, 2, 0)]), axis=1)


@pytest.mark.parametrize("name", ROBOT_NAMES)
@settings(max_examples=25)
@given(seed=seeds)
def test_velocity_and_acceleration_are_derivatives_in_every_frame(name, seed):
    model, dt = ARMS[name], 1e-4  # [s] Balances truncation (dt^2) against rounding (1e-16 / dt) near 1e-8.
    q, dq, ddq = states(model, seed, 2)
    for frame in frames(model):
        before, after = (model.forward_path(q + sign * dt / 2 * dq, frame) for sign in (-1, 1))
        velocity = model.velocity(q, dq, frame)
        np.testing.assert_allclose(twist_between(before, after, dt), velocity, atol=1e-6)
        ends = [model.velocity(q + s * dq + s * s / 2 * ddq, dq + s * ddq, frame) for s in (-dt / 2, dt / 2)]
        np.testing.assert_allclose((ends[1] - ends[0]) / dt, model.acceleration(q, dq, ddq, frame), atol=1e-6)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_a_table_gives_what_its_rows_give(name):
    model = ARMS[name]
    q, dq, ddq = states(model, 3)
    for frame in frames(model):
        for row in range(len(q)):
            np.testing.assert_allclose(model.pose(q[row], frame).matrix, model.forward_path(q, frame)[row], atol=1e-14)
            for call, arguments in (
                (model.jacobian, (q,)),
                (model.velocity, (q, dq)),
                (model.acceleration, (q, dq, ddq)),
            ):
                one = call(*(table[row] for table in arguments), frame)
                np.testing.assert_allclose(one, call(*arguments, frame)[row], atol=1e-13)
    np.testing.assert_allclose(model.pose(q[0], "flange").matrix, model.joint_frames(q[0])[-1].matrix, atol=1e-14)


@pytest.mark.parametrize("name", ROBOT_NAMES)
@settings(max_examples=25)
@given(seed=seeds)
def test_the_inverse_velocity_is_exact_and_no_other_exact_one_is_smaller(name, seed):
    model, rng = ARMS[name], np.random.default_rng(seed)
    q, dq, _ = states(model, seed)
    weights = rng.uniform(0.2, 5.0, model.n)
    twist = model.velocity(q, dq)
    found = model.joint_velocity(q, twist, weights)
    np.testing.assert_allclose(found.missed, twist - model.velocity(q, found.rates), atol=1e-10)
    exact = ~found.damped
    np.testing.assert_allclose(found.missed[exact], 0.0, atol=1e-9)
    costs = (weights * np.square(found.rates)).sum(axis=1), (weights * np.square(dq)).sum(axis=1)
    assert (costs[0] <= costs[1] * (1 + 1e-9)).all()
    if model.n == 6:
        np.testing.assert_allclose(found.rates[exact], dq[exact], atol=1e-9)


@pytest.mark.parametrize("name", ROBOT_NAMES)
@settings(max_examples=25)
@given(seed=seeds)
def test_the_inverse_acceleration_gives_the_acceleration_back(name, seed):
    model = ARMS[name]
    q, dq, ddq = states(model, seed)
    for frame in ("flange", "stiffness"):
        wanted = model.acceleration(q, dq, ddq, frame)
        found = model.joint_acceleration(q, dq, wanted, frame=frame)
        exact = ~found.damped
        np.testing.assert_allclose(model.acceleration(q, dq, found.rates, frame)[exact], wanted[exact], atol=1e-8)
        np.testing.assert_allclose(wanted - model.acceleration(q, dq, found.rates, frame), found.missed, atol=1e-9)


@pytest.mark.parametrize("name", ANY_POSE)
def test_near_a_singularity_rates_stay_bounded_and_the_answer_says_so(name):
    model = load_model(name)
    stretched = np.zeros(model.n)
    twist = [0.3, 0.2, 0.5, 0.15, 0.2, 0.3]
    found = model.joint_velocity(stretched, twist)
    assert found.damped
    assert np.abs(found.missed).max() > 0.1
    assert np.linalg.norm(found.rates) <= np.linalg.norm(twist) / NEAR_SINGULAR
    assert "damped" in repr(found)
    assert not model.joint_velocity(model.home, twist).damped
    assert "exact" in repr(model.joint_velocity(model.home, twist))


def test_damping_sets_in_without_a_jump():
    model = load_model("xMatePro7")
    bends = np.linspace(0.5, -0.5, 2001)  # Joint 4 through the stretched arm.
    q = np.tile(model.home, (len(bends), 1))
    q[:, 3] = bends
    found = model.joint_velocity(q, np.tile([0.1, 0.0, 0.2, 0.0, 0.0, 0.0], (len(q), 1)))
    assert found.damped.any()
    assert not found.damped.all()
    steps = np.abs(np.diff(found.rates, axis=0)).max()
    finer = np.abs(np.diff(found.rates[::2], axis=0)).max()
    assert steps < 0.6 * finer  # Half the step, half the change: continuous.


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda m: m.pose(m.home, "elbow"),
            r"frame must be one of joint1, .* joint7, flange, tool, stiffness, got 'elbow'",
        ),
        (
            lambda m: m.velocity(np.zeros((3, 7)), np.zeros(7)),
            r"dq needs one row for each of the \d+.*, got an array of shape \(7,\)",
        ),
        (lambda m: m.velocity(m.home, np.zeros((1, 7))), r"dq needs a single row.*, got an array of shape \(1, 7\)"),
        (lambda m: m.joint_velocity(m.home, [0.0] * 5), r"twist: .* needs \(6,\)"),
        (lambda m: m.joint_velocity(m.home, [0.0] * 6, weights=[1.0] * 6 + [0.0]), "weights must all be above 0"),
        (lambda m: m.jacobian([[0.0] * 7, [0.0] * 6]), "q "),
        (lambda m: m.with_stiffness_frame("tip"), "stiffness frame must be a Pose"),
    ],
)
def test_what_cannot_be_answered_is_refused_in_words(call, words):
    with pytest.raises(InvalidValueError, match=words):
        call(load_model("xMatePro7"))


def test_a_six_axis_arm_has_no_seventh_joint_frame():
    with pytest.raises(InvalidValueError, match="joint7"):
        load_model("xMate3").pose(np.zeros(6), "joint7")


def test_tool_load_and_stiffness_frame_are_kept_apart():
    from rcilab import Payload

    model = load_model("xMatePro7").with_stiffness_frame(STIFFNESS).with_tool(TOOL).with_load(Payload(mass=1.0))
    assert model.T_tool_stiffness is STIFFNESS
    assert model.T_flange_tool is TOOL
    assert model.with_stiffness_frame(TOOL).load.mass == 1.0
    assert model.fingerprint == model.with_stiffness_frame(TOOL).fingerprint  # No judgement depends on it.
