"""The session against a scripted controller on real sockets."""

from __future__ import annotations

import math
import socket
import threading
import time

import numpy as np
import pytest

from rcilab.cli import _build_parser
from rcilab.client import connect
from rcilab.client.identify import require_same_arm
from rcilab.client.session import open_session
from rcilab.command import CartesianPosition, JointPosition
from rcilab.conformance import check
from rcilab.errors import (
    CertificateError,
    CommandRejectedError,
    ConnectionLostError,
    ControlError,
    DeadlineError,
    InvalidValueError,
    ModelError,
    UsageError,
)
from rcilab.faults import Fault
from rcilab.model import load_model
from rcilab.motion import plan_joint
from rcilab.protocols import rci
from rcilab.spatial import Pose
from tests.client.peer import HOST, Peer, Script

MODEL = load_model("xMatePro7")
REST = plan_joint(MODEL, MODEL.home, MODEL.home)


@pytest.fixture
def make_robot():
    opened = []

    def make(script: Script | None = None, silence: float = 5.0):
        peer = Peer(script)
        opened.append(peer)
        # As `simulate` does: the peer waits for us, and a busy machine may pause either side.
        robot = open_session(peer.url, MODEL, 1.0, realtime=False, silence=silence)
        opened.append(robot)
        return peer, robot

    yield make
    for thing in reversed(opened):
        thing.close()


def wave(cycles: int, joint: int = 0, size: float = 0.02):
    """Returns a callback that turns a joint by `size` with the least jerk."""
    s = np.arange(cycles + 1) / cycles
    rows = size * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
    start = {}

    def callback(state, t):
        start.setdefault("q", state.q_c)
        k = min(round(t / 0.001), cycles)
        q = np.array(start["q"])
        q[joint] += rows[k]
        return JointPosition(q, finished=k == cycles)

    return callback


def test_every_command_reaches_the_controller_as_the_protocol_spells_it(make_robot):
    peer, robot = make_robot()
    robot.power_on()
    assert robot.get_motor_state() is True
    robot.set_cartesian_limit([1.0, 1.0, 1.0], Pose())
    robot.set_joint_limit(MODEL.limits.joint.lower, MODEL.limits.joint.upper)
    robot.set_collision_behavior(MODEL.limits.joint.collision_threshold)
    robot.set_joint_impedance(MODEL.limits.joint.stiffness)
    robot.set_cartesian_impedance([3000, 3000, 3000, 300, 300, 300])
    robot.set_coor(Pose((0.0, 0.0, 0.1)))
    robot.set_load(1.0, [0.0, 0.0, 0.05], np.eye(3) * 0.01)
    robot.set_cart_imp_desired_tau([1, 2, 3, 4, 5, 6])
    robot.set_filters(100.0, 200.0, 300.0)
    robot.set_torque_filter_cut_off_frequency(50.0)
    robot.automatic_error_recovery()
    assert robot.load_robot_model().dh[2] == 404.0
    robot.set_fc_coor(Pose(), rci.ForceFrame.WORLD)
    robot.enable_virtual_guide(True)
    robot.set_do(5, True)
    assert robot.get_di(0) is True
    robot.start_drag(rci.DragSpace.CARTESIAN, rci.DragType.TRANSLATION)
    robot.stop_drag()
    assert robot.get_safety_stop_state() is rci.SafetyStop.GSTOP
    robot.reboot_robot()
    robot.power_off()
    sent = [type(request) for request in peer.requests]
    assert set(sent) == set(rci.REQUESTS.values()) - {rci.Connect, rci.StartMove, rci.StopMove}
    assert peer.requests[-1] == rci.SetMotorPower(0)


@pytest.mark.parametrize(
    ("call", "hint"),
    [
        (lambda r: r.set_joint_impedance([1.0] * 6), r"needs \(7,\)"),
        (lambda r: r.set_joint_impedance([np.nan] * 7), "finite"),
        (lambda r: r.set_joint_impedance([1, 1, 1, 1, 1, 1, 301]), r"stiffness\[7\]: 301.0 is outside 0 to 300"),
        (lambda r: r.set_cartesian_limit([1, 0, 1], Pose()), "above 0"),
        (lambda r: r.set_joint_limit([1] * 7, [0] * 7), "below upper"),
        (lambda r: r.set_filters(1001, 1, 1), "0 to 1000"),
        (lambda r: r.set_do(6, True), "0 to 5"),
        (lambda r: r.set_load(-1, [0, 0, 0], np.eye(3)), "negative"),
        (lambda r: r.set_load(100, [0, 0, 0], np.eye(3)), "load mass: 100.* kg is above 7 kg for xMatePro7"),
        (lambda r: r.set_coor(None), "Pose"),
        (lambda r: r.set_cartesian_limit([1, 1, 1], "x"), "center: 'x' must be a Pose"),
        (lambda r: r.set_motor_power("no"), "True or False"),
        (lambda r: r.receive_state(0), "timeout: 0 must be above 0"),
        (lambda r: r.execute(None), "motion: None is no motion"),
        (lambda r: r.execute(REST, check(REST, MODEL)), r"pass report\.certificate, not the report"),
    ],
)
def test_a_bad_argument_is_named_and_not_sent(make_robot, call, hint):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=hint):
        call(robot)
    assert peer.requests == [rci.LoadRobotModel()]  # Asked by connect.


def test_a_refusal_says_what_to_do(make_robot):
    _, robot = make_robot(Script(statuses={rci.StartMove: rci.StartStatus.NOT_POSSIBLE}))
    with pytest.raises(CommandRejectedError, match="power_on") as caught:
        robot.control(wave(10))
    assert caught.value.status is rci.StartStatus.NOT_POSSIBLE


def test_a_missing_answer_is_a_deadline_error_and_the_session_goes_on(make_robot):
    _, robot = make_robot(Script(silent_requests=(rci.SetDO,)))
    with pytest.raises(DeadlineError, match=r"did not answer SetDO within 1 s"):
        robot.set_do(0, True)
    assert robot.get_motor_state() is True


def test_split_and_stale_answers_are_put_together_and_told_apart(make_robot):
    _, robot = make_robot(Script(split_responses=True, stale_responses=True))
    assert robot.get_motor_state() is True
    assert robot.load_robot_model().dh[2] == 404.0
    assert robot.get_motor_state() is True


def test_without_a_model_the_controller_is_asked_which_arm_it_is():
    with Peer() as peer, connect(peer.url) as robot:
        assert robot.model.name == "xMatePro7"
        assert robot.state.q.shape == (7,)


@pytest.mark.parametrize("name", ["xMate3", "xMate7", "xMatePro3"])
def test_another_arm_than_the_controller_s_is_refused_and_both_are_named(name):
    model = load_model(name)
    with Peer() as peer:
        with pytest.raises(ModelError, match=rf"is an xMatePro7 \(7 axes\), you gave {name} \({model.n}\)") as caught:
            connect(peer.url, model)
        assert "load_model('xMatePro7')" in str(caught.value)
        assert peer.requests == [rci.LoadRobotModel()]


def test_an_unknown_arm_must_have_the_given_lengths_up_to_a_calibration():
    lengths = [(0.0, d) for d in (0.404, 0.0, 0.4375, 0.0, 0.4125, 0.0, 0.2755)]
    served = [number for _, d in lengths for number in (0.0, 0.0, 1000.0 * d + 0.8, 0.0)]
    require_same_arm(served, "xMatePro7", lengths, "rci://x")
    require_same_arm([0.0] * 28, "xMatePro7", lengths, "rci://x")
    served[2] += 20.0
    with pytest.raises(ModelError, match=r"7 axes with the DH lengths d 424\.8, .* you gave xMatePro7 \(7 axes, 404,"):
        require_same_arm(served, "xMatePro7", lengths, "rci://x")


@pytest.mark.parametrize("timeout", [-1, 0, math.nan, math.inf, "a", None, True])
def test_a_timeout_that_is_no_time_is_named(timeout):
    with pytest.raises(InvalidValueError, match=r"timeout: .* above 0 \[s\]"):
        connect("rci://127.0.0.2:9", timeout=timeout)


def test_the_name_of_a_model_is_no_model():
    with pytest.raises(InvalidValueError, match=r"use load_model\('xMatePro7'\)"):
        connect("rci://127.0.0.2:9", "xMatePro7")


@pytest.mark.parametrize(
    "change", [lambda r: r.set_coor(Pose((0.0, 0.0, 0.1))), lambda r: r.set_load(2, [0, 0, 0], np.eye(3))]
)
def test_another_tool_or_load_makes_a_certificate_stale(make_robot, change):
    peer, robot = make_robot()
    rest = plan_joint(robot.model, peer.script.q, peer.script.q)
    certificate = check(rest, robot.model).certificate
    change(robot)
    with pytest.raises(CertificateError, match=r"stale: (tool|load) has changed"):
        robot.execute(rest, certificate)
    assert robot.execute(rest, check(rest, robot.model).certificate).stopped is None


def test_a_refused_tool_leaves_the_model_as_it_is(make_robot):
    _, robot = make_robot(Script(statuses={rci.SetCoor: rci.SettingStatus.INVALID_ARGUMENT}))
    with pytest.raises(CommandRejectedError):
        robot.set_coor(Pose((0.0, 0.0, 0.1)))
    assert robot.model.fingerprint == MODEL.fingerprint


def test_whoever_calls_in_mid_motion_is_refused_and_the_motion_goes_on(make_robot):
    peer, robot = make_robot()
    refused = []

    def disturb():
        for call in (robot.receive_state, robot.recover, robot.power_off, lambda: robot.set_coor(Pose()),
                     robot.get_motor_state, lambda: robot.control(wave(10))):  # fmt: skip
            with pytest.raises(UsageError, match="a motion is running already") as caught:
                call()
            refused.append(caught.value)
        assert robot.state.message_id > 0

    other = threading.Thread(target=disturb)
    good = wave(400)

    def callback(state, t):
        if round(t * 1000) == 100:
            disturb()
            other.start()
        if round(t * 1000) == 350:
            other.join()
        return good(state, t)

    run = robot.control(callback)
    assert len(refused) == 12
    assert run.stopped is None
    assert run.timing.lost == 0
    assert [type(request) for request in peer.requests] == [rci.LoadRobotModel, rci.StartMove, rci.StopMove]


@pytest.mark.parametrize("from_callback", [True, False])
def test_closing_in_mid_motion_brings_the_arm_to_rest_first(make_robot, from_callback):
    peer, robot = make_robot()
    other = threading.Thread(target=robot.close)
    good = wave(400, size=0.2)

    def callback(state, t):
        if round(t * 1000) == 200:
            robot.close() if from_callback else other.start()
        return good(state, t)

    run = robot.control(callback)
    if not from_callback:
        other.join()
    assert run.stopped == "the session was closed while a motion ran"
    assert_controlled_stop(peer)
    with pytest.raises(UsageError, match="closed; connect again"):
        robot.power_on()


def test_a_stopped_run_is_not_compared_with_the_plan_it_left(make_robot):
    peer, robot = make_robot()
    motion = plan_joint(MODEL, peer.script.q, MODEL.home, speed=0.5)
    run = robot.execute(motion, progress=lambda t, duration: robot.stop() if t > 0.1 else None)
    assert run.stopped == "on request"
    assert "largest error 0 deg" in repr(run)
    assert "<td>0 deg" in run._repr_html_()


def test_two_threads_may_ask_in_turn(make_robot):
    _, robot = make_robot()
    states, errors = [], []

    def ask():
        try:
            states.extend(robot.receive_state() for _ in range(20))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert len(states) == 40


def test_a_client_that_is_turned_away_hears_of_the_other_one():
    with socket.create_server((HOST, 0)) as server:
        turn_away = threading.Thread(target=lambda: server.accept()[0].close())
        turn_away.start()
        with pytest.raises(ConnectionLostError, match="probably because another client is connected: it takes one"):
            connect(f"rci://{HOST}:{server.getsockname()[1]}", MODEL, timeout=2.0)
        turn_away.join()


def test_nobody_there_names_address_and_timeout_and_what_to_check():
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(
        ConnectionLostError, match=rf"no robot at rci://{HOST}:{port} .*of 0\.5 s.*teach pendant"
    ) as caught:
        connect(f"rci://{HOST}:{port}", MODEL, timeout=0.5)
    advice = str(caught.value).rpartition("rcilab ")[2]
    assert _build_parser().parse_args(advice.split()).model == "xMatePro7"


def test_a_controller_that_sends_no_states_is_told_apart():
    with Peer(Script(silent_at=0)) as peer, pytest.raises(ConnectionLostError, match=r"sent no state to 127\.0\.0\.1"):
        connect(peer.url, MODEL, timeout=0.3)


def test_a_second_client_is_told_that_the_port_is_taken(make_robot):
    peer, _ = make_robot()
    with pytest.raises(ConnectionLostError, match="another client"):
        connect(peer.url, MODEL, timeout=0.5)


def test_garbage_for_an_answer_is_a_lost_connection():
    with socket.create_server((HOST, 0)) as server:
        port = server.getsockname()[1]
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with pytest.raises(DeadlineError, match="did not answer LoadRobotModel"):
            connect(f"rci://{HOST}:{port}", MODEL, timeout=0.2)
        udp.close()


def test_short_long_and_foreign_datagrams_are_ignored(make_robot):
    def litter(udp, to):
        for size in (0, 1, 1246, 1248, 2000):
            udp.sendto(bytes(size), to)
        udp.sendto(b"\xff" * 1247, to)

    _peer, robot = make_robot(Script(on_state=litter))
    run = robot.control(wave(20))
    assert len(run.t) > 20
    assert robot.state.message_id > 1000


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
    run = robot.control(wave(50, joint=2))
    assert np.array_equal(run.q_c[-1], run.command[-1])
    assert np.abs(run.q_c[:, 2]).max() == pytest.approx(0.3 + 0.02, abs=1e-12)


def test_a_first_command_elsewhere_names_the_joint_and_both_angles(make_robot):
    peer, robot = make_robot()
    with pytest.raises(InvalidValueError, match=r"joint 2 is commanded to .* deg and stands at 11\.4592 deg"):
        robot.control(lambda state, t: JointPosition(state.q_c + np.array([0, 0.1, 0, 0, 0, 0, 0])))
    assert peer.commands == []
    assert isinstance(peer.requests[-1], rci.StopMove)


@pytest.mark.parametrize(
    ("bad", "hint"),
    [
        (
            lambda q: JointPosition([0, 0, np.nan, 0, 0, 0, 0]),
            r"command at t = 0\.201 s: .*nan.* in joint 3: must be finite",
        ),
        (lambda q: JointPosition(np.zeros(6)), r"needs \(7,\)"),
        (lambda q: JointPosition([1.0, [2.0]]), "is not"),
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
    assert robot.get_motor_state() is True


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
    with pytest.raises(ControlError, match=r"COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION.*rad/s") as caught:
        robot.control(wave(400))
    assert caught.value.faults == (Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,)
    assert len(caught.value.record) > 30
    assert caught.value.record["faults"][-1] == 1 << 10
    assert isinstance(peer.requests[-1], rci.StopMove)
    robot.recover()
    assert robot.control(wave(30)).faults == ()


def test_a_motion_that_the_controller_ends_by_itself_is_an_error(make_robot):
    _, robot = make_robot(Script(end_at=40))
    with pytest.raises(ControlError, match="ended the motion by itself"):
        robot.control(wave(400))


def test_silence_in_mid_motion_is_a_lost_connection(make_robot):
    peer, robot = make_robot(Script(silent_at=30), silence=0.3)
    start = time.monotonic()
    with pytest.raises(ConnectionLostError, match=r"no state for 0\.3 s"):
        robot.control(wave(400))
    assert time.monotonic() - start < 5.0
    assert isinstance(peer.requests[-1], rci.StopMove)


def test_a_refused_stop_is_not_swallowed(make_robot):
    _, robot = make_robot(Script(statuses={rci.StopMove: rci.StopStatus.ABORTED}))
    with pytest.raises(CommandRejectedError, match="aborted"):
        robot.control(wave(10))


def test_a_closed_session_says_so(make_robot):
    _, robot = make_robot()
    robot.close()
    robot.close()
    for call in (robot.receive_state, robot.power_on, robot.get_motor_state, robot.recover, lambda: robot.state,
                 lambda: robot.set_do(0, 1), lambda: robot.control(wave(10)), lambda: robot.execute(REST)):  # fmt: skip
        with pytest.raises(UsageError, match="closed; connect again"):
            call()


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


def assert_controlled_stop(peer: Peer) -> None:
    """What was commanded ends at rest and keeps velocity, acceleration and jerk limits to its last sample."""
    q = np.array([packet.q_c for packet in peer.commands])
    limits = MODEL.limits.joint
    assert np.abs(np.diff(q, axis=0)[-1]).max() < 1e-9
    assert (np.abs(np.diff(q, axis=0)) / 1e-3 <= limits.velocity).all()
    assert (np.abs(np.diff(q, 2, axis=0)) / 1e-6 <= limits.acceleration).all()
    assert (np.abs(np.diff(q, 3, axis=0)) / 1e-9 <= limits.jerk).all()
    assert isinstance(peer.requests[-1], rci.StopMove)
