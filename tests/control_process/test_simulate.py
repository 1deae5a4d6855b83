"""The session against the real virtual controller, over real sockets, in lock-step: every run comes out the same."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process.launch import start_controller
from rcilab.control_process.simulate import simulate
from rcilab.core.command import JointPosition
from rcilab.core.errors import (
    CertificateError,
    CommandRejectedError,
    ConformanceError,
    ConnectionLostError,
    ControlError,
    InvalidValueError,
    UsageError,
)
from rcilab.core.spatial import Pose
from rcilab.execution.connect import connect, open_session
from rcilab.makers.rokae.driver.identify import identify_robot
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
GOAL = np.array([0.3, 0.4, 0.2, 1.2, 0.1, 0.8, 0.5])


@pytest.fixture(scope="module")
def shared():
    with simulate(MODEL) as robot:
        robot.power_on()
        yield robot


@pytest.fixture
def robot(shared):
    """The shared robot, healthy, powered and at home."""
    if shared.state.faults:
        shared.recover()
    shared.power_on()
    if np.abs(shared.state.q_c - MODEL.home).max() > 0.0:
        shared.execute(plan_joint(MODEL, shared.state.q_c, MODEL.home, speed=1.0))
    return shared


def test_two_simulated_runs_arrive_and_are_equal_to_the_last_bit():
    runs = []
    for _ in range(2):
        with simulate(MODEL) as robot:
            robot.power_on()
            motion = plan_joint(MODEL, robot.state.q_c, GOAL, speed=0.7)
            runs.append(robot.execute(motion))
    for run in runs:
        assert np.abs(run.q[-1] - GOAL).max() <= 1e-12
        assert np.abs(run.error).max() <= 1e-12
        assert run.faults == ()
        assert run.timing.lost == 0
        assert "lock-step" in run._repr_html_()
    for name in ("t", "q", "q_c", "dq", "command", "success_rate"):
        assert np.array_equal(runs[0].cycles[name], runs[1].cycles[name], equal_nan=True)


def test_a_motion_without_a_certificate_is_checked_and_refused_with_its_reason(robot):
    jump = Motion.from_cycles(np.vstack([robot.state.q_c, robot.state.q_c + 0.1]))
    with pytest.raises(ConformanceError, match=r"joint \d: commanded jerk"):
        robot.execute(jump)
    assert np.array_equal(robot.state.q_c, MODEL.home)


def test_a_stale_certificate_is_refused(robot):
    motion = plan_joint(MODEL, robot.state.q_c, GOAL)
    other = plan_joint(MODEL, robot.state.q_c, GOAL, speed=0.4)
    with pytest.raises(CertificateError, match="motion"):
        robot.execute(motion, check(other, MODEL).certificate)


def test_a_certificate_for_another_tool_is_refused_with_that_of_the_arm(robot):
    motion = plan_joint(MODEL, robot.state.q_c, GOAL)
    certificate = check(motion, MODEL.with_tool(Pose((0.0, 0.0, 0.12)))).certificate
    with pytest.raises(CertificateError, match=r"another tool than the arm has: a tool at 0, 0, 0 mm") as caught:
        robot.execute(motion, certificate)
    assert "check it with robot.model, or send what your model has: connect(..., apply=True)" in str(caught.value)


def test_a_motion_that_starts_elsewhere_names_joint_angles_and_remedy(robot):
    elsewhere = np.array(MODEL.home)
    elsewhere[3] += math.radians(2.0)
    with pytest.raises(UsageError, match=r"joint 4 starts at 62\.0000 deg and is at 60\.0000 deg") as caught:
        robot.execute(plan_joint(MODEL, elsewhere, GOAL))
    assert "2 deg apart" in str(caught.value)
    assert "robot.state.q_c" in str(caught.value)


def test_progress_is_reported_to_the_end(robot):
    seen = []
    motion = plan_joint(MODEL, robot.state.q_c, GOAL, speed=1.0)
    robot.execute(motion, progress=lambda t, duration: seen.append((t, duration)))
    times = [t for t, _ in seen]
    assert times == sorted(times)
    assert seen[-1] == (motion.duration, motion.duration)


def test_a_callback_in_a_closed_loop_gets_every_cycle_once(robot):
    ids, times = [], []

    def callback(state, t):
        ids.append(state.message_id)
        times.append(t)
        # Towards the goal with a slow first-order lag, let in and out smoothly: feedback on the commanded state.
        ramp = np.sin(np.pi * min(1.0, t / 0.4)) ** 4
        return JointPosition(state.q_c + 0.0005 * ramp * (GOAL - state.q_c), finished=t >= 0.4)

    run = robot.control(callback)
    assert times[0] == 0.0
    assert np.diff(ids).tolist() == [1] * (len(ids) - 1)
    assert np.allclose(times, np.arange(len(times)) * 1e-3)
    assert np.array_equal(run.q_c[-1], run.command[-1])


def test_a_fault_carries_numbers_and_record_and_recovery_leads_on(robot):
    def too_fast(state, t):
        q = np.array(MODEL.home)
        q[3] += 0.5 * 9.0 * t * t  # 9 rad/s^2 is allowed; beyond 2.175 rad/s it is not.
        return JointPosition(q)

    with pytest.raises(ControlError) as caught:
        robot.control(too_fast)
    assert Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION in caught.value.faults
    assert "joint 4: commanded velocity" in str(caught.value)
    assert "2.175" in str(caught.value)
    assert caught.value.record["faults"][-1] == 1 << Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION
    with pytest.raises(CommandRejectedError, match="recover"):
        robot.control(lambda state, t: JointPosition(state.q_c, finished=True))
    robot.recover()
    robot.power_on()
    run = robot.execute(plan_joint(MODEL, robot.state.q_c, MODEL.home))
    assert np.array_equal(run.q[-1], MODEL.home)


def test_after_a_fault_the_controller_s_own_stop_is_in_limits_and_over(robot):
    start = np.array(MODEL.home)
    with pytest.raises(ControlError) as caught:
        robot.control(lambda state, t: JointPosition(start + (0.01 if t > 0.05 else 0.0)))
    assert Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION in caught.value.faults
    assert np.array_equal(robot.state.q_c, robot.receive_state().q_c)


def test_stop_from_another_thread_ends_in_one_controlled_stop(robot):
    motion = plan_joint(MODEL, robot.state.q_c, GOAL, speed=0.3)
    halfway = threading.Event()
    stopper = threading.Thread(target=lambda: (halfway.wait(10.0), robot.stop()))
    stopper.start()
    run = robot.execute(motion, progress=lambda t, duration: halfway.set() if t > 0.3 * duration else None)
    stopper.join()
    assert run.stopped == "on request"
    assert run.faults == ()
    assert 0.3 * motion.duration < run.duration
    assert np.abs(run.q[-1] - GOAL).max() > 0.01
    assert run.stop_time is not None
    assert 0.3 * motion.duration < run.stop_time < run.duration
    planned = run.t < run.stop_time
    assert np.array_equal(run.command[planned], motion.q[: planned.sum()])
    assert run.tracking.joint_max.max() < 1e-9  # Until then; the braking is no error.
    assert np.array_equal(robot.state.q_c, run.q_c[-1])
    limits = MODEL.limits.joint
    assert (np.abs(np.diff(run.q_c, 2, axis=0)) / 1e-6 < limits.acceleration).all()
    assert (np.abs(np.diff(run.q_c, 3, axis=0)) / 1e-9 < limits.jerk).all()


def test_motor_power_is_needed_and_the_message_says_so(robot):
    robot.power_off()
    with pytest.raises(CommandRejectedError, match="power_on"):
        robot.execute(plan_joint(MODEL, robot.state.q_c, GOAL))


def test_the_arm_at_the_other_end_is_recognised_and_a_second_client_is_not(robot):
    with pytest.raises(ConnectionLostError, match="another client"):
        connect(robot.address, timeout=1.0)


def test_in_lock_step_both_ends_share_a_core_while_a_motion_runs(robot):
    before = os.sched_getaffinity(0)
    seen = []

    def callback(state, t):
        seen.append(os.sched_getaffinity(0))
        return JointPosition(state.q_c, finished=t >= 0.005)

    robot.control(callback)
    assert {len(cores) for cores in seen} == {1}
    assert os.sched_getaffinity(0) == before


@pytest.mark.parametrize("name", ["xMate3", "xMatePro3", "xMate7"])
def test_every_arm_runs_with_its_tool_and_knows_its_name(name):
    model = load_model(name, tool=Pose((0.0, 0.0, 0.1)))
    with simulate(model) as robot:
        robot.power_on()
        goal = robot.state.q_c + 0.2
        run = robot.execute(plan_joint(model, robot.state.q_c, goal, speed=1.0))
        assert np.abs(run.q[-1] - goal).max() <= 1e-12
        assert np.allclose(robot.state.T_base_tool, model.forward(goal).matrix, atol=1e-9)
        assert identify_robot(robot.rci.load_model().dh) == name


def test_an_unknown_plant_or_model_is_refused_before_anything_starts(monkeypatch):
    monkeypatch.setattr("rcilab.control_process.simulate.start_controller", None)
    with pytest.raises(InvalidValueError, match=r"plant: 'rubber' is unknown; known: ideal, mujoco"):
        simulate(MODEL, plant="rubber")
    with pytest.raises(InvalidValueError, match="use load_model"):
        simulate("xMatePro7")


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"realism": "real"}, "realism needs the plant mujoco: the ideal one has no friction"),
        ({"plant": "mujoco", "realism": "rough"}, "realism: 'rough' is unknown; known: off, real"),
        ({"on_loss": "pray"}, "on_loss: 'pray' is unknown; known: hold, bridge"),
    ],
)
def test_realism_and_behaviour_are_checked_before_anything_starts(options, expected):
    with pytest.raises(InvalidValueError, match=expected):
        simulate(load_model("xMatePro7"), **options)


def test_a_simulated_arm_can_have_real_joints_and_bridge_pauses(monkeypatch):
    started = []

    def start(*arguments):
        started.append(arguments)
        return start_controller(*arguments)

    monkeypatch.setattr("rcilab.control_process.simulate.start_controller", start)
    with simulate(load_model("xMatePro7"), plant="mujoco", realism="real", on_loss="bridge") as robot:
        steps = robot.state.tau[0] / 0.0488
        assert steps == pytest.approx(round(steps), abs=1e-6)
    assert started == [("xMatePro7", "mujoco", True, ["--realism", "real", "--on-loss", "bridge"])]


@pytest.mark.parametrize("name", ["RM75", "xArm6"])
def test_an_arm_without_lock_step_refuses_it_before_anything_starts(name, monkeypatch):
    monkeypatch.setattr("rcilab.control_process.simulate.start_controller", None)
    with pytest.raises(InvalidValueError, match=f"lockstep: True cannot be set: the controller of {name} has no such"):
        simulate(load_model(name), lockstep=True)


def test_closing_ends_the_private_controller():
    robot = simulate(MODEL)
    address = robot.address
    robot.close()
    with pytest.raises(ConnectionLostError, match="no robot at"):
        connect(address, MODEL, timeout=0.5)
    with pytest.raises(UsageError, match="connect again"):
        robot.execute(plan_joint(MODEL, MODEL.home, GOAL))


def test_a_session_that_is_dropped_takes_its_controller_along():
    # As in a notebook, when the cell that says `robot = simulate(model)` runs again.
    robot = simulate(MODEL)
    pid = robot._runner.partner
    assert os.path.exists(f"/proc/{pid}")
    with pytest.warns(ResourceWarning):  # Its sockets, too, were left to themselves.
        del robot
    assert not os.path.exists(f"/proc/{pid}")


def test_a_controller_that_is_killed_in_mid_motion_is_noticed_although_it_keeps_no_time():
    killed: list[float] = []

    def callback(state, t):
        if t >= 0.1 and not killed:
            killed.append(time.monotonic())
            controller.kill()
        return JointPosition(state.q_c)

    controller = start_controller(MODEL.name, lockstep=True)
    try:
        assert controller.address is not None
        with open_session(controller.address, MODEL, 10.0, realtime=False, state_timeout=60.0) as robot:
            robot.power_on()
            with pytest.raises(ConnectionLostError) as lost:
                robot.control(callback)
        assert killed
        assert "closed the connection" in str(lost.value)
        assert len(lost.value.record) > 0
    finally:
        controller.end()


@pytest.mark.parametrize("files", [8, 14, 15, 19])
def test_too_few_open_files_are_said_in_one_sentence(files):
    """With 14 and 15 the fork server fails while it receives the files of a process."""
    script = (
        f"import resource; resource.setrlimit(resource.RLIMIT_NOFILE, ({files}, {files}))\n"
        "import rcilab; rcilab.simulate(rcilab.load_model('xMatePro7'))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert f"only {files} files may be open, 20 are needed: raise ulimit -n" in done.stderr.splitlines()[-1]
    assert "forkserver" not in done.stderr
