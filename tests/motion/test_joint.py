import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.diagnostics.bench.fastest import fastest_straight
from rcilab.model.robot_model import load_model
from rcilab.motion import LIMIT_MARGIN, _ruckig, plan_joint
from rcilab.motion.joint import MIN_SPEED

ALL = [load_model(name) for name in ("xMatePro7", "xMate3", "Panda", "xMatePro3", "xMate7")]
MODEL = ALL[0]
LIMITS = MODEL.limits.joint


def random_angles(rng: np.random.Generator, model=MODEL) -> np.ndarray:
    joint = model.limits.joint
    rim = rng.uniform(0.005, 0.01) * (joint.upper - joint.lower)
    return rng.uniform(joint.lower + rim, joint.upper - rim)


@settings(max_examples=120)
@given(st.sampled_from(ALL), st.integers(0, 2**32), st.floats(0.05, 1.0), st.floats(-7.0, 0.0))
def test_no_backward_difference_of_a_planned_motion_reaches_a_limit(model, seed, speed, size):
    rng = np.random.default_rng(seed)
    start, limits = random_angles(rng, model), model.limits.joint
    goal = start + 10.0**size * (random_angles(rng, model) - start)
    motion = plan_joint(model, start, goal, speed=speed)
    q = np.concatenate((np.repeat(start[np.newaxis], 3, axis=0), motion.q, np.repeat(goal[np.newaxis], 3, axis=0)))
    dq = np.diff(q, axis=0) / CYCLE_TIME
    ddq = np.diff(dq, axis=0) / CYCLE_TIME
    jerk = np.diff(ddq, axis=0) / CYCLE_TIME
    assert (np.abs(dq) < limits.velocity * speed).all()
    assert (np.abs(ddq) < limits.acceleration * speed).all()
    assert (np.abs(jerk) < limits.jerk).all()
    assert ((limits.lower < q) & (q < limits.upper)).all()


def offset_from_line(q, start, goal):
    """How far rows are from the straight line in joint space, by the share of the joint that goes farthest, [rad]."""
    way = goal - start
    longest = np.abs(way).argmax()
    share = (q[:, longest] - start[longest]) / way[longest]
    return np.abs(q - start - share[:, np.newaxis] * way).max()


@settings(max_examples=100)
@given(st.sampled_from(ALL), st.integers(0, 2**32), st.floats(0.01, 1.0), st.floats(-6.0, 0.0), st.floats(0.0, 1.0))
def test_from_rest_it_is_the_fastest_motion_on_the_straight_line_in_joint_space(model, seed, speed, size, still):
    rng = np.random.default_rng(seed)
    start = random_angles(rng, model)
    goal = start + 10.0**size * (random_angles(rng, model) - start) * (rng.random(model.n) >= 0.9 * still)
    motion = plan_joint(model, start, goal, speed=speed)
    if np.array_equal(start, goal):
        assert motion.duration == 0.0
        return
    q = motion.polynomial.sample(np.linspace(0.0, motion.duration, 997))
    assert offset_from_line(q, start, goal) < 1e-12
    bound = fastest_straight(model.limits.joint, goal - start, LIMIT_MARGIN * speed, LIMIT_MARGIN)
    assert motion.duration == pytest.approx(bound, rel=1e-4)
    # The margin is all that is given away: a tenth of a percent of speed.
    assert motion.duration <= 1.002 * fastest_straight(model.limits.joint, goal - start, speed)


@settings(max_examples=30)
@given(st.sampled_from(ALL), st.integers(0, 2**32), st.floats(0.05, 1.0), st.floats(0.05, 1.0))
def test_who_moves_along_the_line_stays_on_it_though_the_speed_changes(model, seed, first, second):
    rng = np.random.default_rng(seed)
    middle = 0.5 * (model.limits.joint.lower + model.limits.joint.upper)
    start, goal = (0.5 * (middle + random_angles(rng, model)) for _ in range(2))
    motion = plan_joint(model, start, goal, speed=first)
    now = motion.at(rng.uniform(0.1, 0.5) * motion.duration)
    try:
        rest = plan_joint(model, now.q, goal, speed=second, start_velocity=now.dq, start_acceleration=now.ddq)
    except PlanningError as error:  # At the lower speed it brakes too gently to stop before a limit.
        if second >= first or "plan with a higher speed" not in str(error):
            raise
        reject()
    assert offset_from_line(rest.q, start, goal) < 1e-11
    assert np.abs(rest.at(0.0).dq - now.dq).max() < 1e-11
    assert np.abs(rest.at(0.0).ddq - now.ddq).max() < 1e-11


def test_one_joint_takes_the_time_that_its_limits_give_by_hand():
    goal = np.zeros(7)
    goal[0] = 2.0
    v, a, j = (LIMIT_MARGIN * bound[0] for bound in (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk))
    # A full seven-step profile: T = D / v + v / a + a / j.
    assert plan_joint(MODEL, np.zeros(7), goal, speed=1.0).duration == pytest.approx(2.0 / v + v / a + a / j, abs=1e-12)


def test_a_faster_motion_is_never_longer():
    durations = [plan_joint(MODEL, MODEL.home, -MODEL.home, speed=speed).duration for speed in np.linspace(0.05, 1, 20)]
    assert durations == sorted(durations, reverse=True)


def test_our_polynomial_is_ruckigs_trajectory(monkeypatch):
    trajectories = []
    build = _ruckig._polynomial
    monkeypatch.setattr(_ruckig, "_polynomial", lambda found: trajectories.append(found) or build(found))
    rng = np.random.default_rng(2)
    for _ in range(150):
        start = rng.uniform(-1, 1, 7)
        dq = rng.uniform(-1.3, 1.3, 7) * LIMITS.velocity  # Also above the bound, which makes it brake first.
        ddq = rng.uniform(-1.3, 1.3, 7) * LIMITS.acceleration
        bounds = 0.5 * LIMITS.velocity, 0.5 * LIMITS.acceleration, LIMITS.jerk
        curve = _ruckig.plan_profile(start, rng.uniform(-1, 1, 7), *bounds, dq, ddq)
        trajectory = trajectories[-1]
        assert curve.duration == trajectory.duration
        for t in rng.uniform(0.0, curve.duration, 20):
            for ours, theirs in zip(curve.at(t), trajectory.at_time(t), strict=False):
                # Positions to rounding, but for the miss of up to 1e-8 rad that we take out and ruckig leaves in.
                assert np.allclose(ours, theirs, rtol=0.0, atol=1e-8)
        assert np.abs(curve.at(0.0)[0] - start).max() == 0.0


def test_from_rest_it_is_ruckigs_trajectory_where_all_joints_are_bound_alike():
    rng, rest = np.random.default_rng(3), np.zeros(7)
    for _ in range(50):
        start, goal = random_angles(rng), random_angles(rng)
        bounds = [bound * np.abs(goal - start) for bound in rng.uniform((0.1, 0.5, 100.0), (1.0, 10.0, 1000.0))]
        ours = _ruckig.plan_profile(start, goal, *bounds, rest, rest)
        theirs = _ruckig._plan_synchronized(start, goal, *bounds, rest, rest)
        times = np.linspace(0.0, ours.duration, 100)
        assert ours.duration == pytest.approx(theirs.duration, rel=1e-6)
        assert np.allclose(ours.sample(times), theirs.sample(times), rtol=0.0, atol=1e-6)


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.floats(0.05, 1.0))
def test_a_moving_start_is_continued_without_a_jump(seed, speed):
    rng = np.random.default_rng(seed)
    first = plan_joint(MODEL, 0.5 * random_angles(rng), 0.5 * random_angles(rng), speed=speed)
    present = first.at(rng.uniform(0.2, 0.6) * first.duration)
    goal = 0.5 * random_angles(rng)
    second = plan_joint(MODEL, present.q, goal, speed=speed, start_velocity=present.dq, start_acceleration=present.ddq)
    begin = second.at(0.0)
    assert np.array_equal(begin.q, present.q)
    assert np.allclose(begin.dq, present.dq, atol=1e-9)
    assert np.allclose(begin.ddq, present.ddq, atol=1e-6)
    assert np.array_equal(second.q[-1], goal)
    assert ((LIMITS.lower < second.q) & (second.q < LIMITS.upper)).all()
    assert (np.abs(second.dq) <= LIMITS.velocity).all()


def test_a_start_that_runs_into_a_limit_is_refused_with_joint_and_time():
    start = np.zeros(7)
    start[1] = LIMITS.upper[1] - 0.05
    velocity = np.zeros(7)
    velocity[1] = 2.0
    with pytest.raises(PlanningError, match=r"joint 2: would reach 1\d\d\.\d+° .* at t = 0\.\d+ s, past .* 120\.00°"):
        plan_joint(MODEL, start, np.zeros(7), start_velocity=velocity)


@pytest.mark.parametrize(
    ("joint", "angle", "which"), [(4, 2.3, "goal"), (2, -2.2, "start"), (7, 2 * np.pi, "goal"), (1, 10.0, "start")]
)
def test_angles_outside_the_limits_are_refused_with_joint_value_and_bound(joint, angle, which):
    q = {"start": np.zeros(7), "goal": np.zeros(7)}
    q[which][joint - 1] = angle
    bound = np.degrees(LIMITS.upper[joint - 1])
    with pytest.raises(PlanningError, match=rf"joint {joint}: {which} {np.degrees(angle):.2f}° .* {bound:.2f}°"):
        plan_joint(MODEL, **q)


def test_start_states_beyond_the_limits_are_refused():
    velocity = np.zeros(7)
    velocity[4] = 2.7
    with pytest.raises(PlanningError, match=r"joint 5: start velocity 2\.7 rad/s exceeds 2\.61 rad/s"):
        plan_joint(MODEL, np.zeros(7), MODEL.home, start_velocity=velocity)
    with pytest.raises(PlanningError, match="joint 2: start acceleration -8 rad/s"):
        plan_joint(MODEL, np.zeros(7), MODEL.home, start_acceleration=[0, -8, 0, 0, 0, 0, 0])
    with pytest.raises(PlanningError, match="joint 1: velocity shortly after"):
        plan_joint(
            MODEL,
            np.zeros(7),
            MODEL.home,
            start_velocity=[2.17, 0, 0, 0, 0, 0, 0],
            start_acceleration=[15, 0, 0, 0, 0, 0, 0],
        )


@pytest.mark.parametrize("speed", [0.0, -0.1, 1.0001, float("nan"), float("inf")])
def test_a_speed_outside_its_range_is_refused(speed):
    with pytest.raises(InvalidValueError, match=r"speed must be from 0\.001 to 1"):
        plan_joint(MODEL, np.zeros(7), MODEL.home, speed=speed)


def test_shapes_numbers_and_laws_are_checked():
    with pytest.raises(InvalidValueError, match=r"goal.*needs \(7,\)"):
        plan_joint(MODEL, np.zeros(7), np.zeros(6))
    with pytest.raises(InvalidValueError, match=r"start.*finite"):
        plan_joint(MODEL, np.full(7, np.nan), np.zeros(7))
    with pytest.raises(InvalidValueError, match="start_velocity"):
        plan_joint(MODEL, np.zeros(7), np.zeros(7), start_velocity=[1.0])
    with pytest.raises(InvalidValueError, match="known: jerk_limited, torque_rate_limited, s_profile"):
        plan_joint(MODEL, np.zeros(7), np.zeros(7), law="cubic")  # type: ignore[arg-type]


def test_a_refusal_of_ruckig_becomes_a_planning_error_in_words():
    bounds = LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk
    rest = np.zeros(7)
    with pytest.raises(PlanningError, match=r"no motion: .*valid"):
        _ruckig.plan_profile(rest, np.full(7, np.nan), *bounds, rest, rest)
    with pytest.raises(PlanningError, match="no motion"):
        _ruckig.plan_profile(rest, np.ones(7), -LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk, rest, rest)


def test_every_result_of_ruckig_has_a_reason_in_words():
    from ruckig import Result

    failures = {result for result in Result if int(result) < 0}
    assert failures == set(_ruckig._REASONS)
    assert all("Error" not in reason for reason in _ruckig._REASONS.values())


@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
def test_a_speed_is_bounded_from_below_and_plans_at_the_bound(law):
    model = load_model("xMatePro7")
    lower, upper = model.limits.joint.lower + 1e-6, model.limits.joint.upper - 1e-6
    assert plan_joint(model, lower, upper, speed=MIN_SPEED, law=law).duration > 3600.0
    with pytest.raises(InvalidValueError, match=r"speed must be from 0\.001 to 1.*, got 1e-09"):
        plan_joint(model, lower, upper, speed=1e-9, law=law)


@pytest.mark.parametrize("change", [{"speed": "fast"}, {"speed": None}, {"speed": np.ones(2)}, {"law": [1]}])
def test_a_speed_or_law_of_the_wrong_type_is_refused_in_words(change):
    model = load_model("xMatePro7")
    with pytest.raises(InvalidValueError, match=rf"^{next(iter(change))}( must|: )"):
        plan_joint(model, model.home, model.home, **change)


def test_a_name_where_the_model_belongs_says_what_to_write_and_a_description_is_enough():
    model = load_model("xMatePro7")
    with pytest.raises(InvalidValueError, match=r"use load_model\('xMatePro7'\)"):
        plan_joint("xMatePro7", model.home, model.home)
    assert plan_joint(model.description, model.home, model.home).duration == 0.0
