"""Commands that are no motions against the real virtual controller: drag, safety stops, inputs, recovery, reboot."""

from __future__ import annotations

import re
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process.launch import start_controller
from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import (
    CertificateError,
    CommandRejectedError,
    ConformanceError,
    ControlError,
    InvalidValueError,
    PlanningError,
    UsageError,
)
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode
from rcilab.execution.connect import connect
from rcilab.makers.rokae.controller.state_machine import QUERIES, Phase, transition
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import CommandCode, RecoveryStatus, SafetyStop, SettingStatus
from rcilab.makers.rokae.wire.statuses import WHILE_MOVING
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint, plan_recovery

MODEL = load_model("xMate3")


@pytest.fixture(scope="module")
def robot():
    with simulate(MODEL) as robot:
        robot.power_on()
        yield robot


def hold(state, t):
    return JointPosition(state.q_c, finished=t >= 0.02)


def test_every_setting_is_taken_in_rest(robot):
    joint = MODEL.limits.joint
    robot.rci.connect()
    robot.rci.set_joint_limit(0.9 * joint.lower, 0.9 * joint.upper)
    robot.rci.set_joint_limit(joint.lower, joint.upper)
    robot.rci.set_collision_behavior(joint.collision_threshold)
    robot.rci.set_joint_impedance(0.5 * joint.stiffness)
    robot.rci.set_cartesian_impedance([1000.0] * 3 + [100.0] * 3)
    robot.rci.set_cart_imp_desired_tau(np.zeros(6))
    robot.rci.set_filters(1000.0, 1000.0, 1000.0)
    robot.rci.set_torque_filter_cut_off_frequency(200.0)
    robot.rci.set_fc_coor(Pose(), "world")
    robot.rci.enable_virtual_guide(False)
    figures = robot.rci.load_model()
    assert [len(part) for part in (figures.dh, figures.dimensions)] == [28, 21]
    assert [len(part) for part in (figures.dynamics_with_friction, figures.dynamics)] == [66, 45]
    assert robot.rci.motor_state() is True


def test_outputs_come_back_as_inputs_when_looped(robot):
    robot.world.set_loop_back(True)
    for level in (True, False):
        robot.rci.set_do(3, level)
        assert robot.rci.get_di(3) is robot.read_input(3) is level
        robot.set_output(5, level)
        assert robot.rci.get_di(5) is level


def test_a_drag_shows_in_the_mode_and_refuses_settings_until_it_ends(robot):
    robot.rci.start_drag("cartesian", "free")
    assert robot.state.robot_mode is RobotMode.GUIDING
    with pytest.raises(CommandRejectedError, match="not possible; the arm is guided by hand") as caught:
        robot.rci.set_joint_impedance(MODEL.limits.joint.stiffness)
    assert caught.value.status is SettingStatus.NOT_POSSIBLE
    robot.rci.stop_drag()
    assert robot.state.robot_mode is RobotMode.IDLE
    assert robot.control(hold).stopped is None


@pytest.mark.parametrize(("button", "shown"), [("estop", SafetyStop.ESTOP), ("gstop", SafetyStop.GSTOP)])
def test_a_safety_stop_is_shown_and_recovery_waits_for_its_release(robot, button, shown):
    assert robot.rci.safety_stop() is SafetyStop.NONE
    robot.world.press(button)
    assert robot.rci.safety_stop() is shown
    with pytest.raises(CommandRejectedError, match=r"(release|close) it first") as caught:
        robot.recover()
    assert caught.value.status is RecoveryStatus.USER_STOP
    words = {"estop": "an emergency stop is pressed", "gstop": "the safety gate is open"}[button]
    for refused in (robot.power_on, robot.rci.start_drag, lambda: robot.rci.set_filters(100.0, 100.0, 100.0)):
        with pytest.raises(CommandRejectedError, match=words):
            refused()
    robot.world.press("none")
    robot.recover()
    robot.power_on()
    assert robot.control(hold).stopped is None


def test_a_joint_limit_takes_the_motor_power_and_recovery_does_not_give_it_back(robot):
    limits, q = MODEL.limits.joint, robot.state.q_c
    robot.rci.set_joint_limit(q - 0.05, q + 0.05)

    def swing(state, t):
        away = 0.03 * (1.0 - np.cos(2.0 * t)) * np.eye(MODEL.n)[0]
        return JointPosition(q + away, finished=t >= 3.0)

    with pytest.raises(ControlError, match="kCommandJointPositionLimitsViolation"):
        robot.control(swing)
    assert robot.rci.motor_state() is False
    with pytest.raises(CommandRejectedError, match="a fault has stopped the arm: recover"):
        robot.power_on()
    robot.recover()
    assert robot.rci.motor_state() is False
    with pytest.raises(CommandRejectedError, match="the motors are off"):
        robot.control(hold)
    robot.power_on()
    robot.rci.set_joint_limit(limits.lower, limits.upper)
    assert robot.control(hold).stopped is None


def test_with_auto_limit_the_motors_stay_on(robot):
    limits, q = MODEL.limits.joint, robot.state.q_c
    robot.rci.set_joint_limit(q - 0.05, q + 0.05)
    robot.world.set_auto_limit(True)
    away = np.eye(MODEL.n)[0]
    robot.control(lambda state, t: JointPosition(q + 0.03 * (1.0 - np.cos(2.0 * t)) * away, finished=t >= np.pi))
    assert robot.rci.motor_state() is True
    robot.world.set_auto_limit(False)
    robot.rci.set_joint_limit(limits.lower, limits.upper)


def test_without_power_a_drag_and_a_motion_are_refused_for_that(robot):
    robot.power_off()
    with pytest.raises(CommandRejectedError, match="StartDrag was refused: not possible; the motors are off"):
        robot.rci.start_drag()
    with pytest.raises(CommandRejectedError, match="StartMove was refused: not possible; the motors are off"):
        robot.control(hold)
    robot.power_on()


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_collision_that_presses_on_is_left_by_higher_thresholds(plant):
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        robot.rci.set_collision_behavior([5.0] * MODEL.n)
        robot.world.push([0.0, 0.0, -40.0, 0.0, 0.0, 0.0], duration=60.0)
        with pytest.raises(ControlError, match="kCollision"):
            robot.control(lambda state, t: JointPosition(state.q_c))
        with pytest.raises(
            CommandRejectedError, match="StartDrag was refused: not possible; a fault has stopped the arm"
        ):
            robot.rci.start_drag()
        with pytest.raises(CommandRejectedError, match=r"the cause is still there: .*set_collision_behavior"):
            robot.recover()
        robot.rci.set_collision_behavior(MODEL.limits.joint.collision_threshold)
        robot.recover()
        assert robot.control(hold).stopped is None


def test_a_safety_stop_in_mid_motion_ends_it_with_a_record_and_the_session_goes_on(robot):
    def callback(state, t):
        if t > 0.05:
            robot.world.press("estop")
        return JointPosition(state.q_c)

    with pytest.raises(ControlError, match=r"stopped the motion at t = .*: an emergency stop is pressed") as caught:
        robot.control(callback)
    assert "network" not in str(caught.value)
    assert "cycles in a row" not in str(caught.value)
    assert len(caught.value.record) > 20
    robot.world.press("none")
    robot.recover()
    robot.power_on()
    assert robot.control(hold).stopped is None


def test_a_reboot_closes_the_session():
    with simulate(MODEL) as robot:
        robot.rci.reboot()
        with pytest.raises(UsageError, match="closed; connect again"):
            robot.rci.motor_state()


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_fault_before_the_first_command_is_a_control_error_that_names_it(plant):
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        robot.world.push([0.0, 0.0, -150.0, 0.0, 0.0, 0.0], duration=3.0)
        while abs(robot.receive_state().tau_ext_in_base[2]) < 140.0:  # The estimate grows.
            pass
        with pytest.raises(ControlError, match="before the first command: kCollision") as caught:
            robot.execute(plan_joint(MODEL, robot.state.q_c, robot.state.q_c + 0.1))
        assert caught.value.faults == (Fault.COLLISION,)
        assert len(caught.value.record) > 0


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("pause", "said"),
    [
        (lambda t: 0.06 * (t > 0.05), r"the callback took \d+\.\d ms at t = .*, and the cycles meanwhile had no"),
        (lambda t: 0.0015, r"\d+ of \d+ calls .* more than 1 ms, \d+\.\d ms on average"),
        (lambda t: 0.03, r"\d+ of \d+ calls .* more than 1 ms, \d+\.\d ms on average"),
    ],
    ids=["one long call", "all calls a little", "all calls long"],
)
def test_a_slow_callback_is_named_with_its_times_and_not_the_network(pause, said):
    def slow(state, t):
        time.sleep(pause(t))
        return JointPosition(state.q_c)

    with simulate(MODEL, lockstep=False) as robot:
        robot.power_on()
        with pytest.raises(ControlError, match=said) as caught:
            robot.control(slow)
        assert caught.value.faults == (Fault.INSTABILITY_DETECTION,)
        assert "network" not in str(caught.value)


def test_soft_limits_of_the_session_count_in_plan_check_and_certificate():
    with simulate(MODEL) as robot:
        robot.power_on()
        start = robot.state.q_c
        goal = start + np.eye(MODEL.n)[0] * 0.3
        motion = plan_joint(robot.model, start, goal)
        certificate = check(motion, robot.model).certificate
        joint = MODEL.limits.joint
        upper = np.array(joint.upper)
        upper[0] = start[0] + 0.2
        robot.rci.set_joint_limit(joint.lower, upper)
        with pytest.raises(PlanningError, match="joint 1"):
            plan_joint(robot.model, start, goal)
        assert not check(motion, robot.model).ok
        with pytest.raises(ConformanceError, match="joint 1"):
            robot.execute(motion)
        with pytest.raises(CertificateError, match="limits"):
            robot.execute(motion, certificate)
        assert "soft limit" in robot.model.limits.source("joint.upper")
        robot.rci.set_joint_limit(joint.lower, joint.upper)
        robot.execute(motion)


@pytest.mark.parametrize("is_free", [False, True], ids=["lock-step", "free"])
def test_a_callback_and_another_thread_switch_outputs_and_ramp_a_force_while_the_arm_moves(is_free):
    with simulate(MODEL, plant="mujoco", lockstep=not is_free) as robot:
        robot.power_on()
        robot.world.set_loop_back(True)
        start, seen, others = robot.state.T_base_tool_c, [], []
        moving, done = threading.Event(), threading.Event()

        def callback(state, t):
            cycle = round(t * 1000)
            moving.set()
            if cycle % 50 == 10:
                robot.rci.set_cart_imp_desired_tau([0, 0, -cycle / 100, 0, 0, 0])
                robot.rci.set_do(1, cycle % 100 == 10)
                seen.append((robot.rci.get_di(1), robot.rci.safety_stop(), robot.rci.motor_state()))
            return CartesianPosition(start, finished=cycle >= 500)

        def ask():
            moving.wait(10.0)
            while not done.is_set():
                robot.rci.set_do(2, len(others) % 2 == 0)
                others.append(robot.rci.get_di(2))

        thread = threading.Thread(target=ask)
        thread.start()
        try:
            run = robot.control(callback, "cartesian_impedance")
        finally:
            done.set()
            thread.join(10.0)
        assert run.stopped is None
        assert seen[:2] == [(True, SafetyStop.NONE, True), (False, SafetyStop.NONE, True)]
        assert others[:4] == [True, False, True, False]
        with pytest.raises(UsageError, match="while a motion is running"):
            robot.control(lambda state, t: robot.rci.set_filters(100, 100, 100), "cartesian_impedance")


def test_what_the_session_allows_while_moving_is_what_the_controller_grants():
    granted = {
        code
        for code in CommandCode
        if (cell := transition(Phase.MOVING, code)).phase is Phase.MOVING
        and (code in QUERIES or (cell.status == 0 and cell.actions))
    }
    assert granted - {CommandCode.CONNECT} == set(WHILE_MOVING)


GAINS = re.compile(r"Kp ([\d. ]+) N m/rad with Kd ([\d. ]+) N m s/rad is stable")
ROOM = re.compile(
    r"([\d.]+) kg m² at joint (\d) and ([\d.]+) kg m² at joint (\d): at most ([\d.]+) and ([\d.]+) N m s/rad"
)


def readme():
    return (Path(__file__).parents[2] / "README.md").read_text()


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("wrong", [{}, {7: 15.0}, {3: 50.0}], ids=["as published", "joint 7", "joint 3"])
def test_the_joint_gains_of_the_readme_are_stable_and_others_get_advice_on_gains(plant, wrong):
    """In lock-step, where torques are delayed as by the clock: the delay is what the README says."""
    model = load_model("xMatePro7")
    stiffness, damping = (np.array(numbers.split(), dtype=float) for numbers in GAINS.search(readme()).groups())
    for joint, value in wrong.items():
        damping[joint - 1] = value
    controller = start_controller("xMatePro7", plant, True)
    try:
        with connect(str(controller.address), model) as robot:
            robot.power_on()
            start, errors = robot.state.q_c, []

            def follow(state, t):
                q, dq = start + 0.05 * (1.0 - np.cos(2.0 * t)), 0.1 * np.sin(2.0 * t)
                errors.append(np.abs(q - state.q).max())
                return JointTorque(stiffness * (q - state.q) + damping * (dq - state.dq), finished=t >= 1.0)

            if not wrong:
                robot.control(follow, "torque")
                assert max(errors) < 5e-3
                return
            with pytest.raises(
                ControlError, match=rf"joint {min(wrong)}: commanded torque rate .* lower its damping first"
            ) as caught:
                robot.control(follow, "torque")
            assert "planned motion" not in str(caught.value)
    finally:
        controller.end()


def test_the_damping_that_the_readme_allows_is_the_inertia_felt_by_its_delay():
    model = load_model("xMatePro7")
    felt = 1.0 / np.diag(np.linalg.inv(model.rigid_body.mass_matrix(model.home)))
    inertia_a, joint_a, inertia_b, joint_b, damping_a, damping_b = map(float, ROOM.search(readme()).groups())
    for joint, inertia, damping in ((joint_a, inertia_a, damping_a), (joint_b, inertia_b, damping_b)):
        assert felt[int(joint) - 1] == pytest.approx(inertia, rel=0.05)
        assert 0.95 * felt[int(joint) - 1] / 0.003 < damping < felt[int(joint) - 1] / 0.003


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_after_a_joint_limit_the_first_recovery_and_the_way_back_work(plant):
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        joint = MODEL.limits.joint
        near, beyond = robot.state.q_c.copy(), robot.state.q_c.copy()
        near[0], beyond[0] = joint.upper[0] - 0.5, joint.upper[0] + 0.5
        robot.move_j(near)
        rows = iter(
            plan_joint(MODEL.with_joint_limits(joint.lower - 1.0, joint.upper + 1.0), near, beyond, speed=0.2).q
        )

        def out(state, t):
            return JointPosition(next(rows))

        with pytest.raises(ControlError, match="joint 1"):
            robot.control(out)
        assert np.abs(robot.state.tau_ext_in_base).max() < 5.0
        robot.recover()
        robot.power_on()
        robot.execute(plan_recovery(robot.model, robot.state.q_c))
        assert robot.state.q_c[0] < joint.upper[0]


@pytest.mark.parametrize("way", ["execute", "control"])
def test_from_outside_its_box_the_tool_may_only_be_led_in(way):
    model = load_model("xMatePro7")
    with simulate(model) as robot:
        robot.power_on()
        q = robot.state.q_c
        below = model.forward(q).position - [0.0, 0.0, 0.06]
        robot.rci.set_cartesian_limit(SafetyBox(size=(0.04, 0.04, 0.04), T_base_box=Pose(below)))
        lead_in, lead_out = (plan_joint(model, q, q + turn * np.eye(7)[3]) for turn in (0.02, -0.02))
        if way == "execute":
            with pytest.raises(ConformanceError, match="outside the safety box"):
                robot.execute(lead_out)
            robot.execute(lead_in)
            return

        def play(motion):
            rows = [*motion.q, motion.q[-1]]
            last = len(rows) - 1
            return robot.control(
                lambda state, t: JointPosition(rows[min(round(t * 1e3), last)], round(t * 1e3) >= last)
            )

        play(lead_in)
        with pytest.raises(ControlError, match="a motion that starts outside it may only move inwards"):
            play(plan_joint(model, robot.state.q_c, q))


def in_motion(robot, after, act):
    """Has something done so long after a motion has set out, [s], however busy this machine is."""

    def wait_and_act():
        while not robot.is_moving:
            time.sleep(1e-3)
        time.sleep(after)
        act()

    thread = threading.Thread(target=wait_and_act)
    thread.start()
    return thread


def test_an_emergency_stop_before_the_motion_has_begun_is_named_at_once():
    controller = start_controller("xMate3", options=("--mode-delay", "1.05"))
    world_port = (controller.world_address or "").split(":")[1]
    try:
        with connect(f"{controller.address}?world_port={world_port}", MODEL) as robot:
            robot.power_on()
            press = in_motion(robot, 0.3, lambda: robot.world.press("estop"))
            with pytest.raises(ControlError, match="before the first command: an emergency stop is pressed"):
                robot.move_j(MODEL.home + 0.1)
            press.join()
            assert robot.state.robot_mode is RobotMode.USER_STOPPED
            robot.world.press("none")
            robot.power_on()
            robot.move_j(MODEL.home + 0.1)
    finally:
        controller.end()


@pytest.mark.parametrize("after", [0.4, 1.6], ids=["before it has begun", "on its way"])
def test_motors_that_are_switched_off_end_a_motion_and_the_error_says_so(after):
    controller = start_controller("xMate3", options=("--mode-delay", "1.05"))
    try:
        with connect(str(controller.address), MODEL) as robot:
            robot.power_on()
            cut = in_motion(robot, after, robot.power_off)
            with pytest.raises(ControlError, match="motor power was switched off during the motion"):
                robot.move_j(MODEL.home + 0.5, speed=0.05)
            cut.join()
            robot.power_on()
            robot.move_j(robot.state.q_c + 0.05)
    finally:
        controller.end()


def test_the_manual_s_numbers_are_answered_with_the_name_they_mean(robot):
    with pytest.raises(InvalidValueError, match="the manual's 1 is 'world'"):
        robot.rci.set_fc_coor(Pose(), 1)
    with pytest.raises(InvalidValueError, match="the manual's 2 is 'cartesian'"):
        robot.rci.start_drag(2, "free")


def test_a_session_has_the_tool_of_its_controller_and_says_where_the_model_has_another():
    tool = Pose((0.0, 0.0, 0.15))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with simulate(MODEL.with_tool(tool)) as first:
            assert first.model.T_flange_tool.is_close(tool, 1e-12)
    controller = start_controller("xMate3", lockstep=True)
    try:
        with connect(controller.address) as first:
            first.rci.set_coor(tool)
        with connect(controller.address) as second:
            assert second.model.T_flange_tool.is_close(tool, 1e-9)
            state = second.state
            assert second.model.forward(state.q_c).is_close(state.T_base_tool_c, 1e-9)
        with pytest.warns(UserWarning, match=r"is 50\.0 mm and 0\.0 deg from the model's"):
            connect(controller.address, MODEL.with_tool(Pose((0.0, 0.0, 0.10)))).close()
    finally:
        controller.end()


def test_power_comes_back_to_an_arm_that_stands():
    """Guided, pushed, stopped and released while it still moves."""
    with simulate(MODEL, plant="mujoco") as robot:
        robot.power_on()
        robot.rci.start_drag("joint", "free")
        robot.world.push([20.0, 0.0, 0.0, 0.0, 0.0, 0.0], duration=0.3)
        until = time.monotonic() + 5.0
        while np.abs(robot.state.dq).max() < 0.5 and time.monotonic() < until:
            pass
        robot.world.press("estop")
        robot.world.press("none")
        robot.power_on()
        assert np.abs(robot.state.dq).max() < 1e-3
        robot.move_j(MODEL.home)
