"""A session with a Panda or an FR3 is that with an xMate: plan, check, execute, stop, error, recover, record."""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process.launch import start_controller
from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import CommandRejectedError, ConformanceError, ControlError, InvalidValueError, UsageError
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, RobotMode
from rcilab.execution.connect import connect
from rcilab.makers.franka.errors import FrankaError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint
from rcilab.recording.run import load_run
from tests.makers.franka.driver.conftest import ARMS

OFF = np.array([0.3, 0.2, -0.2, 0.3, 0.2, 0.1, 0.4])
ROUNDING = 3e-7  # [rad] Half a unit in the last place of single precision, in which an FR3 reports its angles.


def test_a_checked_motion_arrives_and_its_run_has_every_cycle(robot):
    motion = plan_joint(robot.model, robot.model.home, robot.model.home + OFF, speed=1.0)
    certificate = check(motion, load_model(robot.model.name)).require().certificate
    run = robot.execute(motion, certificate)
    assert run.faults == ()
    assert run.timing.lost == 0
    assert np.abs(run.error).max() <= ROUNDING
    assert np.abs(robot.state.q_c - motion.q[-1]).max() <= ROUNDING
    sent = run.cycles["command"][np.isfinite(run.cycles["command"]).all(axis=1)]
    assert np.array_equal(sent[: len(motion.q)], motion.q)


@pytest.mark.parametrize("name", ARMS)
def test_a_stop_during_a_long_call_is_in_the_span_without_states(name):
    controller = start_controller(name, options=("--patience", "0.02"))
    calls = []

    def slow(state, t):
        calls.append(t)
        time.sleep(1.0 if len(calls) == 50 else 0.0)  # 20 cycles wait 0.02 s each: the arm stops in the middle of it.
        return JointPosition(state.q_c)

    try:
        with connect(controller.address) as robot:
            robot.power_on()
            with pytest.raises(ControlError, match=r"between t = (\S+) s and (\S+) s \(no state was read") as caught:
                robot.control(slow)
    finally:
        controller.end()
    found = re.search(r"between t = (\S+) s and", str(caught.value))
    assert found is not None
    assert float(found[1]) == pytest.approx(calls[-1])
    assert "and the cycles meanwhile had no command in time" in str(caught.value)


@pytest.mark.parametrize("name", ARMS)
def test_two_simulated_runs_are_equal_to_the_last_bit(name):
    runs = []
    for _ in range(2):
        with simulate(load_model(name)) as robot:
            runs.append(robot.execute(plan_joint(robot.model, robot.state.q_c, robot.model.home + OFF, speed=0.7)))
    for column in ("t", "q", "q_c", "dq", "command", "success_rate"):
        assert np.array_equal(runs[0].cycles[column], runs[1].cycles[column], equal_nan=True), column


def test_a_motion_that_violates_a_condition_of_the_maker_is_refused_before_anything_moves(robot):
    q = robot.state.q_c
    with pytest.raises(ConformanceError, match=r"joint \d: commanded jerk"):
        robot.execute(Motion.from_cycles(np.vstack([q, q + 0.05])))
    with pytest.raises(UsageError, match="does not start at the arm's position"):
        robot.execute(plan_joint(robot.model, q + 0.1, q))
    assert np.array_equal(robot.state.q_c, q)


@pytest.mark.parametrize("mode", ["joint_position", "joint_impedance"])
def test_joint_modes_arrive(robot, mode):
    goal = robot.model.home + OFF
    robot.execute(plan_joint(robot.model, robot.state.q_c, goal, speed=0.5), mode=mode)
    assert np.abs(robot.state.q - goal).max() <= 1e-5


@pytest.mark.parametrize(("mode", "reached"), [("cartesian_position", 1e-6), ("cartesian_impedance", 1e-3)])
def test_cartesian_modes_bring_the_tool_to_its_goal(robot, mode, reached):
    goal = robot.model.home + OFF
    run = robot.execute(plan_joint(robot.model, robot.state.q_c, goal, speed=0.4), mode=mode)
    poses = run.cycles["command_pose"]
    assert np.isfinite(poses[-2]).all()
    off = robot.state.T_base_tool.position - robot.model.forward(goal).position
    assert np.linalg.norm(off) <= reached


def test_the_plan_of_poses_has_the_joint_angles_that_the_arm_follows(robot):
    motion = plan_joint(robot.model, robot.state.q_c, robot.model.home + OFF, speed=0.4)
    report = check(motion, robot.model, mode="cartesian_position").require()
    run = robot.execute(motion, report.certificate, mode="cartesian_position")
    assert np.abs(run.error).max() <= 1e-6
    is_free = robot.model.name == "FR3"
    assert robot._driver.commands_arm_angle is not is_free
    assert ("sent without the arm angle" in report.title) is is_free
    assert bool(np.abs(robot.state.q_c - motion.goal).max() > 0.1) is is_free
    assert run.plan.goal == pytest.approx(robot.state.q_c, abs=1e-6)
    assert "in mode cartesian_position" in run.report.title


def test_the_speed_of_poses_is_changed_on_the_way(robot):
    motion = plan_joint(robot.model, robot.state.q_c, robot.model.home + OFF, speed=0.1)
    changed = []

    def progress(t, duration):
        if t > 0.3 and not changed:
            changed.append(threading.Thread(target=robot.set_speed_override, args=(0.5,)))
            changed[0].start()

    run = robot.execute(motion, progress=progress, mode="cartesian_position", speed_override=0.8)
    changed[0].join()
    assert run.duration > 1.2 * motion.duration
    assert run.plan.speed == motion.speed
    assert np.abs(run.error).max() <= 1e-5  # The rows between those of the plan are interpolated.


def test_torques_make_the_compliant_arm_follow(robot):
    goal = robot.model.home + OFF
    robot.execute(plan_joint(robot.model, robot.state.q_c, goal, speed=0.3, law="torque_rate_limited"), mode="torque")
    assert np.abs(robot.state.q - goal).max() <= 0.05


def test_a_line_keeps_to_its_path_and_the_joints_to_their_plan(robot):
    start = robot.state
    goal = robot.model.forward(start.q_c) @ Pose(position=[0.0, 0.0, 0.05])
    run = robot.move_l(goal, speed=0.2)
    assert np.abs(robot.state.T_base_tool.matrix - goal.matrix).max() <= 1e-6
    assert np.abs(run.error).max() <= 1e-6
    assert abs(robot.state.psi_c - start.psi_c) <= 1e-6


def test_a_callback_begins_at_the_arm_and_its_last_command_is_reached(robot):
    q0 = robot.state.q_c

    def swing(state, t):
        return JointPosition(q0 + 0.05 * (1.0 - np.cos(2.0 * np.pi * t)) * np.eye(7)[3], finished=t >= 1.0)

    run = robot.control(swing)
    assert run.stopped is None
    assert len(run.t) >= 1000
    assert np.abs(robot.state.q_c - q0).max() <= 1e-6

    with pytest.raises(InvalidValueError, match=r"first command.*must be the present position"):
        robot.control(lambda state, t: JointPosition(q0 + 0.01))
    assert robot.state.robot_mode is RobotMode.IDLE


def test_poses_and_torques_of_a_callback_are_sent(robot):
    start = robot.state.T_base_tool_c

    def lift(state, t):
        up = 0.02 * (1.0 - np.cos(np.pi * min(t, 1.0)))
        T = start.matrix.copy()
        T[2, 3] += up
        return CartesianPosition(T, finished=t >= 1.0)

    robot.control(lift, "cartesian_position")
    assert robot.state.T_base_tool.position[2] == pytest.approx(start.position[2] + 0.04, abs=1e-5)

    seen = []

    def push(state, t):
        seen.append(state.controller_mode)
        return JointTorque(0.3 * np.sin(2.0 * np.pi * t) * np.eye(7)[6], finished=t >= 1.0)

    run = robot.control(push, "torque")
    assert set(seen) == {ControllerMode.TORQUE}
    assert np.abs(run.cycles["q"][:, 6] - run.cycles["q"][0, 6]).max() > 1e-3


def test_steps_are_smoothed_by_the_filters_of_the_client_library(robot):
    q0 = robot.state.q_c

    def step(state, t):
        return JointPosition(q0 + (0.005 if t > 0.1 else 0.0), finished=t > 0.9)

    run = robot.control(step, cut_off=100.0, rate_limit="sdk")
    assert run.faults == ()
    assert np.abs(robot.state.q_c - q0 - 0.005).max() <= 1e-5
    assert run.cycles["q_c"].max(axis=0) == pytest.approx(q0 + 0.009, abs=6e-4)  # It clips, so it overshoots.


def test_a_stop_is_within_the_limits_and_the_arm_is_ready_again(robot):
    motion = plan_joint(robot.model, robot.state.q_c, robot.model.home + OFF, speed=0.2)
    stopping = threading.Event()

    def progress(t, duration):
        if t > 0.1 and not stopping.is_set():
            stopping.set()
            robot.stop()

    run = robot.execute(motion, progress=progress)
    assert run.stopped == "on request"
    assert run.duration < motion.duration
    assert run.faults == ()
    robot.move_j(robot.model.home)
    assert np.abs(robot.state.q_c - robot.model.home).max() <= ROUNDING


def test_an_error_of_a_callback_stops_the_arm_also_before_the_first_command(robot):
    q0 = robot.state.q_c

    def fail(state, t):
        if t > 0.2:
            raise LookupError("mine")
        return JointPosition(q0 + 0.02 * (1.0 - np.cos(6.0 * t)))

    def fail_at_once(state, t):
        raise LookupError("mine")

    for callback in (fail, fail_at_once):
        with pytest.raises(LookupError, match="mine"):
            robot.control(callback)
        state = robot.state
        assert (state.robot_mode, state.faults) == (RobotMode.IDLE, ())
    robot.move_j(robot.model.home)


def test_an_error_of_the_arm_is_named_explained_and_recorded_and_recovery_clears_it(robot, tmp_path: Path):
    def jump(state, t):
        return JointPosition(robot.model.home + (0.05 if t > 0.1 else 0.0))

    with pytest.raises(ControlError, match=r"joint \d: commanded velocity 50 rad/s passes") as caught:
        robot.control(jump)
    error = caught.value
    assert error.faults == (
        FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION,
        FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY,
        FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY,
    )
    assert "joint_motion_generator_velocity_limits_violation" in str(error)
    assert error.run.faults == error.faults
    error.run.save(tmp_path / "fault.rcirun")
    assert load_run(tmp_path / "fault.rcirun").faults == error.faults

    with pytest.raises(CommandRejectedError, match=r"Move was refused.*a fault has stopped the arm: recover"):
        robot.control(jump)
    robot.recover()
    assert robot.state.faults == ()
    robot.move_j(robot.model.home + 0.05)


def test_a_force_that_still_acts_ends_each_motion_with_its_own_errors(robot):
    robot.simulation.push([0.0, 0.0, -60.0, 0.0, 0.0, 0.0])
    try:
        while robot.receive_state().tau_ext_in_base[2] > -55.0:  # The estimate grows.
            pass
        for mode in ("joint_position", "cartesian_position"):
            unset = r"along z of K: \d+\S* N is above its threshold, which was not set over.* starts with 20 N;"
            with pytest.raises(ControlError, match=unset) as caught:
                robot.execute(plan_joint(robot.model, robot.state.q_c, robot.model.home + 0.05, speed=0.1), mode=mode)
            assert caught.value.faults == (FrankaError.JOINT_REFLEX, FrankaError.CARTESIAN_REFLEX)
            assert caught.value.run.faults == caught.value.faults
            robot.recover()
    finally:
        robot.simulation.release()
        while robot.receive_state().tau_ext_in_base[2] < -1.0:
            pass


def test_a_pose_that_is_too_far_is_found(robot):
    start = robot.state.T_base_tool_c

    def leap(state, t):
        T = start.matrix.copy()
        T[0, 3] += 0.02 if t > 0.05 else 0.0
        return CartesianPosition(T)

    with pytest.raises(ControlError, match=r"tool: commanded.*translation") as caught:
        robot.control(leap, "cartesian_position")
    assert FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION in caught.value.faults
    assert "poses inside the tool's limits" not in str(caught.value)
    assert repr(caught.value.run).count("cartesian_motion_generator_velocity_limits_violation") == 1


def test_a_joint_that_poses_make_too_fast_is_found(robot):
    joint, angle, axis, found = {
        "Panda": (6, 0.05, 1, "joint 5: resulting velocity"),  # The wrist is almost singular,
        "FR3": (4, -0.3, 0, "joint 4: resulting acceleration"),  # the arm almost stretched.
    }[robot.model.name]
    q = robot.model.home.copy()
    q[joint - 1] = angle
    robot.move_j(q, 1.0)
    start, psi = robot.state.T_base_tool_c, robot.state.psi_c if robot.model.name == "Panda" else None

    def sweep(state, t):
        T = start.matrix.copy()
        T[axis, 3] += 0.2 * (1.0 - np.cos(2.5 * t))
        return CartesianPosition(T, psi, finished=t >= 1.25)

    with pytest.raises(ControlError, match="poses inside the tool's limits are not enough") as caught:
        robot.control(sweep, "cartesian_position")
    assert found in str(caught.value)


def test_the_user_stop_ends_a_motion_and_is_named(robot):
    q0 = robot.state.q_c
    pressed = threading.Event()

    def hold(state, t):
        if t > 0.05 and not pressed.is_set():
            pressed.set()
            threading.Thread(target=robot.simulation.press, args=("estop",)).start()
        return JointPosition(q0)

    with pytest.raises(ControlError, match="the user stop is pressed: release it first") as caught:
        robot.control(hold)
    assert caught.value.code == "safety_stop"
    assert not robot.is_powered()
    for refused in (robot.power_on, robot.recover, lambda: robot.move_j(q0)):
        sentence = r"\w+ was refused: not possible; the user stop is pressed: release it first"
        with pytest.raises(CommandRejectedError, match=f"^{sentence}$"):
            refused()
    robot.simulation.press("none")
    robot.power_on()
    robot.move_j(robot.model.home + 0.05)


def test_a_closed_session_leaves_the_controller_ready_for_the_next_client():
    with simulate(load_model("Panda")) as robot:
        address = robot.address
        assert address.startswith("fci://127.")
    with pytest.raises(UsageError, match="closed"):
        robot.state  # noqa: B018
