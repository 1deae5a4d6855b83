"""A session with an xArm7 is that with any arm: plan, check, execute, stop, error, recover, record."""

from __future__ import annotations

import os
import threading
from contextlib import nullcontext

import numpy as np
import pytest

from rcilab.core.clock import CYCLE_TIME
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
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode
from rcilab.execution.connect import connect
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, SoftJointLimits
from rcilab.makers.parameters import default_parameters
from rcilab.makers.ufactory.driver.connection import Shown
from rcilab.makers.ufactory.driver.settings import XArmSettings
from rcilab.makers.ufactory.driver.state_reader import MOVING, READY
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.parameters import parameter_groups
from rcilab.motion import Program, Waypoint, plan_joint, plan_program
from rcilab.recording.run import load_run
from tests.makers.ufactory.driver.conftest import HOME
from tests.waiting import wait_for

FAR = np.array([0.0, 0.6, 0.0, 1.8, 0.0, 1.2, 0.0])  # From the axis of joint 1.
OFF = np.array([0.3, 0.2, -0.2, 0.3, 0.2, 0.1, 0.4])
ROUNDING = 3e-7  # [rad] Half a unit in the last place of single precision, in which the arm reports its angles.
CYCLES = 5  # Of 1 ms between two reports in real time.


def test_a_checked_motion_arrives_and_each_target_is_that_of_its_report(robot, tmp_path):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.4)
    run = robot.execute(motion)
    assert (run.faults, run.stopped) == ((), None)
    assert np.abs(robot.state.q_c - motion.q[-1]).max() <= ROUNDING
    sent = run.cycles[np.isfinite(run.cycles["command"]).all(axis=1)]
    rows = np.round(1e3 * sent["t"]).astype(int)
    assert not (rows % CYCLES).any()
    assert np.array_equal(sent["command"], motion.q[np.minimum(rows, len(motion.q) - 1)])
    assert (sent["sent_ns"] >= sent["received_ns"]).all()
    run.save(tmp_path / "a.rcirun")
    assert len(load_run(tmp_path / "a.rcirun").cycles) == len(run.cycles)


def test_the_fastest_plan_of_a_stretched_arm_stays_below_c60(robot):
    """A busy machine delays targets by more than any plan can allow for; then it is tried again."""
    for _ in range(6):
        robot.recover()
        robot.xarm.move_j(FAR, 3.0, 20.0)
        motion = plan_joint(robot.model, robot.state.q_c, FAR + 1.5 * np.eye(7)[0], speed=1.0)
        speeds = np.linalg.norm(np.diff(robot.model.position_path(motion.q), axis=0), axis=1) / CYCLE_TIME
        assert speeds.max() > robot.model.limits.cartesian.translation_velocity
        try:
            run = robot.execute(motion)
        except ControlError:
            continue
        assert (run.faults, run.stopped) == ((), None)
        return
    pytest.fail("the motion was stopped in each of six runs")


def test_a_motion_is_stopped_on_request_and_the_next_one_begins_there(robot):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + 0.5, speed=0.2)
    run = robot.execute(motion, progress=lambda t, duration: robot.stop() if t > 0.1 else None)
    assert run.stopped == "on request"
    assert robot.state.robot_mode is RobotMode.IDLE
    assert np.abs(robot.state.q_c - motion.q[-1]).max() > 0.01
    assert robot.move_j(HOME, 0.1).faults == ()


def test_a_callback_begins_at_the_arm_and_its_last_command_is_reached(robot):
    goal = HOME + 0.05 * np.eye(7)[3]

    def glide(state, t):
        u = min(2.0 * t, 1.0)
        return JointPosition(HOME + u**3 * (10.0 - 15.0 * u + 6.0 * u * u) * (goal - HOME), finished=u == 1.0)

    robot.control(glide)
    assert np.abs(robot.state.q_c - goal).max() <= 1e-6
    with pytest.raises(InvalidValueError, match=r"first command.*must be the present position"):
        robot.control(lambda state, t: JointPosition(HOME + 0.01))
    assert robot.state.robot_mode is RobotMode.IDLE
    with pytest.raises(ModelError, match="has no torque mode"):
        robot.control(lambda state, t: JointPosition(state.q_c), "torque")


def test_the_library_receives_answers_with_the_scheduling_of_the_loop(robot):
    readers = [thread for thread in threading.enumerate() if getattr(thread, "port_type", "") == "main-socket"]
    assert readers
    ordinary, seen = os.sched_getscheduler(0), []

    def stay(state, t):
        seen.append({os.sched_getscheduler(ident) for ident in (0, *(reader.native_id for reader in readers))})
        return JointPosition(HOME, finished=len(seen) == 10)

    robot.control(stay)
    assert all(len(policies) == 1 for policies in seen)
    assert {os.sched_getscheduler(reader.native_id) for reader in readers} == {ordinary}


def test_an_error_ends_a_motion_with_its_name_and_recover_clears_it(robot):
    """Beyond the range of joint 4; the library refuses angles outside the ranges of its own tables, far from here."""
    far = HOME + 10.0 * np.eye(7)[3]
    with pytest.raises(CommandRejectedError, match="a joint angle is outside its range"):
        robot.control(lambda state, t: JointPosition(HOME if t < 0.1 else far))
    robot.recover()
    robot.xarm.move_j(HOME)
    fast = HOME + 1.5 * np.eye(7)[1]
    with pytest.raises(ControlError, match=r"stopped the motion at t = .*C\d+ \(.*recover\(\) clears") as caught:
        robot.control(lambda state, t: JointPosition(HOME if t < 0.1 else fast))
    assert isinstance(caught.value.faults[0], UfactoryError)
    assert robot.state.faults == caught.value.faults
    with pytest.raises(CommandRejectedError, match="an error is set; C"):
        robot.move_j(HOME + 0.1)
    robot.recover()
    assert robot.state.faults == ()
    robot.xarm.move_j(HOME)


def test_an_emergency_stop_ends_a_motion_and_must_be_released(robot):
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.2)
    with pytest.raises(ControlError, match="the emergency stop is pressed") as caught:
        robot.execute(motion, progress=lambda t, duration: robot.simulation.press("estop") if t > 0.1 else None)
    assert caught.value.code == "safety_stop"
    assert robot.state.robot_mode is RobotMode.USER_STOPPED
    with pytest.raises(DeadlineError, match=r"C1: .* did not clear: remove its cause first"):
        robot.recover()
    robot.simulation.press("none")
    robot.recover()
    assert robot.state.robot_mode is RobotMode.IDLE


def test_motors_are_switched_over_the_interface(robot):
    robot.power_off()
    assert not robot.is_powered()
    with pytest.raises(CommandRejectedError, match=r"the motors are off; switch them on: power_on\(\)"):
        robot.move_j(HOME + 0.1)
    robot.power_on()
    assert robot.is_powered()
    motion = plan_joint(robot.model, robot.state.q_c, HOME + OFF, speed=0.2)
    with pytest.raises(ControlError, match="motor power was switched off during the motion"):
        robot.execute(motion, progress=lambda t, duration: robot.power_off() if t > 0.1 else None)


def test_closing_a_session_stops_its_motion(robot):
    with connect(robot.address) as other:
        motion = plan_joint(other.model, other.state.q_c, HOME + OFF, speed=0.2)
        run = other.execute(motion, progress=lambda t, duration: other.close() if t > 0.1 else None)
    assert run.stopped == "the session was closed while a motion ran"
    assert np.abs(robot.state.dq).max() == 0.0


def test_motions_are_planned_by_the_controller(robot):
    commands = robot.xarm
    commands.move_j(HOME + 0.1 * OFF)
    assert np.abs(robot.state.q_c - HOME - 0.1 * OFF).max() <= ROUNDING
    start = robot.state.T_base_tool_c
    goal = start @ Pose([0.02, 0.0, 0.03])
    commands.move_l(goal, 0.3)
    assert robot.state.T_base_tool_c.is_close(goal, 1e-6)
    via, end = goal @ Pose([0.02, 0.02, 0.0]), goal @ Pose([0.0, 0.04, 0.0])
    commands.move_c(via, end, 0.3)
    assert np.abs(robot.state.T_base_tool_c.position - end.position).max() <= 1e-5
    commands.set_user_frame(Pose([0.1, 0.2, 0.3]))
    commands.move_l(start, 0.3)
    assert robot.state.T_base_tool_c.is_close(start, 1e-5)
    commands.set_user_frame(Pose())
    with pytest.raises(InvalidValueError, match=r"speed.*is outside 0 to 1 \[m/s\]"):
        commands.move_l(start, 100.0)


def test_reports_from_before_a_motion_do_not_end_it():
    ready, moving = Shown(READY, 0, 0), Shown(MOVING, 0, 1)

    class Link:
        client, n, shown = None, 7, ready
        unread = [ready] * 10  # Of an arm at rest, before the command.
        later = [moving] * 3 + [ready] * 5

        def on_states(self, states):
            pass

        def poll(self, timeout):
            found, self.unread = self.unread, []
            if not found and timeout:
                found = [self.later.pop(0)]
            self.shown = found[-1] if found else self.shown
            return found

    link = Link()
    XArmSettings(link, "xArm7").wait()  # type: ignore[arg-type]
    assert not link.later


def test_a_planned_motion_can_be_stopped_from_another_thread(robot):
    timer = threading.Timer(0.2, robot.xarm.stop)
    timer.start()
    with pytest.raises(ControlError, match="the motion was stopped before its end"):
        robot.xarm.move_j(HOME + 0.5, 0.4)
    timer.join()
    assert np.abs(robot.state.q_c - HOME).max() < 0.4
    assert robot.move_j(HOME, speed=0.4).faults == ()


def test_a_planned_motion_is_watched_paused_and_stopped_from_another_thread(robot):
    errors, start = [], robot.state.q

    def move():
        try:
            robot.xarm.move_j(HOME + 0.5, 0.3)
        except RcilabError as error:
            errors.append(error)

    mover = threading.Thread(target=move)
    mover.start()
    try:
        wait_for(lambda: robot.is_moving and np.abs(robot.state.q - start).max() > 0.02)
        robot.xarm.pause()
        wait_for(lambda: not robot.state.dq.any())
        with pytest.raises(UsageError, match="while a motion is running"):
            robot.xarm.move_j(HOME)
        assert np.abs(robot.state.q - HOME).max() < 0.4
    finally:
        robot.stop()
        mover.join(10.0)
    assert not mover.is_alive()
    assert [type(error) for error in errors] == [ControlError]


def test_motions_are_refused_while_the_controller_holds_a_paused_one(robot):
    robot.xarm.move_j(HOME + 0.3, 0.3, wait=False)
    wait_for(lambda: np.abs(robot.state.q - HOME).max() > 0.01)
    robot.xarm.pause()
    wait_for(lambda: not robot.state.dq.any())
    try:
        with pytest.raises(CommandRejectedError, match=r"is paused; robot\.xarm\.resume\(\)"):
            robot.xarm.move_j(HOME)
        stays = plan_joint(robot.model, robot.state.q_c, HOME, speed=0.4)
        with pytest.raises(CommandRejectedError, match="is paused"):
            robot.execute(stays)
    finally:
        robot.xarm.stop()
    robot.xarm.move_j(HOME)
    assert np.abs(robot.state.q - HOME).max() < 1e-4


def test_tool_and_load_are_sent_and_another_session_reads_them(robot):
    tool = Pose([0.0, 0.02, 0.1])
    robot.set_tool(tool)
    robot.set_load(0.5, [0.0, 0.0, 0.04], np.zeros((3, 3)))
    assert robot.state.T_base_tool_c.is_close(robot.model.forward(robot.state.q_c), 1e-6)
    with connect(robot.address) as other:
        assert other.model.T_flange_tool.is_close(tool, 1e-6)
        assert (other.model.load.mass, other.model.load.center_of_mass[2]) == pytest.approx((0.5, 0.04))


def test_the_arm_is_guided_in_mode_2(robot):
    driver = robot._driver
    driver.start_guiding("joint", "free")
    assert robot.receive_state().robot_mode is RobotMode.GUIDING
    driver.stop_guiding()
    assert robot.receive_state().robot_mode is RobotMode.IDLE
    with pytest.raises(ModelError, match="blocks no direction"):
        driver.start_guiding("cartesian", "translation")


def test_the_library_commands_the_other_modes(robot):
    commands = robot.xarm
    with pytest.raises(InvalidValueError, match="mode: 3 does not exist; there are 0, 1, 2, 4"):
        commands.set_mode(3)
    commands.set_mode(4)
    goal = HOME[0] + 0.05
    commands.api.vc_set_joint_velocity([0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    while robot.receive_state().q[0] < goal:
        pass
    commands.stop()
    commands.set_mode(0)
    while np.abs(robot.receive_state().dq).max() > 0.0:
        pass
    assert goal <= robot.state.q[0] < goal + 0.1


def test_signals_of_the_control_box(robot):
    robot.simulation.set_input(2, True)
    assert [robot.read_input(k) for k in (1, 2)] == [False, True]
    robot.simulation.set_input(2, False)
    robot.set_output(3, True)
    robot.set_output(3, False)


def test_the_safety_box_is_the_boundary_of_the_tool_in_whole_millimetres(robot):
    middle = robot.model.forward(HOME).position
    box = SafetyBox(size=(0.4, 0.5, 0.3005), T_base_box=Pose(middle.round(3)))
    robot.configure(RobotConfiguration(box=box))
    api = robot.xarm.api
    x, y, z = (1e3 * middle.round(3)).round()
    expected = [x + 200, x - 200, y + 250, y - 250, z + 150, z - 150]
    assert api.reduced_tcp_boundary == expected
    assert api.is_fence_mode
    motion = plan_joint(robot.model, robot.state.q_c, HOME + 1.2 * np.eye(7)[0], speed=0.3)
    with pytest.raises(RcilabError, match="box"):
        robot.execute(motion)
    turned = SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose.from_rpy((0.0, 0.0, 0.5), (0.0, 0.0, 0.1)))
    for send in (robot.xarm.set_boundary, robot.set_safety_box):
        with pytest.raises(InvalidValueError, match=r"must be 0 deg.*got \[0\.0, 0\.0, 5\.73\]"):
            send(turned)
    robot.xarm.set_boundary(SafetyBox(size=(3.0, 3.0, 3.0), T_base_box=Pose(), active=False))
    assert robot.execute(motion).faults == ()


def test_an_arm_that_left_its_boundary_moves_back_right_after_recover(robot):
    start = robot.model.forward(HOME)
    middle = tuple(start.position.round(3).tolist())
    robot.set_safety_box(SafetyBox(size=(2.0, 0.3, 2.0), T_base_box=Pose(middle)))
    try:
        for waits in (True, False):
            with pytest.raises(ControlError) if waits else nullcontext():
                robot.xarm.move_l(Pose(start.position + (0.0, 0.25, 0.0), start.wxyz), 0.3, wait=waits)
            wait_for(lambda: robot.state.faults == (UfactoryError.SAFETY_BOUNDARY,))
            robot.recover()
            assert robot.safety_box.excess(robot.state.T_base_tool_c.position) > 0.0
            assert robot.move_j(HOME, speed=0.4).faults == ()
    finally:
        robot.set_safety_box(SafetyBox(size=(3.0, 3.0, 3.0), T_base_box=Pose(), active=False))


def test_soft_limits_are_the_ranges_of_reduced_mode(robot):
    own = robot.model.limits.joint
    lower, upper = own.lower.copy(), own.upper.copy()
    lower[0], upper[0] = -0.5, 0.5
    robot.configure(RobotConfiguration(joints=SoftJointLimits(lower=tuple(lower), upper=tuple(upper))))
    api = robot.xarm.api
    assert api.is_reduced_mode
    assert api.reduced_joint_limits[0] == pytest.approx([-0.5, 0.5])
    with pytest.raises(PlanningError, match=r"28\.65° is the soft limit that was set"):
        plan_joint(robot.model, robot.state.q_c, HOME + 0.6 * np.eye(7)[0])
    robot.xarm.set_joint_ranges(own.lower, own.upper)
    assert not api.is_reduced_mode


def test_parameters_are_sensitivities_and_limits_of_planned_motions(robot):
    control = ControllerParameters(
        collision_sensitivity=(1.0,), teach_sensitivity=(4.0,), motion_limits=(10.0, 100.0, 20.0, 5.0)
    )
    robot.configure(RobotConfiguration(control=control))
    api = robot.xarm.api
    assert (api.collision_sensitivity, api.teach_sensitivity) == (1, 4)
    assert (api.joint_jerk, api.tcp_jerk) == pytest.approx((100.0, 5000.0))
    for level in (2.5, 0.0):  # The client library has no level 0.
        with pytest.raises(InvalidValueError, match="whole number from 1 to 5"):
            robot.configure(RobotConfiguration(control=ControllerParameters(teach_sensitivity=(level,))))
    with pytest.raises(InvalidValueError, match="known: collision_sensitivity"):
        robot.configure(RobotConfiguration(control=ControllerParameters(filters=(1.0,))))
    defaults = default_parameters(parameter_groups())
    robot.configure(RobotConfiguration(control=defaults))
    assert (api.collision_sensitivity, api.teach_sensitivity) == (3, 3)


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
