import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import HOLD_SAMPLES, check
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import LimitViolation, faults_of
from rcilab.conformance.start import StartState
from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae.conditions import RCI_JOINT_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODELS = [load_model("xMatePro7"), load_model("xMate3")]


def faults_by_cycle(motion: Motion, model, start: StartState | None = None) -> list[tuple[Fault, ...]]:
    """Plays a motion into a monitor as the controller would, hold included; one entry a row of the check."""
    monitor = JointMonitor(model.limits.joint, RCI_JOINT_CONDITIONS)
    rows = [*motion.q.tolist(), *[motion.q[-1].tolist()] * HOLD_SAMPLES]
    if start is None:
        monitor.reset(rows[0])
        return [faults_of(monitor.step(row)) for row in rows]
    monitor.reset(start.q.tolist(), start.dq.tolist(), start.ddq.tolist())
    if start.moving:
        return [faults_of(monitor.step(row)) for row in rows[1:]]
    return [faults_of(monitor.step(row)) for row in rows]


@st.composite
def spoiled_motions(draw):
    """A short planned motion with up to four samples, steps or ramps put on top, of any size that matters."""
    model = draw(st.sampled_from(MODELS))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    limits = model.limits.joint
    start = 0.95 * rng.uniform(limits.lower, limits.upper)
    goal = start + rng.uniform(0.01, 0.2) * (0.95 * rng.uniform(limits.lower, limits.upper) - start)
    q = plan_joint(model, start, goal, speed=rng.uniform(0.2, 1.0)).q.copy()
    for _ in range(draw(st.integers(0, 4))):
        row, joint = int(rng.integers(0, len(q))), int(rng.integers(0, model.n))
        size = draw(st.sampled_from([1.0, -1.0])) * 10.0 ** draw(st.floats(-10.0, 0.5))
        kind = draw(st.sampled_from(["sample", "step", "ramp"]))
        if kind == "sample":
            q[row, joint] += size
        else:
            q[row:, joint] += size if kind == "step" else size * np.arange(len(q) - row) / 10.0
    return model, Motion.from_cycles(q)


@settings(max_examples=150)
@given(spoiled_motions())
def test_monitor_and_check_give_the_same_verdict_in_every_cycle(case):
    model, motion = case
    played = faults_by_cycle(motion, model)
    report = check(motion, model, distance=None)
    for condition in RCI_JOINT_CONDITIONS:
        expected = np.zeros(len(played), dtype=bool)
        for violation in report.violations:
            if violation.condition is condition:
                first = round(violation.time / 0.001)
                expected[first : first + violation.count] = True
        assert [condition.fault in faults for faults in played] == expected.tolist()
    assert report.ok == (not any(played))


@settings(max_examples=40)
@given(spoiled_motions(), st.integers(0, 2**32))
def test_they_agree_also_from_a_moving_start(case, seed):
    model, motion = case
    rng = np.random.default_rng(seed)
    start = StartState(motion.start, rng.uniform(-0.3, 0.3, model.n), rng.uniform(-5.0, 5.0, model.n))
    report = check(motion, model, start=start, distance=None)
    later = [v for v in report.violations if v.time + (v.count - 1) * 0.001 > 0.0]
    assert any(faults_by_cycle(motion, model, start)) == bool(later)


def test_faults_come_in_wire_order_and_once_each():
    monitor = JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS)
    assert faults_of(monitor.step([9.0] * 7)) == (
        Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,
        Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
        Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
        Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,
    )


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_not_a_number_breaks_conditions(value):
    monitor = JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS)
    assert Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION in faults_of(
        monitor.step([0.0, value, 0.0, 0.0, 0.0, 0.0, 0.0])
    )


def test_a_standing_arm_raises_nothing_and_a_six_axis_arm_ignores_the_seventh():
    model = MODELS[1]
    monitor = JointMonitor(model.limits.joint, RCI_JOINT_CONDITIONS)
    monitor.reset(model.home.tolist())
    assert faults_of(monitor.step([*model.home.tolist(), float("nan")])) == ()
    assert monitor.q == model.home.tolist()
    assert monitor.dq == monitor.ddq == monitor.jerk == [0.0] * 6


def test_its_signals_are_the_backward_differences():
    monitor = JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS)
    for angle in (1e-6, 3e-6, 7e-6):
        monitor.step([angle] * 7)
    # Differences: 4e-6; second: 2e-6; third: 1e-6 (from 0, 1, 3, 7 micro-radians).
    assert monitor.dq == pytest.approx([4e-3] * 7)
    assert monitor.ddq == pytest.approx([2.0] * 7)
    assert monitor.jerk == pytest.approx([1000.0] * 7)


def test_what_was_broken_is_named_with_joint_value_and_bound():
    monitor = JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS)
    monitor.step([0.0, 0.0, 0.0, -2e-5, 0.0, 0.0, 0.0])
    found = {violation.condition.id: (violation.axis, violation.bound) for violation in monitor.violations()}
    assert found == {"joint.acceleration": (4, -10.0), "joint.jerk": (4, -5000.0)}


def test_reset_forgets_the_past():
    monitor = JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS)
    monitor.step([9.0] * 7)
    monitor.reset([0.5] * 7)
    assert faults_of(monitor.step([0.5] * 7)) == ()
    monitor.reset([0.5] * 7, dq=[0.1] * 7)
    assert faults_of(monitor.step([0.5 + 1e-4] * 7)) == ()


def test_a_reset_to_the_wrong_number_of_joints_is_refused():
    with pytest.raises(InvalidValueError, match="must be 7 numbers"):
        JointMonitor(MODELS[0].limits.joint, RCI_JOINT_CONDITIONS).reset([0.0] * 6)


def test_a_command_of_too_few_joints_is_never_judged_by_those_that_are_there() -> None:
    monitor = JointMonitor(load_model("xMatePro7").limits.joint, RCI_JOINT_CONDITIONS)
    with pytest.raises(ValueError, match="longer"):
        monitor.step([0.0] * 6)


def test_a_value_just_past_its_bound_is_written_with_the_digits_that_differ():
    row = RCI_JOINT_CONDITIONS[0]
    text = LimitViolation(row, 6, 2.09439511, 2.0943951).text
    assert text.endswith("2.09439511 rad passes 2.0943951 rad"), text


def test_a_value_at_its_bound_is_said_to_reach_it():
    at = LimitViolation(RCI_JOINT_CONDITIONS[0], 6, 2.0, 2.0)
    assert at.text.endswith("2 rad reaches 2 rad")
    assert at.remark.code == "joint_reaches"
