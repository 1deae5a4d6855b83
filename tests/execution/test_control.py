"""The control loop: one answer a state, and one way to rest, against a scripted controller on real sockets."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import CommandRejectedError, ConnectionLostError, ControlError, InvalidValueError
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from tests.execution.peer import MODEL, Script, assert_controlled_stop, wave


def test_a_callback_answers_every_cycle_once_and_time_starts_at_zero(make_robot):
    peer, robot = make_robot()
    seen = []

    def callback(state, t):
        seen.append((state.message_id, t))
        return JointPosition(state.q_c, finished=len(seen) == 30)

    run = robot.control(callback)
    ids, times = zip(*seen, strict=True)
    assert times[0] == 0.0
    assert np.allclose(np.diff(times), 0.001)
    assert np.diff(ids).tolist() == [1] * 29
    answered = [packet.message_id for packet in peer.commands]
    assert len(set(answered)) == len(answered)
    assert run.t[0] == 0.0
    assert isinstance(peer.requests[-1], rci.StopMove)
    assert not any(packet.finished for packet in peer.commands)


def test_lost_states_do_not_stretch_time(make_robot):
    _, robot = make_robot(Script(skip_at=10))
    times = []

    def callback(state, t):
        times.append(t)
        return JointPosition(state.q_c, finished=t >= 0.025)

    run = robot.control(callback)
    assert 0.006 in np.round(np.diff(times), 6)
    assert run.timing.lost == 5


def test_the_last_command_is_played_before_the_motion_ends(make_robot):
    _peer, robot = make_robot()
    run = robot.control(wave(150, joint=2))
    assert np.array_equal(run.q_c[-1], run.command[-1])
    assert np.abs(run.q_c[:, 2]).max() == pytest.approx(0.3 + 0.02, abs=1e-12)


def test_a_first_command_elsewhere_names_the_joint_and_both_angles(make_robot):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=r"joint 2 is commanded to .* deg and is at 11\.4592 deg"):
        robot.control(lambda state, t: JointPosition(state.q_c + np.array([0, 0.1, 0, 0, 0, 0, 0])))
    assert peer.commands == []
    assert isinstance(peer.requests[-1], rci.StopMove)


@pytest.mark.parametrize("psi", [0.1, -0.1])
def test_a_first_arm_angle_elsewhere_names_both_angles_and_nothing_is_sent(make_robot, psi):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=r"psi of the first command: .* is 0\.0000 deg, 5\.7296 deg apart"):
        robot.control(lambda state, t: CartesianPosition(state.T_base_tool_c, psi), mode="cartesian_position")
    assert peer.commands == []


@pytest.mark.parametrize("psi", [0.0, None])
def test_a_first_arm_angle_that_is_the_arms_or_absent_is_sent(make_robot, psi):
    peer, robot = make_robot()
    robot.control(
        lambda state, t: CartesianPosition(state.T_base_tool_c, psi, finished=t >= 0.005), mode="cartesian_position"
    )
    assert peer.commands


@pytest.mark.parametrize(
    ("bad", "hint"),
    [
        (
            lambda q: JointPosition([0, 0, np.nan, 0, 0, 0, 0]),
            r"command at t = 0\.201 s: .*nan.* in joint 3: must be finite",
        ),
        (lambda q: JointPosition(np.zeros(6)), r"must have shape \(7,\)"),
        (lambda q: JointPosition([1.0, [2.0]]), "must be an array"),
        (lambda q: q, "must be a JointPosition"),
        (lambda q: CartesianPosition(np.eye(4)), "must be a JointPosition"),
    ],
)
def test_an_unusable_command_brings_the_arm_to_rest_first(make_robot, bad, hint):
    peer, robot = make_robot()
    good = wave(400, size=0.2)
    with pytest.raises(InvalidValueError, match=hint):
        robot.control(lambda state, t: bad(state.q_c) if t > 0.2 else good(state, t))
    assert_controlled_stop(peer)
    assert robot.rci.motor_state() is True


def test_an_exception_in_the_callback_brings_the_arm_to_rest_and_comes_out_again(make_robot):
    peer, robot = make_robot()
    good = wave(400, size=0.2)

    def callback(state, t):
        if t > 0.2:
            raise LookupError("mine")
        return good(state, t)

    with pytest.raises(LookupError, match="mine"):
        robot.control(callback)
    assert_controlled_stop(peer)


def test_a_callback_that_writes_into_one_array_again_and_again_still_stops_within_the_limits(make_robot):
    peer, robot = make_robot()
    good = wave(400, size=0.2)
    q = np.zeros(7)

    def callback(state, t):
        q[:] = good(state, t).q
        if t > 0.2:
            robot.stop()
        return JointPosition(q)

    assert robot.control(callback).stopped
    assert_controlled_stop(peer)


def test_stop_brings_the_arm_to_rest_and_returns_the_run(make_robot):
    peer, robot = make_robot()
    good = wave(400, size=0.2)

    def callback(state, t):
        if t > 0.2:
            robot.stop()
        return good(state, t)

    run = robot.control(callback)
    assert run.stopped == "on request"
    assert "stopped" in repr(run)
    assert_controlled_stop(peer)


def test_a_fault_ends_the_motion_with_faults_and_record_and_recovery_leads_on(make_robot):
    peer, robot = make_robot(Script(fault_at=40))
    with pytest.raises(ControlError, match=r"kCommandJointVelocityLimitsViolation.*rad/s") as caught:
        robot.control(wave(400))
    assert caught.value.faults == (Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,)
    assert len(caught.value.record) > 30
    assert caught.value.record["faults"][-1] == 1 << 10
    assert isinstance(peer.requests[-1], rci.StopMove)
    robot.recover()
    assert robot.control(wave(150)).faults == ()


def test_a_motion_that_the_controller_ends_by_itself_is_an_error(make_robot):
    _, robot = make_robot(Script(end_at=40))
    with pytest.raises(ControlError, match="ended the motion by itself"):
        robot.control(wave(400))


def test_silence_in_mid_motion_is_a_lost_connection(make_robot):
    peer, robot = make_robot(Script(silent_at=30), state_timeout=0.3)
    start = time.monotonic()
    with pytest.raises(ConnectionLostError, match=r"no state for 0\.3 s") as caught:
        robot.control(wave(400))
    assert len(caught.value.record) >= 20  # The flight recorder rides on this one, too.
    assert time.monotonic() - start < 5.0
    assert isinstance(peer.requests[-1], rci.StopMove)


def test_a_refused_stop_is_not_swallowed(make_robot):
    _, robot = make_robot(Script(statuses={rci.StopMove: rci.StopStatus.ABORTED}))
    with pytest.raises(CommandRejectedError, match="aborted"):
        robot.control(wave(150))


def test_an_arm_angle_of_zero_can_be_commanded(make_robot):
    peer, robot = make_robot()

    def callback(state, t):
        return CartesianPosition(state.T_base_tool_c, psi=0.0, finished=t >= 0.005)

    robot.control(callback, mode="cartesian_position")
    assert all(packet.psi_valid and packet.psi_c == 0.0 for packet in peer.commands)


def test_a_cartesian_callback_that_fails_is_brought_to_rest_within_its_limits(make_robot):
    peer, robot = make_robot()

    def callback(state, t):
        if t > 0.1:
            raise LookupError("mine")
        T = np.eye(4)
        T[0, 3] = 0.05 * (1.0 - np.cos(10.0 * t)) / 2.0
        return CartesianPosition(T)

    with pytest.raises(LookupError):
        robot.control(callback, mode="cartesian_impedance")
    x = np.array([packet.T_base_tool_c[3] for packet in peer.commands])
    assert abs(x[-1] - x[-2]) < 1e-9
    assert np.abs(np.diff(x, 2)).max() / 1e-6 <= MODEL.limits.cartesian.translation_acceleration
    assert np.abs(np.diff(x, 3)).max() / 1e-9 <= MODEL.limits.cartesian.translation_jerk


def test_a_first_torque_beyond_one_cycles_rate_is_not_sent(make_robot):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=r"joint 2 begins with -1\.5 N m, .* less than 1\.5 N m"):
        robot.control(lambda state, t: JointTorque(np.array([0, -1.5, 0, 0, 0, 0, 0])), "torque")
    assert peer.commands == []


def test_torques_are_taken_back_within_their_rate_before_an_exception_comes_out(make_robot):
    peer, robot = make_robot()

    def callback(state, t):
        if t > 0.02:
            raise LookupError("mine")
        return JointTorque(np.full(7, 500.0 * t))

    with pytest.raises(LookupError):
        robot.control(callback, "torque")
    tau = np.array([packet.tau_c for packet in peer.commands])
    assert not tau[-1].any()
    assert (np.abs(np.diff(tau, axis=0)) < MODEL.limits.joint.torque_rate * 1e-3).all()


def test_a_fault_of_a_cartesian_motion_is_told_with_its_numbers(make_robot):
    _, robot = make_robot(Script(fault_at=40, fault=Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION))

    def callback(state, t):
        T = np.eye(4)
        T[0, 3] = 20.0 * t * t  # 1 m/s is passed at t = 25 ms.
        return CartesianPosition(T, 0.0)

    with pytest.raises(ControlError, match=r"commanded .*1\.\d+ m/s passes 1 m/s in the command at t = 0\.02"):
        robot.control(callback, "cartesian_position")


def test_commands_of_every_kind_are_on_record(make_robot, tmp_path):
    _, robot = make_robot()
    psi = lambda t: 1e-9 * t * (t < 0.02)  # noqa: E731  # The peer's arm does not move: it has to end where it began.
    run = robot.control(lambda state, t: CartesianPosition(np.eye(4), psi(t), t >= 0.02), "cartesian_impedance")
    assert np.array_equal(run.command_pose, np.broadcast_to(np.eye(4), (len(run.t), 4, 4)))
    assert np.array_equal(run.command_psi, psi(run.t))
    assert np.isnan(run.command).all()
    run.save(tmp_path / "run.csv")
    assert len((tmp_path / "run.csv").read_text().splitlines()) == len(run.t) + 1
    run = robot.control(lambda state, t: JointTorque(np.ones(7) * 5e-4 * (t < 0.02), t >= 0.02), "torque")
    assert np.array_equal(run.command_tau[:, 0], 5e-4 * (run.t < 0.02))


def test_a_low_pass_ends_at_the_last_command_and_may_be_stopped_on_its_way(make_robot):
    peer, robot = make_robot()
    run = robot.control(wave(200, size=0.1), cut_off=20.0)
    assert run.command[-1][0] == peer.script.q[0] + 0.1
    assert_controlled_stop(peer)
    last = peer.script.q[0] + 0.1
    slow = wave(200, size=0.1)

    def callback(state, t):
        command = slow(state, t)
        if command.finished:
            robot.stop()
        return command

    run = robot.control(callback, cut_off=1.0)
    assert run.stopped == "on request"
    assert last < run.command[-1][0] < last + 0.1
    assert_controlled_stop(peer)
