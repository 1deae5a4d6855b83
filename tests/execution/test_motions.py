"""Callbacks in the five modes, and the manual's blocking moves, against the real virtual controller in lock-step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import CertificateError, ConformanceError, ControlError, InvalidValueError, PlanningError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.execution import session
from rcilab.makers.maker import maker_of
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.motion.cartesian import schedule
from rcilab.motion.path import build_line
from rcilab.recording.run import load_run

MODEL = load_model("xMatePro7")
HOME = MODEL.home
T_HOME = MODEL.forward(HOME)
MODES = ["joint_position", "cartesian_position", "joint_impedance", "cartesian_impedance", "torque"]


@pytest.fixture(scope="module", params=["ideal", "mujoco"])
def shared(request):
    with simulate(MODEL, plant=request.param) as robot:
        yield robot


@pytest.fixture
def robot(shared):
    """The shared robot, healthy, powered and at home."""
    if shared.state.faults:
        shared.recover()
    shared.power_on()
    shared.execute(plan_joint(MODEL, shared.state.q_c, HOME, speed=1.0))
    return shared


def smooth(share: float) -> float:
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def swing(mode: str, duration: float, jump_at: float = np.inf, jump: float = 0.01):
    """A callback that moves joint 1 by 0.05 rad, the tool by 0.04 m, or pushes joint 7 to and fro."""
    start = {}

    def callback(state, t):
        start.setdefault("q", state.q_c)
        start.setdefault("T", state.T_base_tool_c.matrix)
        share, extra, finished = smooth(t / duration), jump * (t >= jump_at), t >= duration
        if mode == "torque":
            tau = np.zeros(7)
            tau[6] = 0.03 * np.sin(2.0 * np.pi * min(t / duration, 1.0)) + 300.0 * extra
            return JointTorque(tau, finished)
        if mode.startswith("joint"):
            return JointPosition(start["q"] + np.array([0.05 * share + extra, 0, 0, 0, 0, 0, 0]), finished)
        T = start["T"].copy()
        T[1, 3] += 0.04 * share + extra
        return CartesianPosition(T, finished=finished)

    return callback


@pytest.mark.parametrize("mode", MODES)
def test_a_callback_runs_to_its_end_in_every_mode(robot, mode):
    run = robot.control(swing(mode, 0.25), mode)
    state = robot.state
    assert run.stopped is None
    assert run.faults == ()
    assert run.timing.lost == 0
    assert state.robot_mode.name == "IDLE"
    if mode.startswith("joint"):
        assert state.q[0] - HOME[0] == pytest.approx(0.05, abs=2e-3)
        assert np.isfinite(run.command).all()
    elif mode != "torque":
        assert state.T_base_tool.matrix[1, 3] - T_HOME.position[1] == pytest.approx(0.04, abs=2e-3)
        assert np.isfinite(run.command_pose).all()
        assert np.isnan(run.command).all()
    else:
        assert np.isfinite(run.command_tau).all()
        assert np.abs(run.dq[:, 6]).max() > 0.01


def test_a_plan_in_torque_mode_settles_at_its_goal():
    """With the acceleration of the last row for ever after, it would drift off by half a degree."""
    goal = HOME + np.array([0.4, 0.2, -0.3, 0.3, 0.2, -0.2, 0.4])
    with simulate(MODEL) as robot:
        robot.power_on()
        run = robot.execute(plan_joint(MODEL, HOME, goal, speed=0.6, law="torque_rate_limited"), mode="torque")
        assert np.abs(run.goal_error).max() < np.deg2rad(0.1)


@pytest.mark.parametrize("mode", MODES)
def test_a_stop_in_any_mode_is_no_fault_and_the_next_motion_runs(robot, mode):
    good = swing(mode, 0.4)

    def callback(state, t):
        if t >= 0.15:
            robot.stop()
        return good(state, t)

    run = robot.control(callback, mode)
    assert run.stopped == "on request"
    assert run.faults == ()
    assert np.abs(robot.state.dq).max() < 1e-3
    assert robot.control(swing(mode, 0.2), mode).stopped is None


@pytest.mark.parametrize(
    ("mode", "fault", "numbers"),
    [
        ("joint_position", Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, r"joint 1: commanded \w+ \d+.* passes"),
        ("joint_impedance", Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION, r"joint 1: commanded \w+ \d+.* passes"),
        ("cartesian_position", Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION, r"m/s passes 1 m/s in the command"),
        ("cartesian_impedance", Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION, r"m/s passes 1 m/s in the command"),
        ("torque", Fault.COMMAND_TORQUE_DISCONTINUITY, r"joint 7: commanded torque rate .* passes"),
    ],
)
def test_a_jump_is_told_with_numbers_and_record_and_the_same_session_goes_on(robot, tmp_path, mode, fault, numbers):
    with pytest.raises(ControlError, match=numbers) as caught:
        robot.control(swing(mode, 0.25, jump_at=0.12), mode)
    error = caught.value
    assert fault in error.faults
    assert str(error).endswith("recover() clears the fault; error.run holds the motion")
    error.save(tmp_path / "flight.npz")
    with np.load(tmp_path / "flight.npz") as flight:
        assert len(flight["t"]) == len(error.record) > 30
        assert flight["faults"][-1] >> int(fault) & 1
    error.run.save(tmp_path / "fault.rcirun")
    saved = load_run(tmp_path / "fault.rcirun")
    assert set(saved.faults) == set(error.faults)
    assert saved.stopped == str(error)
    assert saved.cycles["t"][0] == 0.0
    assert np.array_equal(saved.q_c, error.run.q_c)
    assert set(robot.state.faults) == set(error.faults)
    robot.recover()
    robot.power_on()
    assert robot.state.faults == ()
    run = robot.control(swing(mode, 0.2), mode)  # The vendor's object would throw the old error here.
    assert (run.stopped, run.faults) == (None, ())


@pytest.mark.parametrize("mode", ["joint_position", "joint_impedance"])
@pytest.mark.parametrize("options", [{"rate_limit": "manual"}, {"rate_limit": "sdk", "cut_off": 50.0}])
def test_a_rate_limit_makes_a_motion_of_a_jump_and_it_ends_at_its_command(robot, mode, options):
    run = robot.control(swing(mode, 0.2, jump_at=0.1, jump=0.002), mode, **options)
    assert run.faults == ()
    assert run.command[-1][0] - HOME[0] == pytest.approx(0.052, abs=1e-12)


def test_a_low_pass_lags_and_ends_exactly_at_the_last_command(robot):
    run = robot.control(swing("joint_position", 0.4), cut_off=30.0)
    assert run.faults == ()
    assert run.command[-1][0] == HOME[0] + 0.05
    assert len(run.t) > 0.4 / 0.001 + 20


def test_a_first_torque_beyond_the_rate_is_refused_and_named(robot):
    with pytest.raises(InvalidValueError, match=r"joint 5 begins with 4 N m, .* less than 1 N m .*begin with zeros"):
        robot.control(lambda state, t: JointTorque(np.array([0, 0, 0, 0, 4.0, 0, 0])), "torque")
    assert robot.state.faults == ()


def test_the_blocking_moves_go_there_by_the_s_profile(robot):
    assert robot.move_j(HOME + 0.1, speed=0.8).plan.law == "s_profile"
    assert np.abs(robot.state.q_c - HOME - 0.1).max() < 1e-12
    robot.move_j(HOME, speed=0.8)
    goal = Pose(T_HOME.position + [0.0, 0.1, 0.0], T_HOME.wxyz)
    run = robot.move_l(goal, speed=0.3)
    path = build_line(T_HOME, goal)
    wanted = np.array([path.at(share)[0].matrix for share in schedule(path, 0.3)])
    assert np.abs(run.command_pose[: len(wanted)] - wanted).max() < 1e-9
    assert np.isnan(run.command_psi).all()
    assert robot.state.T_base_tool_c.is_close(goal)
    assert np.degrees(np.abs(run.error).max()) < 0.1
    via = Pose(T_HOME.position + [0.05, 0.05, 0.0], T_HOME.wxyz)
    told = []
    run = robot.move_c(via, T_HOME, speed=0.3, psi=0.0, progress=lambda t, duration: told.append(t / duration))
    assert robot.state.T_base_tool_c.is_close(T_HOME)
    assert run.command_psi[-1] == 0.0
    assert robot.state.psi_c == pytest.approx(0.0, abs=1e-9)
    assert told[-1] == 1.0


def test_an_arm_without_poses_and_profile_makes_the_blocking_moves_by_joint_angles(robot, monkeypatch):
    maker = maker_of(MODEL)
    monkeypatch.setattr(type(maker), "capabilities", replace(maker.capabilities, modes=("joint_position",)))
    monkeypatch.setattr(session, "S_PROFILE_VELOCITY", {})
    assert robot.move_j(HOME + 0.05, speed=0.8).plan.law == "jerk_limited"
    robot.move_j(HOME, speed=0.8)
    goal = Pose(T_HOME.position + [0.0, 0.05, 0.0], T_HOME.wxyz)
    run = robot.move_l(goal, speed=0.3)
    assert run.setup.mode == "joint_position"
    assert robot.state.T_base_tool_c.is_close(goal, 1e-6)


def test_signals_that_do_not_exist_are_refused_before_the_maker_sees_them(robot):
    for call in (lambda: robot.set_output(6, True), lambda: robot.read_input(-1)):
        with pytest.raises(InvalidValueError, match="there are 0 to 5"):
            call()


def test_a_move_to_where_the_arm_is_ends_at_once(robot):
    here = robot.state.T_base_tool_c
    for run in (robot.move_j(robot.state.q_c), robot.move_l(here), robot.move_l(here, psi=MODEL.arm_angle(HOME))):
        assert run.stopped is None
        assert run.duration < 0.05


def test_a_mere_turn_and_a_mere_arm_angle_arrive(robot):
    turned = T_HOME @ Pose.from_rpy((0, 0, 0), (0.1, 0.2, -0.1))
    robot.move_l(turned, speed=0.4)
    assert robot.state.T_base_tool_c.is_close(turned)
    robot.move_l(turned, speed=0.4, psi=0.3)
    assert robot.state.psi_c == pytest.approx(0.3, abs=1e-9)


def test_a_move_that_cannot_be_is_refused_before_anything_moves(robot):
    line = [Pose(T_HOME.position + [0.0, y, 0.0], T_HOME.wxyz) for y in (0.05, 0.1)]
    with pytest.raises(PlanningError, match="lie on a line"):
        robot.move_c(*line)
    with pytest.raises(PlanningError, match=r"cannot be followed at .* of 2\.000 m"):
        robot.move_l(Pose(T_HOME.position + [2.0, 0.0, 0.0], T_HOME.wxyz))
    with pytest.raises(ConformanceError, match="commanded"):
        robot.move_l(
            Pose(T_HOME.position + [0.0, 0.0, 0.002], (T_HOME @ Pose.from_rpy((0, 0, 0), (0, 0, 0.8))).wxyz), 1.0
        )
    assert np.array_equal(robot.state.q_c, HOME)


def test_a_motion_that_was_judged_for_another_mode_is_refused(robot):
    away = plan_joint(MODEL, HOME, HOME + [0.2, 0, 0, 0, 0, 0, 0], speed=0.1)
    certificate = check(away, MODEL, mode="cartesian_position").require().certificate
    with pytest.raises(CertificateError, match="checked for the mode cartesian_position, not for the mode j"):
        robot.execute(away, certificate)
    assert np.array_equal(robot.state.q_c, HOME)


def test_motions_are_checked_with_the_safety_box_that_was_set(robot):
    away = plan_joint(MODEL, HOME, HOME + [0.6, 0, 0, 0, 0, 0, 0])
    certificate = check(away, MODEL).certificate
    robot.rci.set_cartesian_limit(SafetyBox(size=(0.3, 0.3, 0.3), T_base_box=Pose(T_HOME.position)))
    try:
        with pytest.raises(ConformanceError, match="box"):
            robot.execute(away)
        with pytest.raises(ConformanceError, match="box"):
            robot.move_l(Pose(T_HOME.position + [0.0, 0.2, 0.0], T_HOME.wxyz))
        with pytest.raises(CertificateError, match="safety box"):
            robot.execute(away, certificate)
        assert robot.move_l(Pose(T_HOME.position + [0.0, 0.1, 0.0], T_HOME.wxyz)).stopped is None
    finally:
        robot.rci.set_cartesian_limit(SafetyBox(size=(1, 1, 1), T_base_box=Pose(), active=False))
