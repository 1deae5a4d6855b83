"""A motion that did not arrive says so, whatever it was sent as: an arm angle counts, and so do torques."""

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import ControlError, InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint, plan_nullspace, plan_recovery
from rcilab.sim.api import NetworkFaults

MODEL = load_model("xMatePro7")


def test_an_arm_angle_that_a_filter_holds_back_is_waited_for_or_reported():
    with simulate(MODEL) as robot:
        robot.power_on()
        robot.rci.set_filters(0.5, 0.5, 0.5)
        robot.execute(plan_nullspace(MODEL, robot.state.q_c, 0.5), mode="cartesian_position")
        assert robot.state.psi_c == pytest.approx(0.5, abs=1e-5)
        robot.move_l(robot.state.T_base_tool_c, psi=0.2)
        assert robot.state.psi_c == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize("mode", ["cartesian_position", "torque"])
def test_commands_that_were_all_lost_are_no_success(mode):
    with simulate(MODEL, lockstep=False) as robot:
        robot.power_on()
        motion = plan_nullspace(MODEL, MODEL.home, 0.3)
        if mode == "torque":
            motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1, law="torque_rate_limited")
        robot.world.set_network(NetworkFaults(loss=1.0), "commands")
        with pytest.raises(ControlError, match=r"did not reach its end.*executed none of the commands"):
            robot.execute(motion, mode=mode)
        assert np.array_equal(robot.state.q_c, MODEL.home) or mode == "torque"


def test_soft_limits_of_the_model_reach_the_controller_and_can_be_widened():
    joint = MODEL.limits.joint
    upper = joint.upper.copy()
    upper[0] = 0.3
    with simulate(MODEL.with_joint_limits(joint.lower, upper)) as robot:
        robot.power_on()
        with pytest.raises(ControlError, match=r"kCommandJointPosition.*switch the power off and on") as caught:
            robot.control(lambda state, t: JointPosition(state.q_c + 2e-4 * np.eye(7)[0] * min(t / 0.2, 1.0)))
        assert "recover()" not in str(caught.value)
        robot.power_off()
        robot.power_on()
        robot.execute(plan_recovery(robot.model, robot.state.q_c))
        robot.rci.set_joint_limit(joint.lower - 1e-10, joint.upper + 1e-10)
        robot.move_j(robot.state.q_c + 0.4 * np.eye(7)[0])


@pytest.mark.parametrize("axis", [3, 4, 5])
def test_a_desired_moment_builds_up_and_throws_nothing(axis):
    wrench = np.zeros(6)
    wrench[axis] = 5.0
    with simulate(MODEL, plant="mujoco") as robot:
        robot.power_on()
        robot.rci.set_cart_imp_desired_tau(wrench)
        T = robot.state.T_base_tool_c
        run = robot.control(lambda state, t: CartesianPosition(T, finished=t >= 0.4), "cartesian_impedance")
        assert run.faults == ()


def test_a_matrix_that_is_no_rotation_is_refused_before_it_is_sent():
    with simulate(MODEL) as robot:
        robot.power_on()
        T = robot.state.T_base_tool_c.matrix
        T[0, 0] *= 1.1
        with pytest.raises(InvalidValueError, match="is not a rotation"):
            robot.control(lambda state, t: CartesianPosition(T), "cartesian_position")


@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position"])
def test_a_tool_that_passes_a_face_of_its_box_is_told_which_and_how_far(mode):
    with simulate(MODEL) as robot:
        robot.power_on()
        T = robot.state.T_base_tool_c
        robot.rci.set_cartesian_limit(SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose(T.position), active=True))

        def callback(state, t):
            share = min(t / 0.5, 1.0)
            smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            if mode == "joint_position":
                return JointPosition(MODEL.home + 0.15 * smooth * np.eye(7)[0])
            return CartesianPosition(Pose([0.0, 0.08 * smooth, 0.0]) @ T)

        with pytest.raises(ControlError, match=r"past the \+y face of the safety box"):
            robot.control(callback, mode)


def test_a_tool_that_began_beyond_one_face_is_told_the_other_face_that_it_passed():
    with simulate(MODEL) as robot:
        robot.power_on()
        T = robot.state.T_base_tool_c
        below = Pose(T.position - [0.0, 0.0, 0.15])
        robot.set_safety_box(SafetyBox(size=(0.2, 0.2, 0.2), T_base_box=below))

        def callback(state, t):
            share = min(t, 1.0)
            smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            return CartesianPosition(Pose([0.0, 0.12 * smooth, 0.0]) @ T)

        with pytest.raises(ControlError, match=r"past the \+y face of the safety box") as caught:
            robot.control(callback, "cartesian_position")
        assert "+z face" not in str(caught.value)


def test_limits_that_another_session_has_narrowed_are_guessed_from_the_fault():
    joint = MODEL.limits.joint
    upper = joint.upper.copy()
    upper[0] = 0.2
    with simulate(MODEL) as robot:
        robot.power_on()
        robot.rci.set_joint_limit(joint.lower, upper)
        robot._arm.model = MODEL  # As a session that does not know of it.
        with pytest.raises(ControlError, match="the controller has narrower ones"):
            robot.move_j(MODEL.home + 0.5 * np.eye(7)[0])


@pytest.mark.parametrize("is_free", [False, True], ids=["lock-step", "free"])
@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position", "torque"])
def test_commands_that_were_all_lost_are_no_success_where_the_motion_ends_at_its_start(mode, is_free):
    def out_and_back(state, t):
        s = 0.5 - 0.5 * np.cos(np.pi * min(t / 0.4, 2.0))
        if mode == "torque":
            return JointTorque(3.0 * s * np.eye(7)[0], finished=t >= 0.8)
        q = MODEL.home + 0.02 * s**3 * np.eye(7)[0]
        if mode == "joint_position":
            return JointPosition(q, finished=t >= 0.8)
        return CartesianPosition(MODEL.forward(q), MODEL.arm_angle(q), finished=t >= 0.8)

    with simulate(MODEL, lockstep=not is_free) as robot:
        robot.power_on()
        robot.world.set_network(NetworkFaults(loss=1.0), "commands")
        with pytest.raises(ControlError, match="executed none of the commands"):
            robot.control(out_and_back, mode)
        robot.world.set_network(NetworkFaults(), "commands")
        if mode != "torque":
            robot.control(out_and_back, mode)
            assert np.abs(robot.state.q_c - MODEL.home).max() < 1e-6


def test_a_short_motion_back_to_its_start_is_executed_before_it_ends():
    def bump(state, t):
        s = np.sin(np.pi * min(t / 0.008, 1.0)) ** 4
        return JointPosition(MODEL.home + 4e-6 * s * np.eye(7)[0], finished=t >= 0.008)

    with simulate(MODEL, lockstep=False) as robot:  # With the delay of its jitter buffer.
        robot.power_on()
        for _ in range(3):
            run = robot.control(bump)
            assert np.abs(run.cycles["q_c"][:, 0] - MODEL.home[0]).max() > 2e-6
