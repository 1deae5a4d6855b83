"""What an error says of a fault: which joint or what of the tool, its value and bound, and what really helps."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import ControlError
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.sim.api import NetworkFaults

MODEL = load_model("xMatePro7")
PLANNED = "check that the planned motion"


def fault_of(robot, callback, mode="joint_position") -> str:
    with pytest.raises(ControlError) as caught:
        robot.control(callback, mode)
    return str(caught.value)


def stand(robot, seconds=3.0):
    q = robot.state.q_c
    return lambda state, t: JointPosition(q, finished=t >= seconds)


def stand_while(robot, act, at=0.2):
    """Holds still, and has something happen after a while."""
    q, done = robot.state.q_c, []

    def callback(state, t):
        if t >= at and not done:
            done.append(act())
        return JointPosition(q, finished=t >= 3.0)

    return callback


@pytest.fixture(params=["ideal", "mujoco"])
def robot(request):
    with simulate(MODEL, plant=request.param) as robot:
        robot.power_on()
        yield robot


@pytest.mark.parametrize("before", [1, 2, 3])
def test_a_leap_with_one_of_the_first_commands_has_its_joint_and_numbers(before):
    with simulate(MODEL) as robot:
        robot.power_on()
        q, count = robot.state.q_c, iter(range(10))
        said = fault_of(robot, lambda state, t: JointPosition(q + 0.05 * (next(count) >= before)))
        assert "joint 1: commanded velocity 50 rad/s passes 2.175 rad/s in the command at t = 0.00" in said
        T, count = robot.state.T_base_tool_c.matrix, iter(range(10))
        robot.recover()

        def plunge(state, t):
            moved = T.copy()
            moved[2, 3] -= 0.01 * (next(count) >= before)
            return CartesianPosition(moved)

        said = fault_of(robot, plunge, "cartesian_position")
        assert "tool: commanded translational velocity 10 m/s passes 1 m/s in the command at t = 0.00" in said
        robot.recover()
        count = iter(range(10))
        said = fault_of(robot, lambda state, t: JointTorque(np.full(7, 5.0 * (next(count) >= before))), "torque")
        assert "joint 1: commanded torque rate 5000 N m/s passes 1500 N m/s in the command at t = 0.00" in said


def test_a_collision_has_its_joint_its_torque_and_the_threshold_that_was_set(robot):
    robot.rci.set_collision_behavior([5.0] + [20.0] * 6)
    push = lambda: robot.world.push([0.0, 20.0, 0.0, 0.0, 0.0, 0.0], duration=1.0)  # noqa: E731
    said = fault_of(robot, stand_while(robot, push))
    assert "kCollision" in said
    assert "N m on joint 1 (its threshold is 5 N m)" in said


def test_a_push_on_an_arm_that_stands_is_not_blamed_on_the_plan():
    with simulate(MODEL, plant="mujoco") as robot:
        robot.power_on()
        push = lambda: robot.world.push([150.0, 0.0, 0.0, 0.0, 0.0, 0.0], duration=1.0, rise_time=0.0)  # noqa: E731
        said = fault_of(robot, stand_while(robot, push))
        assert "kActualJointAccelerationLimitsViolation" in said
        assert "joint 6: measured acceleration" in said
        assert "rad/s^2 passes -52.5 rad/s^2" in said
        assert "a push" in said
        assert PLANNED not in said


def test_a_push_under_joint_impedance_names_the_bound_that_was_judged(robot):
    robot.rci.set_joint_impedance([20.0] * 7)
    push = lambda: robot.world.push([0.0, 60.0, 0.0, 0.0, 0.0, 0.0], duration=1.0)  # noqa: E731
    said = fault_of(robot, stand_while(robot, push), "joint_impedance")
    assert "joint 5: measured velocity 2." in said
    assert "rad/s passes 2.871 rad/s" in said
    assert PLANNED not in said


def test_a_desired_wrench_that_throws_the_arm_is_named_and_not_the_plan(robot):
    robot.rci.set_cartesian_impedance([50.0] * 3 + [5.0] * 3)
    robot.rci.set_cart_imp_desired_tau([60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    T = robot.state.T_base_tool_c
    said = fault_of(robot, lambda state, t: CartesianPosition(T, finished=t > 3.0), "cartesian_impedance")
    assert "tool: measured rotational velocity 2.75" in said
    assert "set_cart_imp_desired_tau" in said
    assert PLANNED not in said


def test_commands_that_were_lost_are_counted_and_a_higher_threshold_is_not_all_the_advice(robot):
    """Some are lost at full speed, fewer than 20 in a row: what comes next cannot be reached smoothly."""
    rows = plan_joint(MODEL, robot.state.q_c, robot.state.q_c + [1.0, 0.8, -1.0, 0.5, 1.0, -1.0, 1.0], speed=1.0).q

    def swing(state, t):
        k = round(1000.0 * t)
        if k == 150:
            robot.world.set_network(NetworkFaults(loss=0.8, seed=2), "commands")
        return JointPosition(rows[min(k, len(rows) - 1)], finished=k >= len(rows))

    said = fault_of(robot, swing)
    assert "kInstabilityDetection" in said
    assert "% of the last second's commands did not arrive in time" in said
    assert "--prefill 50" in said


def test_a_joint_fault_under_poses_names_the_joint_and_does_not_blame_the_tool(robot):
    """7.7 m/s^2 downwards keeps every limit of the tool; joint 4 may have 10 rad/s^2."""
    T = robot.state.T_base_tool_c.matrix

    def drop(state, t):
        rise = min(7.7, 833.0 * t)
        moved = T.copy()
        moved[2, 3] -= 833.0 * t**3 / 6.0 if t < 7.7 / 833.0 else rise * t * t / 2.0 - 0.0003
        return CartesianPosition(moved)

    said = fault_of(robot, drop, "cartesian_position")
    assert "kCommandJointAcceleration" in said
    assert re.search(
        r"joint 4: commanded acceleration .* passes 10 .* in the joint angles that follow from the pose", said
    )
    assert "section 4.4" not in said
