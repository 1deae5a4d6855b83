import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.limit_violation import faults_of
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_CONDITIONS, RCI_TOOL_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits
VELOCITY = Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION
ACCELERATION = Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION
ELBOW = Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION
BOX = Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION


def about(axis: np.ndarray, angle: float, position: tuple[float, float, float] = (0.4, 0.0, 0.6)) -> Pose:
    half = 0.5 * angle
    return Pose(position, [math.cos(half), *(math.sin(half) * axis / np.linalg.norm(axis))])


def play(monitor: CartesianMonitor, poses: list[Pose]) -> list[tuple[Fault, ...]]:
    return [faults_of(monitor.step(pose)) for pose in poses]


@settings(max_examples=30)
@given(st.integers(0, 2**32))
def test_twist_and_acceleration_are_those_of_the_jacobian_along_a_joint_motion(seed):
    rng = np.random.default_rng(seed)
    goal = MODEL.home + rng.uniform(-0.4, 0.4, 7)
    motion = plan_joint(MODEL, MODEL.home, goal, speed=0.5, law="s_profile")
    row = int(rng.integers(5, len(motion) - 5))
    breaks = motion.polynomial.breaks / CYCLE_TIME
    assume(not ((row - 2.0 < breaks) & (breaks < row)).any())  # There the rule for the mean is less exact.
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(MODEL.forward(motion.q[row - 4]))
    play(monitor, [MODEL.forward(q) for q in motion.q[row - 3 : row + 1]])
    twists = [_mean_twist(motion, row - lag) for lag in (0.5, 1.5)]  # Of the cycle, which a backward difference is.
    assert monitor.twist == pytest.approx(twists[0], abs=1e-6)
    assert monitor.acceleration == pytest.approx((twists[0] - twists[1]) / CYCLE_TIME, abs=1e-5)


def _mean_twist(motion: Motion, middle: float) -> np.ndarray:
    """Returns the mean over one cycle, by Gauss's rule of two points, from the jacobian, shape (6,)."""
    samples = (motion.at((middle + side * 0.5 / math.sqrt(3.0)) * CYCLE_TIME) for side in (-1.0, 1.0))
    return np.mean([MODEL.jacobian(sample.q) @ sample.dq for sample in samples], axis=0)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.3, -0.5, 0.8)])
@pytest.mark.parametrize(("speed", "expected"), [(2.499, False), (2.501, True)])
def test_rotation_is_judged_by_the_length_of_its_vector_whatever_the_axis(axis, speed, expected):
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(about(np.array(axis), 0.0))
    faults = play(monitor, [about(np.array(axis), speed * CYCLE_TIME * k) for k in range(1, 8)])
    assert (VELOCITY in faults[-1]) is expected
    assert np.linalg.norm(monitor.twist[3:]) == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize(("speed", "expected"), [(0.999, False), (1.001, True)])
def test_translation_is_judged_by_its_norm(speed, expected):
    direction = np.array([2.0, -1.0, 2.0]) / 3.0
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose())
    faults = play(monitor, [Pose(speed * CYCLE_TIME * k * direction) for k in range(1, 8)])
    assert (VELOCITY in faults[-1]) is expected


@pytest.mark.parametrize(("acceleration", "expected"), [(9.99, False), (10.01, True)])
def test_acceleration_is_judged_when_it_is_steady(acceleration, expected):
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose())
    faults = play(monitor, [Pose((0.5 * acceleration * (CYCLE_TIME * k) ** 2, 0.0, 0.0)) for k in range(1, 40)])
    assert (ACCELERATION in faults[-1]) is expected


def test_a_jerk_raises_the_acceleration_bit_because_there_is_none_of_its_own():
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose())
    assert faults_of(monitor.step(Pose((6e-6, 0.0, 0.0)))) == (ACCELERATION,)
    assert [violation.condition.id for violation in monitor.violations()] == ["cartesian.jerk.translation"]
    assert monitor.violations()[0].text == "tool: commanded translational jerk 6000 m/s^3 passes 5000 m/s^3"


def test_a_jump_raises_what_it_breaks_once_each_in_wire_order():
    box = SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose())
    monitor = CartesianMonitor(LIMITS, box, RCI_TOOL_CONDITIONS)
    monitor.reset(Pose(), 0.0)
    assert faults_of(monitor.step(Pose((2.0, 0.0, 0.0)), 4.0)) == (BOX, ELBOW, VELOCITY, ACCELERATION)
    assert monitor.violations()[0].text == "tool: commanded position is 1.5 m outside the safety box"
    assert "elbow: commanded arm angle 4 rad passes 3.14159 rad" in [
        violation.text for violation in monitor.violations()
    ]


def test_an_arm_angle_may_pass_pi_the_short_way_and_stand_there():
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose(), math.pi - 1e-9)
    assert faults_of(monitor.step(Pose(), math.pi)) == ()
    assert faults_of(monitor.step(Pose(), -math.pi)) == ()


@pytest.mark.parametrize(("jerk", "expected"), [(4900.0, ()), (5100.0, (ELBOW,))])
def test_an_arm_angles_jerk_is_bounded(jerk, expected):
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose(), 0.5)
    assert faults_of(monitor.step(Pose(), 0.5 + jerk * CYCLE_TIME**3)) == expected


def test_an_arm_angle_that_is_not_commanded_is_not_judged():
    monitor = CartesianMonitor(load_model("xMate7").limits, rows=RCI_TOOL_CONDITIONS)
    monitor.reset(Pose(), 0.5)
    assert faults_of(monitor.step(Pose(), None)) == ()
    assert faults_of(monitor.step(Pose(), 2.5)) == ()
    assert monitor.arm_angle == (2.5, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_not_a_number_breaks_conditions(value):
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    assert VELOCITY in faults_of(monitor.step(Pose.from_parts((1, 0, 0, 0, 1, 0, 0, 0, 1), (value, 0.0, 0.0))))
    monitor.reset(Pose(), 0.0)
    assert ELBOW in faults_of(monitor.step(Pose(), value))


def test_the_wall_itself_is_inside_and_a_box_that_is_not_active_bounds_nothing():
    T_base_box = Pose.from_rpy((0.3, 0.2, 0.5), (0.4, 0.5, 0.6))
    wall = (T_base_box @ Pose((0.5, 0.1, -0.2))).position
    for active in (True, False):
        monitor = BoxMonitor(SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=T_base_box, active=active), RCI_CONDITIONS.box)
        assert monitor.is_active is active
        assert faults_of(monitor.step(wall.tolist())) == ()
        out = (T_base_box @ Pose((0.501, 0.1, -0.2))).position.tolist()
        assert faults_of(monitor.step(out)) == ((BOX,) if active else ())
        assert [violation.value for violation in monitor.violations()] == pytest.approx([0.001] if active else [])
    assert not BoxMonitor(None).is_active
