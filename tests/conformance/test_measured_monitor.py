import numpy as np
import pytest

from rcilab.conformance.limit_violation import faults_of
from rcilab.conformance.measured_monitor import MeasuredMonitor
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_MEASURED_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits
STILL, HOME, CENTRE, REST = [0.0] * 7, MODEL.home.tolist(), [0.0, 0.0, 0.0], [0.0] * 6


def monitor(box: SafetyBox | None = None) -> MeasuredMonitor:
    made = MeasuredMonitor(LIMITS, box, RCI_MEASURED_CONDITIONS)
    made.reset(HOME)
    return made


def with_one(values: list[float], index: int, value: float) -> list[float]:
    return [*values[:index], value, *values[index + 1 :]]


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_an_arm_that_follows_a_legal_motion_exactly_is_never_blamed(speed):
    motion = plan_joint(MODEL, MODEL.home, -MODEL.home, speed=speed)
    judge = monitor()
    for q, dq in zip(motion.q.tolist(), motion.dq.tolist(), strict=True):
        assert faults_of(judge.step(q, dq, CENTRE, None, None)) == ()


@pytest.mark.parametrize(("over", "expected"), [(0.99, ()), (1.01, (Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION,))])
def test_an_angle_may_overshoot_its_range_by_a_degree(over, expected):
    q = with_one(HOME, 1, float(LIMITS.joint.upper[1]) + over * np.radians(1.0))
    assert faults_of(monitor().step(q, STILL, CENTRE, None, None)) == expected


@pytest.mark.parametrize(("part", "expected"), [(1.09, ()), (1.11, (Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION,))])
def test_a_joint_may_be_a_tenth_faster_than_commanded(part, expected):
    judge = monitor()
    assert faults_of(judge.step(HOME, with_one(STILL, 4, -part * 2.61), CENTRE, None, None)) == expected
    assert [(violation.axis, violation.bound) for violation in judge.violations()] == (
        [(5, pytest.approx(-2.871))] if expected else []
    )


@pytest.mark.parametrize("size", [3.4, 3.6])
def test_a_steady_acceleration_of_three_and_a_half_times_the_bound_is_too_much(size):
    judge, faults = monitor(), ()
    for cycle in range(60):
        faults = faults_of(judge.step(HOME, with_one(STILL, 1, size * 7.5 * CYCLE_TIME * cycle), CENTRE, None, None))
    assert faults == ((Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION,) if size > 3.5 else ())


def test_noise_of_the_sensors_is_no_acceleration():
    judge, rng = monitor(), np.random.default_rng(0)
    for _ in range(2000):
        noisy = rng.normal(scale=5e-3, size=7)  # 5 mrad/s: 5 to 10 rad/s^2 from cycle to cycle, unfiltered.
        assert faults_of(judge.step(HOME, noisy.tolist(), CENTRE, None, None)) == ()


def test_the_tools_speed_counts_when_it_is_given_and_in_joint_motion_it_is_not():
    fast = [0.8, 0.8, 0.0, 0.0, 0.0, 0.0]  # 1.13 m/s
    judge = monitor()
    assert faults_of(judge.step(HOME, STILL, CENTRE, None, None)) == ()
    assert faults_of(judge.step(HOME, STILL, CENTRE, fast, None)) == (Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION,)
    assert judge.violations()[0].text == "tool: measured translational velocity 1.13137 m/s passes 1.1 m/s"
    turning = [0.0, 0.0, 0.0, 0.0, 2.0, 2.0]
    assert (
        faults_of(judge.step(HOME, STILL, CENTRE, turning, None))[0] is Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION
    )


@pytest.mark.parametrize("column", [0, 5])
def test_a_tool_that_is_driven_too_hard_is_noticed_when_it_lasts(column):
    judge, faults = monitor(), ()
    for cycle in range(25):
        faults = faults_of(judge.step(HOME, STILL, CENTRE, with_one(REST, column, 0.04 * cycle), None))
        assert cycle > 5 or faults == ()
    assert faults == (Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,)


@pytest.mark.parametrize(
    ("out", "expected"), [(0.009, ()), (0.011, (Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION,))]
)
def test_a_tool_may_be_a_centimetre_outside_its_box(out, expected):
    judge = monitor(SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose()))
    assert faults_of(judge.step(HOME, STILL, [0.0, -0.5 - out, 0.0], None, None)) == expected


def test_an_arm_angle_that_races_raises_its_fault_and_one_that_passes_pi_does_not():
    judge = monitor()
    judge.step(HOME, STILL, CENTRE, REST, np.pi - 1e-4)
    assert faults_of(judge.step(HOME, STILL, CENTRE, REST, -np.pi + 1e-4)) == ()
    expected = (Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,)
    assert faults_of(judge.step(HOME, STILL, CENTRE, REST, -np.pi + 4e-3)) == expected


def test_a_reset_forgets_velocities_so_that_a_moving_arm_is_no_jump():
    judge = monitor()
    judge.step(HOME, STILL, CENTRE, REST, 0.0)
    judge.reset(HOME)
    assert faults_of(judge.step(HOME, [2.0] * 7, CENTRE, [0.9, 0.0, 0.0, 0.0, 0.0, 0.0], 2.0)) == ()
    assert judge.acceleration == [0.0] * 7


def test_what_is_not_a_number_breaks_conditions():
    faults = faults_of(monitor().step([float("nan")] * 7, STILL, CENTRE, None, None))
    assert faults == (Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION,)
