"""A session with an RM65 is that with any arm: plan, check, execute, stop, error, recover, record, settings."""

from __future__ import annotations

import threading
import time
from math import radians

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.command import JointPosition
from rcilab.core.errors import (
    CommandRejectedError,
    ControlError,
    DeadlineError,
    InvalidValueError,
    ModelError,
    PlanningError,
    RcilabError,
    UsageError,
)
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, SoftJointLimits
from rcilab.makers.parameters import default_parameters
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.parameters import parameter_groups
from rcilab.motion import Program, Waypoint, plan_joint, plan_program
from rcilab.recording.run import load_run
from tests.makers.realman.driver.conftest import HOME
from tests.waiting import wait_for

OFF = np.array([0.3, 0.2, -0.2, 0.3, 0.2, 0.4])
ROUNDING = 1.001 * radians(0.0005)  # [rad] Half a unit of the wire.
CYCLES = 5  # Of 1 ms between two pushed states.


def test_a_checked_motion_arrives_and_each_target_is_that_of_its_state(robot, tmp_path):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.4)
    run = robot.execute(motion)
    assert (run.faults, run.stopped) == ((), None)
    assert np.abs(robot.state.q - motion.q[-1]).max() <= ROUNDING
    sent = run.cycles[np.isfinite(run.cycles["command"]).all(axis=1)]
    rows = np.round(1e3 * sent["t"]).astype(int)
    assert not (rows % CYCLES).any()
    assert np.array_equal(sent["command"], motion.q[np.minimum(rows, len(motion.q) - 1)])
    assert (sent["sent_ns"] >= sent["received_ns"]).all()
    run.save(tmp_path / "a.rcirun")
    assert len(load_run(tmp_path / "a.rcirun").cycles) == len(run.cycles)


def test_a_motion_begins_at_the_goal_of_the_one_before_though_states_are_rounded(robot):
    first = plan_joint(robot.model, robot.state.q_c, HOME + 0.0123456, speed=0.4)
    second = plan_joint(robot.model, first.goal, HOME - 0.0123456, speed=0.4)
    for motion in (first, second):
        robot.execute(motion, check(motion, robot.model).require().certificate)
        assert np.abs(robot.state.q - motion.goal).max() <= ROUNDING


def test_a_motion_is_stopped_on_request_and_the_next_one_begins_there(robot):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + 0.5, speed=0.2)
    run = robot.execute(motion, progress=lambda t, duration: robot.stop() if t > 0.1 else None)
    assert run.stopped == "on request"
    assert robot.state.robot_mode is RobotMode.IDLE
    assert np.abs(robot.state.q - motion.q[-1]).max() > 0.01
    assert robot.move_j(HOME, 0.1).faults == ()


def test_a_callback_begins_at_the_arm_and_there_is_one_mode(robot):
    start = robot.state.q_c
    goal = start + 0.05 * np.eye(6)[3]

    def glide(state, t):
        u = min(2.0 * t, 1.0)
        return JointPosition(start + u**3 * (10.0 - 15.0 * u + 6.0 * u * u) * (goal - start), finished=u == 1.0)

    robot.control(glide)
    assert np.abs(robot.state.q - goal).max() <= ROUNDING
    with pytest.raises(ModelError, match="has no torque mode"):
        robot.control(lambda state, t: JointPosition(state.q_c), "torque")


def test_the_error_of_a_refused_command_does_not_stop_the_next_motion(robot):
    with pytest.raises(CommandRejectedError):
        robot.realman.move_j([0.0, 30.0, 0.0, 60.0, 0.0, 90.0], 0.5)  # Degrees.
    robot.receive_states(3)
    assert robot.state.faults == (RealManError.TARGET_OVER_LIMIT,)
    run = robot.execute(plan_joint(robot.model, robot.state.q_c, HOME + 0.1 * OFF, speed=0.4))
    assert (run.faults, robot.state.faults) == ((), ())


def test_the_error_of_a_jump_after_a_pause_names_the_late_client(robot):
    start, slept = robot.state.q_c, []

    def pause(state, t):
        if t > 0.5 and not slept:
            slept.append(time.sleep(0.3))
        u = min(t, 1.0)
        return JointPosition(start + u**3 * (10.0 - 15.0 * u + 6.0 * u * u) * np.eye(6)[0], finished=u == 1.0)

    with pytest.raises(ControlError, match=r"0x4000 .* no command was sent for \d{3} ms: a callback took long"):
        robot.control(pause)
    robot.recover()


def test_an_error_ends_a_motion_with_its_name_and_recover_clears_it(robot):
    far = HOME + 3.0 * np.eye(6)[0]
    with pytest.raises(ControlError, match=r"0x4000 joint position step \(the commands of a joint jump\)") as caught:
        robot.control(lambda state, t: JointPosition(state.q_c if t < 0.1 else far))
    assert caught.value.faults == (RealManError.JOINT_POSITION_STEP,)
    assert robot.state.faults == caught.value.faults
    robot.recover()
    assert robot.state.faults == ()
    assert robot.move_j(HOME + 0.02, 0.1).faults == ()


def test_an_emergency_stop_ends_a_motion_and_must_be_released(robot):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.2)
    with pytest.raises(ControlError, match="the emergency stop is pressed") as caught:
        robot.execute(motion, progress=lambda t, duration: robot.simulation.press("estop") if t > 0.1 else None)
    assert caught.value.code == "safety_stop"
    with pytest.raises(DeadlineError, match="the emergency stop is pressed: release it"):
        robot.recover()
    robot.simulation.press("none")
    robot.recover()
    assert robot.state.robot_mode is RobotMode.IDLE


def test_motors_are_switched_over_the_interface(robot):
    robot.power_off()
    assert not robot.is_powered()
    with pytest.raises(CommandRejectedError, match=r"joints are disabled; power_on\(\) enables all joints"):
        robot.move_j(HOME + 0.1)
    with pytest.raises(CommandRejectedError, match=r"rm_movej was refused: an error is set; 0x1010 joint disabled"):
        robot.realman.move_j(HOME + 0.1)
    robot.recover()
    assert robot.is_powered()
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.2)
    with pytest.raises(ControlError, match="motor power was switched off during the motion"):
        robot.execute(motion, progress=lambda t, duration: robot.power_off() if t > 0.1 else None)


def test_motions_are_planned_by_the_controller(robot):
    commands = robot.realman
    commands.move_j(HOME + 0.1 * OFF, 1.0)
    assert np.abs(robot.state.q - HOME - 0.1 * OFF).max() <= ROUNDING
    start = robot.state.T_base_tool
    goal = start @ Pose([0.02, 0.0, 0.03])
    commands.move_l(goal, 0.2)
    assert robot.state.T_base_tool.is_close(goal, 1e-3)
    via, end = goal @ Pose([0.02, 0.02, 0.0]), goal @ Pose([0.0, 0.04, 0.0])
    commands.move_c(via, end, 0.2)
    assert np.abs(robot.state.T_base_tool.position - end.position).max() <= 5e-5
    commands.set_work_frame(Pose([0.1, 0.2, 0.3]))
    assert np.abs(robot.state.T_base_tool.position - end.position).max() <= 5e-5
    commands.move_p(start)
    assert robot.state.T_base_tool.is_close(start, 1e-3)
    commands.set_work_frame(Pose())
    with pytest.raises(InvalidValueError, match=r"speed.*is outside 0.0025 to 0.25.* \[m/s\]"):
        commands.move_l(start, 100.0)


def test_a_planned_motion_can_be_stopped_from_another_thread(robot):
    timer = threading.Timer(0.2, robot.realman.stop)
    timer.start()
    with pytest.raises(ControlError, match="the motion was stopped before its end"):
        robot.realman.move_j(HOME + 0.5, 0.2)
    timer.join()
    assert np.abs(robot.state.q - HOME).max() < 0.4
    robot.realman.move_j(HOME)


def test_a_planned_motion_is_watched_paused_and_stopped_from_another_thread(robot):
    errors, start = [], robot.state.q

    def move():
        try:
            robot.realman.move_j(HOME + 0.5, 0.3)
        except RcilabError as error:
            errors.append(error)

    mover = threading.Thread(target=move)
    mover.start()
    try:
        wait_for(lambda: robot.is_moving and np.abs(robot.state.q - start).max() > 0.02)
        robot.realman.pause()
        wait_for(lambda: not robot.state.dq.any())
        with pytest.raises(UsageError, match="while a motion is running"):
            robot.realman.move_j(HOME)
        assert np.abs(robot.state.q - HOME).max() < 0.4
    finally:
        robot.stop()
        mover.join(10.0)
    assert not mover.is_alive()
    assert [type(error) for error in errors] == [ControlError]


def test_a_planned_motion_that_ends_by_power_off_is_an_error(robot):
    timer = threading.Timer(0.3, robot.power_off)
    timer.start()
    with pytest.raises(ControlError, match="the motion was stopped before its end"):
        robot.realman.move_j(HOME + 0.5, 0.2)
    timer.join()


def test_motions_are_refused_while_the_controller_holds_a_paused_one(robot):
    robot.realman.move_j(HOME + 0.3, 0.3, wait=False)
    wait_for(lambda: np.abs(robot.state.q - HOME).max() > 0.01)
    robot.realman.pause()
    wait_for(lambda: not robot.state.dq.any())
    try:
        with pytest.raises(CommandRejectedError, match=r"is paused; robot\.realman\.resume\(\)"):
            robot.realman.move_j(HOME)
        stays = plan_joint(robot.model, robot.state.q_c, HOME, speed=0.4)
        with pytest.raises(CommandRejectedError, match="is paused"):
            robot.execute(stays)
    finally:
        robot.realman.stop()
    robot.realman.move_j(HOME)
    assert np.abs(robot.state.q - HOME).max() < 1e-4


def test_tool_and_load_are_a_frame_of_the_controller(robot):
    tool = Pose([0.0, 0.02, 0.1])
    robot.set_tool(tool)
    robot.set_load(0.5, [0.0, 0.0, 0.04])
    name, pose, load = robot.realman.tool
    assert name == "rcilab"
    assert (load.mass, load.center_of_mass[2]) == pytest.approx((0.5, 0.04))
    assert pose.is_close(tool, 1e-6)
    assert robot.model.T_flange_tool.is_close(tool)
    assert robot.state.T_base_tool.is_close(robot.model.forward(robot.state.q), 1e-5)


def test_ranges_of_joints_are_set_while_they_are_disabled_and_plans_keep_them(robot):
    own = robot.model.limits.joint
    lower, upper = own.lower.copy(), own.upper.copy()
    lower[0], upper[0] = -0.5, 0.5
    robot.configure(RobotConfiguration(joints=SoftJointLimits(lower=tuple(lower), upper=tuple(upper))))
    assert robot.is_powered()
    assert robot.realman.api.rm_get_joint_max_pos()[1][0] == pytest.approx(np.degrees(0.5), abs=1e-3)
    with pytest.raises(PlanningError, match=r"28\.65° is the soft limit that was set"):
        plan_joint(robot.model, robot.state.q_c, HOME + 0.6 * np.eye(6)[0])
    robot.realman.set_joint_ranges(own.lower, own.upper)
    assert robot.realman.api.rm_get_joint_max_pos()[1][0] == pytest.approx(178.0)


def test_speeds_and_accelerations_in_force_are_those_of_the_model_and_its_checks(robot):
    arm = robot.model
    fast = plan_joint(arm, robot.state.q_c, HOME + 0.5, speed=0.4)
    slower = np.full(6, 0.15)
    control = ControllerParameters(
        joint_velocity=tuple(slower),
        joint_acceleration=(5.0,) * 6,
        tool_limits=(0.2, 1.0, 0.5, 3.0),
        collision_stage=(3.0,),
    )
    robot.configure(RobotConfiguration(control=control))
    joint, tool = robot.model.limits.joint, robot.model.limits.cartesian
    np.testing.assert_allclose(joint.velocity, slower, rtol=1e-3)
    np.testing.assert_allclose(joint.acceleration, 5.0, rtol=1e-3)
    assert (tool.translation_velocity, tool.rotation_acceleration) == pytest.approx((0.2, 3.0))
    assert robot.realman.api.rm_get_collision_stage() == (0, 3)
    robot.realman.move_j(HOME, 0.15)  # As it was given: the interface has rounded it.
    with pytest.raises(RcilabError, match="velocity"):
        robot.execute(fast)
    with pytest.raises(InvalidValueError, match="whole number from 0 to 8"):
        robot.configure(RobotConfiguration(control=ControllerParameters(collision_stage=(2.5,))))
    with pytest.raises(InvalidValueError, match="known: joint_velocity"):
        robot.configure(RobotConfiguration(control=ControllerParameters(filters=(1.0,))))
    robot.configure(RobotConfiguration(control=default_parameters(parameter_groups(arm))))
    assert np.array_equal(robot.model.limits.joint.velocity, arm.limits.joint.velocity)
    assert robot.execute(fast).faults == ()


def test_signals_of_the_controller(robot):
    robot.simulation.set_input(2, True)
    assert [robot.read_input(k) for k in (1, 2)] == [False, True]
    robot.simulation.set_input(2, False)
    robot.set_output(3, True)
    assert robot.realman.api.rm_get_io_output()[1][3] == 1
    robot.set_output(3, False)


def test_a_program_sets_and_awaits_signals(robot):
    step, back = Waypoint.joint(HOME + 0.05, speed=0.3), Waypoint.joint(HOME, speed=0.3)
    steps = (step, Waypoint.set_output(1), Waypoint.await_input(2, timeout=60.0), back, Waypoint.set_output(1, False))
    motion = plan_program(robot.model, Program(model=robot.model.name, start=robot.state.q_c, waypoints=steps))
    robot.simulation.set_input(2, False)
    released = threading.Timer(1.5, robot.simulation.set_input, (2, True))
    released.start()
    run = robot.execute(motion)
    released.join()
    assert np.allclose(run.q_c[-1], motion.goal, atol=1e-3)
    assert run.plan is not None
    assert run.plan.duration > motion.duration
    short = plan_program(
        robot.model,
        Program(model=robot.model.name, start=robot.state.q_c, waypoints=(step, Waypoint.await_input(3, timeout=0.1))),
    )
    with pytest.raises(DeadlineError, match=r"step 2: input .* was not on within 0\.1 s"):
        robot.execute(short)
