import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.symmetric_solver import SymmetricSolver
from rcilab.model.robot_model import load_model
from rcilab.motion import Jog, Motion, plan_joint, plan_stop
from rcilab.motion.end_velocity import braking_limits
from rcilab.motion.online import POSITION_MARGIN
from rcilab.motion.twist import DAMPED_BELOW, damped_inverse
from tests.arms import REPRESENTATIVE

MODELS = {name: load_model(name) for name in REPRESENTATIVE}
MODEL = MODELS["xMatePro7"]
LIMITS = MODEL.limits.joint
LONG = 60_000  # Cycles that every motion to rest is shorter than: two turns of a joint, slowly.

arms = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS.keys())
seeds = st.integers(0, 2**32)


def assert_inside_limits(model, q):
    limits = model.limits.joint
    values = np.asarray(q)
    since = values[3:]  # The three rows of history before are invented.
    assert ((limits.lower < since) & (since < limits.upper)).all()
    for bound in (limits.velocity, limits.acceleration, limits.jerk):
        values = np.diff(values, axis=0) / CYCLE_TIME
        assert (np.abs(values) < bound).all()


def from_ends(model):
    """The distance from the ends of the ranges at which a joint stops."""
    return POSITION_MARGIN + braking_limits(model.limits.joint)[1]


def history(q, dq, ddq):
    """Returns four rows that end with q and have these derivatives there."""
    t = np.array([-3.0, -2.0, -1.0, 0.0])[:, np.newaxis] * CYCLE_TIME
    return list(q + dq * t + ddq * t**2 / 2.0)


def moving_state(model, rng, speeds=(0.2, 1.0)):
    """Returns a random state inside the limits, from which there is still a way to stay inside."""
    limits = model.limits.joint
    while True:
        q = rng.uniform(limits.lower, limits.upper)
        ddq = rng.uniform(-0.99, 0.99, model.n) * limits.acceleration * rng.integers(0, 2)
        dq = rng.uniform(-1.0, 1.0, model.n) * (0.99 * limits.velocity - ddq**2 / (1.9 * limits.jerk))
        try:
            return q, dq, ddq, Jog(model, q, dq, ddq, speed=rng.choice(speeds))
        except PlanningError:
            continue


def command_anything(jog, model, rng):
    limits = model.limits.joint
    size = rng.choice([1e-6, 1e-3, 0.1, 1.0, 3.0])
    match rng.integers(0, 6):
        case 0 | 1:
            wanted = size * limits.velocity * rng.uniform(-1.0, 1.0, model.n)
            jog.set_joint_velocity(wanted * rng.integers(0, 2, model.n))
        case 2 | 3:
            jog.set_twist(size * rng.normal(size=6), frame=rng.choice(["base", "tool"]))
        case 4:
            jog.set_target(rng.uniform(1.1 * limits.lower, 1.1 * limits.upper))
        case _:
            jog.stop()


def until_rest(jog):
    rows = []
    for _ in range(LONG):
        rows.append(jog.step())
        if jog.is_stationary:
            return rows
    raise AssertionError("never came to rest")


@arms
@settings(max_examples=12)
@given(seed=seeds)
def test_no_sequence_of_commands_leaves_the_limits_and_a_stop_ends_it_at_rest(model, seed):
    rng = np.random.default_rng(seed)
    q, dq, ddq, jog = moving_state(model, rng)
    rows = history(q, dq, ddq)
    for _ in range(6):
        command_anything(jog, model, rng)
        rows += [jog.step() for _ in range(int(rng.integers(1, 120)))]
    jog.stop()
    rows += until_rest(jog)
    rows += [jog.step() for _ in range(4)]
    assert_inside_limits(model, rows)
    assert np.array_equal(rows[-1], rows[-3])


@arms
@settings(max_examples=12)
@given(seed=seeds)
def test_commands_that_change_in_every_cycle_stay_inside_the_limits(model, seed):
    rng = np.random.default_rng(seed)
    q, dq, ddq, jog = moving_state(model, rng)
    rows = history(q, dq, ddq)
    for _ in range(150):
        command_anything(jog, model, rng)
        rows.append(jog.step())
    assert_inside_limits(model, rows)


@arms
@settings(max_examples=8)
@given(seed=seeds)
def test_joints_led_towards_their_limits_come_to_rest_just_inside(model, seed):
    rng = np.random.default_rng(seed)
    q, dq, ddq, jog = moving_state(model, rng, speeds=[1.0])
    rows = history(q, dq, ddq)
    side = rng.choice([-1.0, 1.0], model.n)
    jog.set_joint_velocity(side * rng.uniform(0.6, 1.2, model.n) * model.limits.joint.velocity)
    rows += until_rest(jog)
    rows += [jog.step() for _ in range(50)]
    assert_inside_limits(model, rows)
    ends = np.where(side > 0.0, model.limits.joint.upper, model.limits.joint.lower)
    # A joint that started inside the margin stays where its stop led it.
    assert (np.abs(rows[-1] - ends) <= from_ends(model) + 1e-7).all()


@arms
@settings(max_examples=12)
@given(seed=seeds)
def test_a_target_is_reached_from_any_state(model, seed):
    rng = np.random.default_rng(seed)
    q, dq, ddq, jog = moving_state(model, rng, speeds=[1.0])
    rows = history(q, dq, ddq)
    inside = from_ends(model)
    target = rng.uniform(0.99 * model.limits.joint.lower, 0.99 * model.limits.joint.upper)
    target = np.clip(target, model.limits.joint.lower + inside, model.limits.joint.upper - inside)
    jog.set_target(target)
    rows += until_rest(jog)
    assert_inside_limits(model, rows)
    assert np.allclose(rows[-1], target, rtol=0.0, atol=1e-7)


def test_a_target_is_reached_as_fast_as_the_slowest_joint_can():
    goal = MODEL.home + np.array([0.1, 0.0, 0.0, 0.9, 0.0, 0.0, 0.0])
    jog = Jog(MODEL, MODEL.home)
    jog.set_target(goal)
    assert len(until_rest(jog)) == len(plan_joint(MODEL, MODEL.home, goal, speed=1.0)) - 1


def test_a_moving_target_is_followed_at_its_pace_and_then_reached():
    jog, target = Jog(MODEL, MODEL.home), MODEL.home
    rows = [MODEL.home] * 4
    for k in range(1500):
        target = MODEL.home + 0.3 * np.sin(2.0 * k * CYCLE_TIME)
        jog.set_target(target)
        rows.append(jog.step())
        # At 0.6 rad/s a joint that is always ready to stop lags by its stopping distance and a bit.
        assert np.abs(rows[-1] - target).max() < 0.6 * (0.6 / 7.5 + 0.02)
    rows += until_rest(jog)
    assert_inside_limits(MODEL, rows)
    assert np.allclose(rows[-1], target, rtol=0.0, atol=1e-7)


@settings(max_examples=20)
@given(seed=seeds)
def test_a_stop_is_the_one_that_plan_stop_plans(seed):
    q, dq, ddq, jog = moving_state(MODEL, np.random.default_rng(seed))
    planned = plan_stop(LIMITS, q, dq, ddq)
    jog.stop()
    rows = until_rest(jog)
    assert np.allclose(rows[: len(planned) - 1], planned.q[1 : len(rows) + 1], rtol=0.0, atol=1e-9)


def test_joint_velocities_are_kept_and_cut_by_one_factor_above_the_limits():
    jog = Jog(MODEL, np.zeros(7), speed=0.5)
    wanted = np.array([0.1, -0.2, 0.0, 0.3, 0.0, 0.0, 0.4])
    jog.set_joint_velocity(wanted)
    for _ in range(200):
        jog.step()
    assert np.allclose(jog.dq, wanted, rtol=0.0, atol=1e-9)
    assert jog.part == 1.0
    jog.set_joint_velocity(20.0 * wanted)
    for _ in range(400):
        jog.step()
    assert np.allclose(jog.dq, jog.part * 20.0 * wanted, rtol=0.0, atol=1e-9)
    assert np.isclose(np.abs(jog.dq / LIMITS.velocity).max(), 0.5 * 0.999)


def twist_of(model, jog, frame):
    twist = model.jacobian(jog.q) @ jog.dq
    R = np.eye(3) if frame == "base" else model.forward(jog.q).rotation.T
    return np.concatenate((R @ twist[:3], R @ twist[3:]))


@arms
@pytest.mark.parametrize("frame", ["base", "tool"])
@settings(max_examples=2, deadline=None)
@given(seed=seeds, size=st.floats(0.01, 0.1))
def test_a_twist_is_followed_in_its_direction_until_a_singularity(model, frame, seed, size):
    wanted = size * np.random.default_rng(seed).normal(size=6)
    jog = Jog(model.with_tool(Pose((0.05, 0.0, 0.1))), model.home)
    jog.set_twist(wanted, frame=frame)
    rows = [model.home] * 4
    for k in range(800):
        rows.append(jog.step())
        if jog.is_damped:
            break
        if k % 20:
            continue
        actual = twist_of(jog._model, jog, frame)
        along = actual @ wanted / (wanted @ wanted)
        # The joints follow each cycle's velocity with a lag of acceleration^2 / (2 jerk), 0.01 rad/s of an RM65.
        lag = np.linalg.norm(np.abs(jog._model.jacobian(jog.q)) @ (jog.ddq**2 / (2.0 * model.limits.joint.jerk)))
        assert np.linalg.norm(actual - along * wanted) < 0.02 * np.linalg.norm(actual) + 0.003 + lag
        assert along < jog.part + 0.003 + lag / np.linalg.norm(wanted)
    assert_inside_limits(model, rows)


def test_a_twist_is_reached_exactly_and_a_zero_twist_brakes_along_it():
    wanted = np.array([0.1, -0.05, 0.02, 0.1, 0.0, 0.05])
    jog = Jog(MODEL, MODEL.home)
    jog.set_twist(wanted)
    for _ in range(300):
        jog.step()
    assert np.allclose(twist_of(MODEL, jog, "base"), wanted, rtol=0.0, atol=1e-3)
    assert jog.part == 1.0
    jog.set_twist(np.zeros(6))
    rest = until_rest(jog)
    assert len(rest) < 200
    assert jog.is_stationary


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_the_same_twist_in_every_cycle_is_the_same_as_once(frame):
    wanted = [0.1, -0.05, 0.02, 0.1, 0.0, 0.05]
    once, always = Jog(MODEL, MODEL.home), Jog(MODEL, MODEL.home)
    once.set_twist(wanted, frame=frame)
    for _ in range(200):
        always.set_twist(wanted, frame=frame)
        assert np.array_equal(always.step(), once.step())


def test_a_twist_that_changes_in_every_cycle_is_followed():
    jog = Jog(MODEL, MODEL.home)
    rows = [MODEL.home] * 4
    for k in range(1500):
        wanted = 0.05 * np.sin(2.0 * k * CYCLE_TIME) * np.array([1.0, 0.0, 1.0, 0.0, 1.0, 0.0])
        jog.set_twist(wanted)
        rows.append(jog.step())
        if k % 10 == 0:
            assert np.abs(twist_of(MODEL, jog, "base") - wanted).max() < 2e-3
    assert_inside_limits(MODEL, rows)


@arms
def test_a_twist_to_the_end_of_a_range_ends_at_rest_with_the_tool_in_its_place(model):
    start = model.home.copy()
    start[-1] = model.limits.joint.upper[-1] - 1.0
    jog = Jog(model, start)
    jog.set_twist([0.0, 0.0, 0.0, 0.0, 0.0, 2.0], frame="tool")  # About the axis of the last joint.
    rows = [start] * 4
    for k in range(3000):
        rows.append(jog.step())
        if k > 100 and jog.is_stationary:
            break
    assert jog.is_stationary
    assert jog.part == 0.0
    assert_inside_limits(model, rows)
    assert model.limits.joint.upper[-1] - rows[-1][-1] < from_ends(model)[-1] + 0.01
    assert np.abs(model.position_path(rows[3:]) - model.forward(start).position).max() < 1e-4


@arms
@settings(max_examples=4, deadline=None)
@given(seed=seeds)
@example(seed=4035459)  # An xArm6, whose joints need long to change their acceleration.
def test_the_tool_keeps_its_own_velocity_limits(model, seed):
    rng = np.random.default_rng(seed)
    jog = Jog(model, model.home)
    direction = rng.normal(size=6)
    jog.set_twist(100.0 * direction, frame=rng.choice(["base", "tool"]))
    rows = [model.home, *(jog.step() for _ in range(700))]
    speed = np.linalg.norm(np.diff(model.position_path(rows), axis=0), axis=1) / CYCLE_TIME
    assert speed.max() < model.limits.cartesian.translation_velocity
    R = model.forward_path(rows)[:, :3, :3]
    turn = (np.einsum("kij,kij->k", R[1:], R[:-1]) - 1.0) / 2.0
    assert (np.arccos(np.minimum(turn, 1.0)) / CYCLE_TIME).max() < model.limits.cartesian.rotation_velocity


@arms
def test_through_a_singularity_the_arm_says_that_it_damps_and_stays_inside_its_limits(model):
    q = model.home.copy()
    if model.name == "xArm6":
        q[2] = -2.73  # Its elbow is stretched there.
    elif model.limits.joint.upper[model.n - 4] > 0.01:
        q[model.n - 4] = 0.01  # The arm is nearly stretched.
    else:
        q[1:3] = 0.01, np.pi / 2.0  # The Panda's elbow ends before: axes 1 and 3 are nearly one, and 2 lies across.
    jog = Jog(model, q)
    jog.set_twist([0.0, 0.1, 0.0, 0.2, 0.0, 0.0])
    rows = [q] * 4
    damped = 0
    for _ in range(800):
        rows.append(jog.step())
        damped += jog.is_damped
    assert damped
    assert_inside_limits(model, rows)
    jog.stop()
    jog.step()
    assert not jog.is_damped


@settings(max_examples=60)
@given(seed=seeds)
def test_the_inverse_is_exact_away_from_singularities_and_bounded_near_them(seed):
    rng = np.random.default_rng(seed)
    U, s, Vt = np.linalg.svd(rng.normal(size=(6, 7)), full_matrices=False)
    s[-1] = rng.choice([0.0, rng.uniform(0.0, DAMPED_BELOW), rng.uniform(1.05 * DAMPED_BELOW, 0.3)])
    J = (U * s) @ Vt
    inverse, damped = damped_inverse(J, SymmetricSolver(6))
    assert damped == (s.min() < DAMPED_BELOW)
    if not damped:
        assert np.allclose(inverse, np.linalg.pinv(J), rtol=1e-6, atol=1e-6)
    assert np.linalg.norm(inverse, 2) <= 1.0 / DAMPED_BELOW + 1e-6
    kept = U[:, s >= DAMPED_BELOW]
    assert np.allclose(kept.T @ J @ inverse, kept.T, atol=1e-6)


def test_what_cannot_be_kept_inside_is_refused_with_the_joint():
    at_the_end = MODEL.home.copy()
    at_the_end[1] = LIMITS.upper[1] - 0.01
    fast = np.zeros(7)
    fast[1] = 1.0
    with pytest.raises(PlanningError, match=r"joint 2: angle after the fastest stop .* plan_stop"):
        Jog(MODEL, at_the_end, fast)
    with pytest.raises(PlanningError, match="joint 2: velocity 3"):
        Jog(MODEL, MODEL.home, 3.0 * fast)
    with pytest.raises(PlanningError, match="joint 2: acceleration"):
        Jog(MODEL, MODEL.home, 0.0 * fast, 8.0 * fast)
    with pytest.raises(PlanningError, match="joint 2: velocity once the acceleration is zero"):
        Jog(MODEL, MODEL.home, 2.17 * fast, 7.4 * fast)
    with pytest.raises(PlanningError, match="joint 1: angle"):
        Jog(MODEL, MODEL.home + 10.0)


def test_what_is_no_command_is_refused_and_the_last_one_goes_on():
    jog = Jog(MODEL, MODEL.home)
    jog.set_joint_velocity(np.full(7, 0.1))
    with pytest.raises(InvalidValueError, match="dq"):
        jog.set_joint_velocity([0.1])
    with pytest.raises(InvalidValueError, match=r"twist.*finite"):
        jog.set_twist([np.nan] * 6)
    with pytest.raises(InvalidValueError, match="frame: 'flange' is unknown; known: base, tool"):
        jog.set_twist(np.zeros(6), frame="flange")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="q"):
        jog.set_target(np.zeros(6))
    with pytest.raises(InvalidValueError, match="speed"):
        Jog(MODEL, MODEL.home, speed=0.0)
    with pytest.raises(InvalidValueError, match="is a name"):
        Jog("xMatePro7", MODEL.home)  # type: ignore[arg-type]
    for _ in range(200):
        jog.step()
    assert np.allclose(jog.dq, 0.1, rtol=0.0, atol=1e-9)


@arms
def test_what_was_jogged_from_rest_to_rest_conforms(model):
    rng = np.random.default_rng(5)
    jog = Jog(model, model.home)
    rows = [model.home]
    for _ in range(8):
        command_anything(jog, model, rng)
        rows += [jog.step() for _ in range(150)]
    jog.stop()
    rows += until_rest(jog)
    assert check(Motion.from_cycles(rows), model).ok


def test_far_inside_the_ranges_looking_at_all_joints_at_once_changes_nothing(monkeypatch):
    def path():
        jog, rows = Jog(MODEL, MODEL.home), []
        for k in range(400):
            if k % 50 == 0:
                jog.set_joint_velocity(1.5 * np.sin(k + np.arange(7)))
            rows.append(jog.step())
        return np.array(rows)

    shortcut = path()
    monkeypatch.setattr(Jog, "_is_far_inside", lambda *_: False)
    assert np.array_equal(path(), shortcut)


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_a_tool_that_is_led_past_its_reach_stands_at_the_edge_and_goes_back_as_it_came(frame):
    wanted = np.array([0.075, 0.0, 0.0, 0.0, 0.0, 0.0]) if frame == "base" else np.array([-0.075, 0, 0, 0, 0, 0])
    jog = Jog(MODEL, MODEL.home)
    jog.set_twist(wanted, frame=frame)
    rows = [MODEL.home] * 4 + [jog.step() for _ in range(4000)]
    start, edge = MODEL.forward(MODEL.home).position, MODEL.forward(jog.q).position
    assert np.abs(jog.dq).max() < 1e-4
    assert jog.part < 0.01
    assert edge[0] > start[0] + 0.1
    assert np.abs(edge[1:] - start[1:]).max() < 0.01
    jog.set_twist(-wanted, frame=frame)
    rows += [jog.step() for _ in range(2000)]
    assert_inside_limits(MODEL, rows)
    back = MODEL.forward(jog.q).position
    assert back[0] < start[0] + 0.05
    assert np.abs(back[1:] - start[1:]).max() < 0.01
    assert jog.q[3] > 0.0  # The elbow has not folded to the other side.
