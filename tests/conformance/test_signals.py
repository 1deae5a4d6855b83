"""What `check` judges besides the joints' own curves: torques by the model, the tool in its box."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.check import check
from rcilab.conformance.signals import HOLD_SAMPLES, MotionSignals
from rcilab.conformance.start import StartState
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox, box_for_start
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODELS = [load_model("xMatePro7"), load_model("xMate3").with_tool(Pose((0.05, 0.0, 0.12)))]
MODEL = MODELS[0]
LOADED = MODEL.with_load(Payload(mass=5.0, center_of_mass=(0.0, 0.02, 0.1)))


def random_motion(model, seed: int, **options) -> Motion:
    rng = np.random.default_rng(seed)
    start, goal = (0.95 * rng.uniform(model.limits.joint.lower, model.limits.joint.upper) for _ in range(2))
    return plan_joint(model, start, start + 0.2 * (goal - start), **options)


def torque_tables(motion: Motion, model) -> tuple[np.ndarray, np.ndarray]:
    start = StartState(motion.start, np.zeros(model.n), np.zeros(model.n))
    signals = MotionSignals(motion, model, start, None)
    return tuple(signals.table(RCI_CONDITIONS.find(name))[0] for name in ("joint.torque", "joint.torque_rate"))


@settings(max_examples=6)
@given(st.integers(0, 2**32), st.sampled_from(["jerk_limited", "s_profile"]), st.floats(0.1, 1.0))
@example(2157363300, "s_profile", 0.134)  # Small jerks of some ten cycles on a large inertia, at the ends.
@example(971727148, "s_profile", 0.1)
def test_torques_are_the_models_without_gravity_within_two_hundredths_of_their_bounds(seed, law, speed):
    motion = random_motion(LOADED, seed, law=law, speed=speed)
    q = np.concatenate((np.repeat(motion.q[:1], 2, axis=0), motion.q, np.repeat(motion.q[-1:], HOLD_SAMPLES, axis=0)))
    dq = np.diff(q, axis=0) / CYCLE_TIME
    ddq = np.diff(dq, axis=0) / CYCLE_TIME
    exact = np.empty_like(ddq)
    for row in range(len(ddq)):
        terms = LOADED.torque(q[row + 2], dq[row + 1], ddq[row])
        exact[row] = terms.full - terms.gravity
    tau, rate = torque_tables(motion, LOADED)
    exact_rate = np.diff(np.concatenate((np.zeros((1, 7)), exact)), axis=0) / CYCLE_TIME
    assert np.abs((tau - exact) / LOADED.limits.joint.torque).max() < 0.02
    largest, expected = (np.abs(table / LOADED.limits.joint.torque_rate).max() for table in (rate, exact_rate))
    assert largest == pytest.approx(expected, abs=0.05)


def test_a_load_shows_in_the_torques_and_a_tool_does_not():
    motion = random_motion(MODEL, 1, speed=0.8)
    bare, loaded = (check(motion, model).rows for model in (MODEL, LOADED))
    tooled = check(motion, MODEL.with_tool(Pose((0.0, 0.0, 0.3)))).rows
    ratio = {row.id: (a.ratio, row.ratio, b.ratio) for a, row, b in zip(bare, loaded, tooled, strict=True)}
    assert ratio["joint.torque"][1] > 1.1 * ratio["joint.torque"][0]
    assert ratio["joint.torque"][2] == ratio["joint.torque"][0]


def test_standing_still_takes_no_torque_even_where_gravity_alone_is_above_the_bound():
    stretched = np.array([0.0, np.pi / 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    heavy = MODEL.with_load(Payload(mass=7.0))
    assert abs(heavy.torque(stretched).full).max() > 85.0
    report = check(plan_joint(heavy, stretched, stretched), heavy)
    assert not report.warnings


def test_a_torque_too_high_is_advice_with_joint_value_and_way_out_and_the_motion_conforms():
    report = check(random_motion(LOADED, 3, speed=1.0), LOADED)
    assert report.ok
    assert report.certificate is not None
    [advice] = [v for v in report.warnings if v.condition.id == "joint.torque_rate"]
    assert advice.fault is None
    assert abs(advice.value) > abs(advice.bound)
    assert "torque rate of the motion" in str(advice)
    assert 'law="torque_rate_limited"' in str(advice)
    assert "(recommended condition: the controller does not stop for it)" in str(advice)


@settings(max_examples=25)  # Joint angles of one arm: test_verdicts.py.
@given(st.sampled_from(MODELS), st.integers(0, 2**32), st.floats(0.05, 1.2))
def test_monitor_and_check_give_one_verdict_on_the_safety_box(model, seed, edge):
    motion = random_motion(model, seed)
    rng = np.random.default_rng(seed)
    centre = model.forward(motion.q[int(rng.integers(0, len(motion)))]).position
    box = SafetyBox(size=tuple(edge * rng.uniform(0.5, 1.5, 3)), T_base_box=Pose.from_rpy(centre, rng.normal(size=3)))
    monitor = BoxMonitor(box_for_start(box, model.forward(motion.q[0]).position.tolist()), RCI_CONDITIONS.box)
    played = [bool(monitor.step(model.forward(q).position.tolist())) for q in motion.q]
    played += played[-1:] * HOLD_SAMPLES
    report = check(motion, model, box=box, distance=None)
    judged = np.zeros(len(played), dtype=bool)
    for violation in report.violations:
        assert violation.fault is Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION
        first = round(violation.time / CYCLE_TIME)
        judged[first : first + violation.count] = True
    assert judged.tolist() == played
    assert report.ok == (not any(played))


def test_leaving_the_box_is_told_of_the_tool_in_metres_and_inside_it_the_row_shows_how_near():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3, law="s_profile")
    T = MODEL.forward(MODEL.home)
    small, large = (SafetyBox(size=(edge,) * 3, T_base_box=Pose(T.position)) for edge in (0.1, 3.0))
    outside, inside = (check(motion, MODEL, box=box) for box in (small, large))
    assert not outside.ok
    sentence = str(outside.violations[0])
    assert sentence.startswith("tool: commanded position is 0.")
    assert sentence.endswith("(necessary condition); choose a path inside the safety box")
    assert "kCommandCartesianPositionLimitsViolation" in str(outside)
    row = next(row for row in inside.rows if row.id == "cartesian.position")
    assert (row.ok, row.location, row.joint) == (True, "tool", 0)
    assert row.ratio == pytest.approx(1.0 + row.value / 1.5, abs=1e-8)
    assert ">tool<" in inside._repr_html_()


def test_a_box_that_is_not_active_or_not_given_has_no_row():
    motion = random_motion(MODEL, 5)
    idle = SafetyBox(size=(0.1,) * 3, T_base_box=Pose(), active=False)
    for report in (check(motion, MODEL), check(motion, MODEL, box=idle)):
        assert report.ok
        assert "cartesian.position" not in {row.id for row in report.rows}


def test_what_is_no_box_is_refused_in_words():
    with pytest.raises(InvalidValueError, match=r"box must be a SafetyBox"):
        check(random_motion(MODEL, 5), MODEL, box=(1.0, 1.0, 1.0))
