"""The controller on real sockets, with a scripted peer that behaves as the vendor's client does.

The peer binds its UDP port on every address, reads a response with one call of exactly the expected size, answers old
states in a burst, answers the last state again when none comes, sends garbage where its library sends uninitialised
memory, and announces the end of a motion over TCP alone. Motions run in lock-step: no result depends on the clock.
"""

from __future__ import annotations

import math
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, ModelError, UsageError
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.robot_model import load_model
from rcilab.motion.joint import plan_joint
from rcilab.realtime.scheduling import Scheduling
from rcilab.sim import arm_server
from rcilab.sim.api import Stall
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.streamed_motion import TORQUE_PREFILL

PATIENCE = 10.0  # [s] A peer that waits longer than this has found a bug, or the machine has stopped.
MODEL = load_model("xMatePro7")
MOTION = plan_joint(MODEL, MODEL.home, MODEL.home + 0.15, speed=1.0)


ROUTINE = ("connected", "disconnected", "power_on", "power_off", "motion_started", "motion_ended")
"""Kinds of log entries that every program causes."""


class Running:
    """A server in a thread of its own, with its log."""

    def __init__(self, **options: object) -> None:
        self.entries: list[LogEntry] = []
        config = ControllerConfig(**{"model": "xMatePro7", "port": 0, "realtime": False, **options})  # type: ignore[arg-type]
        self.server = build_virtual_controller(config, log=self.entries.append)
        address = self.server.url.removeprefix("rci://").partition("?")[0]
        self.host, port = address.split(":")
        self.port = int(port)
        self.thread = threading.Thread(target=self.server.run)

    @property
    def lines(self) -> list[str]:
        """The texts of its log, without those of routine."""
        return [entry.text for entry in self.entries if entry.kind not in ROUTINE]

    def wait_for_line(self, text: str) -> str:
        pause = threading.Event()
        for _ in range(int(PATIENCE / 0.01)):
            for entry in list(self.entries):
                if text in entry.text:
                    return entry.text
            pause.wait(0.01)
        raise AssertionError(f"no line with {text!r} in {self.entries}")


@contextmanager
def running(**options: object) -> Iterator[Running]:
    found = Running(**options)
    found.thread.start()
    try:
        yield found
    finally:
        found.server.request_stop()
        found.thread.join(PATIENCE)
        assert not found.thread.is_alive()


class Peer:
    """The vendor's client, as far as the wire sees it."""

    def __init__(self, running: Running, *, udp: socket.socket | None = None) -> None:
        self.controller = (running.host, running.port)
        self.udp = udp if udp is not None else bind_udp(running.port)
        self.tcp = socket.create_connection(self.controller, timeout=PATIENCE)
        self.tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.command_id = 0
        self.seen: list[RobotState] = []

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *_: object) -> None:
        self.udp.close()
        self.tcp.close()

    def receive_state(self) -> RobotState:
        datagram = self.udp.recv(1247)
        assert len(datagram) == 1247
        self.seen.append(rci.decode_state(datagram, 7))
        return self.seen[-1]

    def receive_newest_state(self) -> RobotState:
        self.receive_state()
        self.udp.setblocking(False)
        try:
            while True:
                self.receive_state()
        except BlockingIOError:
            return self.seen[-1]
        finally:
            self.udp.settimeout(PATIENCE)

    def receive_live_state(self) -> RobotState:
        """After a motion: a full socket buffer holds old states only, so it is emptied before one is waited for."""
        self.receive_newest_state()
        return self.receive_newest_state()

    def ask(self, request: rci.Request) -> object:
        self.command_id += 1
        self.tcp.sendall(rci.encode_request(request, self.command_id))
        return self.read_answer(request, self.command_id)

    def read_answer(self, request: rci.Request, command_id: int) -> object:
        sizes = {rci.CommandCode.GET_DI_STATE: 12, rci.CommandCode.LOAD_ROBOT_MODEL: 1291}
        size = sizes.get(request.code, 11)
        frame = self.tcp.recv(size)  # One call, as the vendor's client reads.
        assert len(frame) == size
        found_id, response = rci.decode_response(request.code, frame)
        assert found_id == command_id
        return getattr(response, "status", response)

    def send(self, message_id: int, q: np.ndarray) -> None:
        packet = rci.CommandPacket(message_id, tuple(q.tolist()))
        self.udp.sendto(rci.encode_command(packet), self.controller)

    def start(self) -> RobotState:
        """Powers on, starts a joint motion and reads states, oldest first, until the modes are shown."""
        assert self.ask(rci.SetMotorPower(1)) == 0
        assert self.ask(rci.StartMove(0, 1)) in (0, 1)
        while True:
            state = self.receive_state()
            if state.controller_mode == 0 and state.motion_generator_mode == 1:
                return state

    def run(self, rows: np.ndarray) -> RobotState:
        """Answers state after state with the rows; states that repeat one already answered are skipped."""
        state = self.start()
        for row in rows:
            self.send(state.message_id, row)
            answered = state.message_id
            while state.message_id == answered:
                state = self.receive_state()
                assert not state.faults
        return state


def bind_udp(port: int, address: str = "0.0.0.0") -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.bind((address, port))
    sock.settimeout(PATIENCE)
    return sock


@pytest.fixture
def lockstep() -> Iterator[Running]:
    with running(lockstep=True) as found:
        yield found


def test_the_first_state_is_there_before_anything_is_asked(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.receive_state()
        assert np.array_equal(state.q, MODEL.home)
        assert (state.motion_generator_mode, state.controller_mode) == (0, 5)


def test_states_stream_on_with_rising_numbers(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        ids = [peer.receive_state().message_id for _ in range(50)]
        assert ids[1:] == list(range(ids[1], ids[1] + 49))


def test_a_whole_motion_of_the_vendors_client(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        peer.run(MOTION.q)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        state = peer.receive_newest_state()
        assert np.array_equal(state.q, MOTION.goal)
        assert (state.motion_generator_mode, state.controller_mode, state.robot_mode) == (0, 5, 1)
        assert peer.ask(rci.SetMotorPower(0)) == 0
        assert peer.ask(rci.GetMotorState()) == rci.MotorStateResponse(0)
    assert lockstep.server.controller.playout.lost == 0


def test_every_request_is_answered_once_with_its_id_in_one_piece(lockstep: Running) -> None:
    pose = (1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.1, 0, 0, 0, 1)
    with Peer(lockstep) as peer:
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.ask(rci.GetMotorState()) == rci.MotorStateResponse(1)
        assert peer.ask(rci.StopMove()) == 0
        assert peer.ask(rci.SetCartesianLimit((1, 1, 1), pose)) == 0
        assert peer.ask(rci.SetJointLimit((1.0,) * 7, (-1.0,) * 7)) == 0
        assert peer.ask(rci.SetCollisionBehavior((10.0,) * 7)) == 0
        assert peer.ask(rci.SetCollisionBehavior((math.nan,) * 7)) == 2
        assert peer.ask(rci.SetJointImpedance((100.0,) * 7)) == 0
        assert peer.ask(rci.SetCartesianImpedance((100.0,) * 6)) == 0
        assert peer.ask(rci.SetCoor(pose)) == 0
        assert peer.ask(rci.SetLoad(1.0, (0, 0, 0.1), (0.0,) * 9)) == 0
        assert peer.ask(rci.SetCartImpDesiredTau((1.0,) * 6)) == 0
        assert peer.ask(rci.SetFilters(10, 20, 30)) == 0
        assert peer.ask(rci.SetTorqueFilterCutOffFrequency(10)) == 0
        assert peer.ask(rci.AutomaticErrorRecovery()) == 0
        assert isinstance(peer.ask(rci.LoadRobotModel()), rci.GuideStatus)
        assert peer.ask(rci.SetFcCoor(pose, 1)) == 0
        assert peer.ask(rci.EnableVirtualGuide(True, tuple(range(200, 248)))) == 0
        assert peer.ask(rci.SetDO(3, True)) == 0
        assert peer.ask(rci.GetDIState(3)) == 0
        assert peer.ask(rci.StartDrag(1, 2)) == 0
        assert peer.ask(rci.StopDrag()) == 0
        assert peer.ask(rci.GetSafetyStopState()) == rci.SafetyStopResponse(rci.SafetyStop.NONE)
        assert peer.ask(rci.StartMove(4, 2)) is rci.StartStatus.NOT_POSSIBLE


def test_ninety_commands_at_once_with_old_ids_are_the_motion_they_are(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        while peer.receive_state().message_id < 1000:
            pass
        state = peer.start()
        for k, row in enumerate(MOTION.q[:91]):
            peer.send(state.message_id - 1000 + k, row)
        for row in MOTION.q[91:]:
            state = peer.receive_state()
            assert not state.faults
            peer.send(state.message_id, row)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert np.array_equal(peer.receive_live_state().q, MOTION.goal)
    assert lockstep.server.controller.playout.lost == 0


def test_commands_that_answer_the_same_state_again_are_the_next_ones(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.start()
        for k, row in enumerate(MOTION.q):
            if k % 5 == 0:  # "No state within a millisecond": the old id goes out with the next command.
                state = peer.receive_newest_state()
            peer.send(state.message_id, row)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        last = peer.receive_live_state()
        assert not last.faults
        assert np.array_equal(last.q, MOTION.goal)


def start_torque(peer: Peer) -> RobotState:
    assert peer.ask(rci.SetMotorPower(1)) == 0
    assert peer.ask(rci.StartMove(4, 0)) in (0, 1)
    while (state := peer.receive_state()).controller_mode != ControllerMode.TORQUE:
        pass
    return state


def send_torque(peer: Peer, message_id: int, tau: float) -> None:
    packet = rci.CommandPacket(message_id, tau_c=(tau,) + (0.0,) * 6)
    peer.udp.sendto(rci.encode_command(packet), peer.controller)


def receive_next_state(peer: Peer, answered: RobotState) -> RobotState:
    """One after the other, as the vendor's client does; a state is repeated until the first command arrives."""
    while (state := peer.receive_state()).message_id == answered.message_id:
        pass
    assert not state.faults
    return state


@pytest.mark.parametrize("every", [1, 7])
def test_torques_that_answer_the_same_state_again_are_the_next_ones(lockstep: Running, every: int) -> None:
    """The vendor's client sends a second command for a state when the next one takes more than 5 ms."""
    taken: list[float] = []
    lockstep.server.controller.arm.on_command = lambda command: taken.append(command.tau[0])
    with Peer(lockstep) as peer:
        state = start_torque(peer)
        sent: list[float] = []
        for k in range(210):
            for _ in range(1 + (k % every == 0)):
                sent.append(1e-4 * (1 + len(sent)))
                send_torque(peer, state.message_id, sent[-1])
            state = receive_next_state(peer, state)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    playout = lockstep.server.controller.playout
    assert taken == sent
    assert (playout.late, playout.lost, playout.cycles) == (0, 0, len(sent))


def assert_no_state(peer: Peer) -> None:
    time.sleep(0.05)
    peer.udp.setblocking(False)
    with pytest.raises(BlockingIOError):
        peer.udp.recv(1247)
    peer.udp.settimeout(PATIENCE)


def test_in_lock_step_no_state_is_sent_before_the_newest_one_is_answered(lockstep: Running) -> None:
    """The vendor's client keeps what it does not read, and would begin its next motion with it."""
    with Peer(lockstep) as peer:
        state = start_torque(peer)
        for _ in range(10):
            send_torque(peer, state.message_id, 0.0)
            state = receive_next_state(peer, state)
        assert_no_state(peer)


def test_in_lock_step_the_cycle_of_a_second_answer_sends_no_state(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.run(MOTION.q[:10])
        peer.send(state.message_id - 1, MOTION.q[10])
        assert_no_state(peer)
        peer.send(state.message_id, MOTION.q[11])
        following = peer.receive_state()
        assert following.message_id == state.message_id + 1
        assert np.array_equal(following.q_c, MOTION.q[11])
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    ended = next(entry for entry in lockstep.entries if entry.kind == "motion_ended")
    assert ended.facts["repeated"] == 1
    assert ended.text.endswith("; 1 answered a state again because the next one came late")


def test_in_lock_step_few_copies_of_the_first_state_await_a_client_that_sleeps(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        first = peer.start()
        time.sleep(0.5)
        peer.receive_newest_state()
        assert 2 <= sum(state.message_id == first.message_id for state in peer.seen) <= 8


def test_in_lock_step_the_controller_has_priority_where_permitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A client waits only briefly for the next state, and then answers the last one again."""
    refused = Scheduling(policy="normal", priority=0, memory_locked=False, warning="not granted")
    asked: list[int] = []
    monkeypatch.setattr(arm_server, "enter_realtime", lambda priority: (asked.append(priority), refused)[1])
    monkeypatch.setattr(arm_server, "leave_realtime", lambda: None)
    with running(lockstep=True, realtime=True) as found, Peer(found) as peer:
        peer.receive_state()
    assert asked == [arm_server.PRIORITY]
    assert found.lines == []


def test_in_lock_step_a_recorder_that_is_behind_gets_time_in_each_cycle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arm_server.CycleCapture, "is_crowded", True)
    with running(lockstep=True, is_recorded=True) as found, Peer(found) as peer:
        began = time.monotonic()
        peer.run(MOTION.q[:300])
        assert time.monotonic() - began >= 300 * 0.0005
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS


def test_in_lock_step_a_torque_acts_as_late_as_by_the_clock(lockstep: Running) -> None:
    """Two cycles later than without a delay: the step of a torque is in the third state after the one it answers."""
    with Peer(lockstep) as peer:
        state = start_torque(peer)
        for k in range(20):
            send_torque(peer, state.message_id, 1e-4 * (k + 1) if k < 10 else 0.5)
            state = receive_next_state(peer, state)
            if k == 10:
                step = state.message_id - 1
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        first = next(state for state in peer.seen if state.tau_c[0] == 0.5)
    assert first.message_id == step + 1 + TORQUE_PREFILL


def test_garbage_in_unused_fields_changes_nothing(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.start()
        for row in MOTION.q:
            packet = rci.CommandPacket(
                state.message_id, tuple(row), (math.nan,) * 16, True, math.inf, False, (math.nan,) * 7
            )
            peer.udp.sendto(rci.encode_command(packet), peer.controller)
            state = peer.receive_state()
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert np.array_equal(peer.receive_live_state().q, MOTION.goal)


def test_datagrams_of_another_size_are_counted_and_ignored(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.start()
        for junk in (b"", b"x", bytes(289), bytes(291), bytes(1247), bytes(4000)):
            peer.udp.sendto(junk, peer.controller)
        peer.send(state.message_id, MODEL.home)
        while peer.receive_state().message_id == state.message_id:
            pass
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert lockstep.server.bad_datagrams == 6
    assert lockstep.lines == [  # Five in 10 s.
        f"ignored a datagram of {size} bytes: a command of this RCI has 290; the client may have another version"
        for size in (0, 1, 289, 291, 1247)
    ]


def test_requests_split_into_single_bytes_and_joined_into_one_are_understood(lockstep: Running) -> None:
    first, second = rci.SetDO(1, True), rci.GetSafetyStopState()
    with Peer(lockstep) as peer:
        for byte in rci.encode_request(first, 1):
            peer.tcp.sendall(bytes([byte]))
            peer.receive_state()
        assert peer.read_answer(first, 1) == 0
        peer.tcp.sendall(rci.encode_request(first, 2) + rci.encode_request(rci.StopMove(), 3))
        assert peer.read_answer(first, 2) == 0
        assert peer.read_answer(rci.StopMove(), 3) == 0
        peer.command_id = 3
        assert peer.ask(second) == rci.SafetyStopResponse(rci.SafetyStop.NONE)


def closes(sock: socket.socket) -> bool:
    try:
        return sock.recv(100) == b""
    except ConnectionResetError:
        return True


@pytest.mark.parametrize(
    "garbage",
    [b"GET / HTTP/1.1\r\n\r\n", bytes(20), b"\x00\x0a" + bytes(4) + b"\x00\x00\x00\x63", b"\x00\x0c" + bytes(10)],
    ids=["http", "zeros", "unknown command", "short payload"],
)
def test_garbage_on_tcp_closes_that_connection_with_one_line_and_nothing_else(lockstep: Running, garbage) -> None:
    with Peer(lockstep) as peer:
        if garbage[:2] == b"\x00\x0c":
            garbage = garbage[:9] + b"\x01" + garbage[10:]  # SetMotorPower with two bytes.
        peer.tcp.sendall(garbage)
        assert closes(peer.tcp)
        lockstep.wait_for_line("not valid RCI")
    assert len(lockstep.lines) == 1
    with Peer(lockstep) as peer:
        assert peer.ask(rci.SetMotorPower(1)) == 0


def stop_is_smooth(states: list[RobotState]) -> bool:
    unique = {state.message_id: state.q_c for state in states}
    q = np.array([unique[k] for k in sorted(unique)])
    assert sorted(unique) == list(range(min(unique), max(unique) + 1))
    ddq, jerk = np.diff(q, 2, axis=0) * 1e6, np.diff(q, 3, axis=0) * 1e9
    limits = MODEL.limits.joint
    return bool((np.abs(ddq) < limits.acceleration).all() and (np.abs(jerk) < limits.jerk).all())


@pytest.mark.parametrize("how", ["close", "reset", "garbage"])
def test_a_client_that_goes_in_mid_motion_leaves_one_controlled_stop(how: str) -> None:
    with bind_udp(0, "127.0.0.1") as watcher:
        port = watcher.getsockname()[1]
        with running(lockstep=True, client_host="127.0.0.1", client_port=port) as found:
            with Peer(found, udp=watcher) as peer:
                peer.run(MOTION.q[:150])
                if how == "reset":
                    peer.tcp.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                if how == "garbage":
                    peer.tcp.sendall(b"oops, a line of text")
                else:
                    peer.tcp.close()
                while peer.receive_state().robot_mode is not RobotMode.IDLE:
                    pass
                assert any(state.dq_c.any() for state in peer.seen[-100:])
                assert not peer.seen[-1].dq_c.any()
                assert not peer.seen[-1].faults
                assert stop_is_smooth(peer.seen)
            assert found.wait_for_line("during a motion: the arm stops").startswith("client 127.0.0.1 ")
    assert len(found.lines) == 1


def test_a_second_client_is_refused_and_the_first_does_not_notice(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        peer.receive_state()
        with socket.create_connection(peer.controller, timeout=PATIENCE) as second:
            assert closes(second)
        lockstep.wait_for_line("refused another client from 127.0.0.1")
        assert peer.ask(rci.SetMotorPower(1)) == 0
    assert len(lockstep.lines) == 1


def test_the_next_client_finds_the_robot_as_it_was_left(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        peer.run(MOTION.q)
        peer.ask(rci.StopMove())
    with Peer(lockstep) as peer:
        assert np.array_equal(peer.receive_live_state().q, MOTION.goal)
        assert peer.ask(rci.GetMotorState()) == rci.MotorStateResponse(1)
    assert lockstep.lines == []


def test_states_stream_to_a_configured_client_from_power_up() -> None:
    with bind_udp(0, "127.0.0.1") as watcher:
        port = watcher.getsockname()[1]
        with running(client_host="127.0.0.1", client_port=port):
            states = [rci.decode_state(watcher.recv(1247), 7) for _ in range(5)]
    assert [state.message_id for state in states] == list(range(1, 6))
    assert states[0].robot_mode is RobotMode.OTHER


def test_connect_tells_the_controller_another_port(lockstep: Running) -> None:
    with Peer(lockstep) as peer, bind_udp(0, "127.0.0.1") as other:
        assert peer.ask(rci.Connect(other.getsockname()[1])) == 0
        assert len(other.recv(2000)) == 1247


def test_a_client_that_falls_silent_is_an_instability_and_one_stop() -> None:
    with running(lockstep=True, lost_limit=10, on_loss="bridge", patience=0.2) as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        while not peer.receive_state().faults:
            pass
        assert peer.seen[-1].faults == (Fault.INSTABILITY_DETECTION,)
        assert peer.seen[-1].success_rate == pytest.approx(150 / 160)
        while peer.seen[-1].dq_c.any() or peer.seen[-1].ddq_c.any():
            peer.receive_state()
        assert stop_is_smooth(peer.seen)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert peer.ask(rci.StartMove(0, 1)) is rci.StartStatus.REFLEX
        assert peer.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.SUCCESS
        assert not peer.receive_newest_state().faults


def test_in_lock_step_a_client_may_stand_in_a_debugger() -> None:
    with running(lockstep=True) as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        peer.udp.settimeout(1.5)
        with pytest.raises(TimeoutError):  # Nothing happens, for longer than any cycle could be late.
            peer.receive_state()
        peer.udp.settimeout(PATIENCE)
        for row in MOTION.q[150:]:
            peer.send(peer.seen[-1].message_id, row)
            peer.receive_state()
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert peer.receive_live_state().faults == ()
        assert found.server.controller.playout.lost == 0


@pytest.mark.parametrize("thinking", [0.0, 0.003])
def test_in_lock_step_a_client_that_fell_behind_catches_up(thinking: float) -> None:
    with running(lockstep=True, lost_limit=None, patience=0.2) as found, Peer(found) as peer:
        states = [peer.run(np.tile(MODEL.home, (20, 1)))]
        states.append(peer.receive_state())  # Patience was over: the cycle of the first one is lost.
        for _ in range(150):  # Every state gets its answer in turn.
            time.sleep(thinking)
            peer.send(states.pop(0).message_id, MODEL.home)
            if not states:
                states.append(peer.receive_state())
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert 1 <= found.server.controller.playout.lost <= 25


def test_in_lock_step_answers_to_repeated_states_do_not_stay_in_stock(lockstep: Running) -> None:
    """While the vendor's client sleeps after StartMove the first state comes again and again; it answers each."""
    with Peer(lockstep) as peer:
        state = peer.start()
        for row in MOTION.q[:40]:
            peer.send(state.message_id, row)
        lag = []
        for row in MOTION.q[40:]:
            state = peer.receive_newest_state()
            peer.send(state.message_id, row)
            lag.append(len(lockstep.server.controller.playout))
        assert max(lag[20:]) <= 2
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        state = peer.receive_live_state()
        assert state.faults == ()
        assert np.array_equal(state.q_c, MOTION.q[-1])


def test_ended_in_mid_motion_it_informs_the_client_with_an_error_bit() -> None:
    with running(lockstep=True, on_loss="bridge") as found, Peer(found) as peer:
        peer.run(MOTION.q[:150])
        found.server.request_stop()
        while not peer.receive_state().faults:
            pass
        assert peer.seen[-1].faults == (Fault.INSTABILITY_DETECTION,)
        while peer.seen[-1].dq_c.any():
            peer.receive_state()
        found.thread.join(PATIENCE)
        assert not found.thread.is_alive()
        assert stop_is_smooth(peer.seen)
        assert closes(peer.tcp)
    assert any("ended during a motion" in line for line in found.lines)


def test_what_an_answer_says_is_in_every_state_after_it() -> None:
    for lockstep in (True, False):
        with running(lockstep=lockstep) as found, Peer(found) as peer:
            for request, mode in (
                (rci.SetMotorPower(1), RobotMode.IDLE),
                (rci.StartDrag(1, 2), RobotMode.GUIDING),
                (rci.StopDrag(), RobotMode.IDLE),
                (rci.SetMotorPower(0), RobotMode.OTHER),
            ):
                assert peer.ask(request) == 0
                peer.receive_newest_state()  # Those before the answer; what comes now was sent after it.
                assert peer.receive_state().robot_mode is mode


def test_refusals_are_told_with_their_reason(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        assert peer.ask(rci.StartMove(0, 1)) is rci.StartStatus.NOT_POSSIBLE
        assert peer.ask(rci.SetCollisionBehavior((math.nan,) * 7)) is rci.SettingStatus.INVALID_ARGUMENT
        lockstep.server.controller.reset(np.zeros(7))
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.ask(rci.StartMove(1, 2)) is rci.StartStatus.SINGULAR_START_POSE
        assert peer.ask(rci.StartMove(0, 0)) is rci.StartStatus.NOT_POSSIBLE
    assert lockstep.lines[3] == "refused StartMove (not possible): there is no controller mode 0 with motion mode 0"
    assert lockstep.lines[:3] == [
        "refused StartMove (not possible): the motors are off",
        "refused SetCollisionBehavior (invalid argument): threshold of joint 1: nan N m is outside 0 to 75 N m",
        "refused StartMove (singular start pose): the arm is stretched or folded: joint 4 is at 0.00 deg",
    ]


def test_a_motion_that_the_machine_held_up_says_so() -> None:
    with running(mode_delay=0.005, stalls=(Stall(duration=0.1, after=0.3),)) as found, Peer(found) as peer:
        state = peer.start()
        q = np.array(state.q_c)
        while found.server.missed < 50:
            peer.send(state.message_id, q)
            state = peer.receive_state()
        assert peer.ask(rci.StopMove()) == 0
        assert "longer than planned" in found.wait_for_line("that motion took")


def test_a_command_that_jumps_is_a_fault_in_the_state_that_answers_it(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        state = peer.start()
        peer.send(state.message_id, MODEL.home + 0.01)
        while peer.receive_state().message_id == state.message_id:
            pass
        answer = peer.seen[-1]
        assert answer.message_id == state.message_id + 1
        assert Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY in answer.faults
        assert answer.controller_mode is ControllerMode.OTHER
        assert answer.motion_generator_mode is MotionGeneratorMode.IDLE
        assert "joint 1: commanded velocity 10 rad/s passes 2.175 rad/s" in lockstep.wait_for_line("the arm stops")


def test_in_lock_step_two_runs_are_the_same_to_the_last_bit() -> None:
    records: list[list[bytes]] = []
    for _ in range(2):
        with running(lockstep=True) as found, Peer(found) as peer:
            first = peer.run(MOTION.q[:1]).message_id
            for state in [peer.seen[-1]]:
                for row in MOTION.q[1:]:
                    peer.send(state.message_id, row)
                    answered = state.message_id
                    while state.message_id == answered:
                        state = peer.receive_state()
            moving = {state.message_id: state for state in peer.seen if state.message_id >= first}
            records.append([rci.encode_state(moving[k])[8:] for k in sorted(moving)])
    assert len(records[0]) >= len(MOTION.q)
    assert records[0] == records[1]


def test_running_free_a_motion_answered_in_time_arrives(capsys: pytest.CaptureFixture[str]) -> None:
    # No loss limit: a busy machine may delay this thread by any number of cycles, and the claim is not about that.
    with running(lost_limit=None, mode_delay=0.01, prefill=100) as found, Peer(found) as peer:
        state = peer.start()
        slow = plan_joint(MODEL, MODEL.home, MODEL.home + 0.01, speed=0.1)
        for row in slow.q:
            peer.send(state.message_id, row)
            state = peer.receive_state()
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert not peer.receive_newest_state().faults


def test_commands_sent_while_the_controller_stood_still_are_made_up_for() -> None:
    """The vendor's client goes on meanwhile; the delay of its commands does not stay."""
    # No loss limit: a busy machine may hold this thread, too, for any number of cycles.
    stall = Stall(duration=0.1, after=0.5)
    with running(lost_limit=None, mode_delay=0.005, prefill=10, stalls=(stall,)) as found, Peer(found) as peer:
        state = peer.start()
        playout, q = found.server.controller.playout, np.array(state.q_c)
        most = sent = 0
        peer.udp.settimeout(0.001)
        for _ in range(20_000):
            try:
                state = peer.receive_state()
            except TimeoutError:
                pass  # It answers the old one again.
            sent += 1
            peer.send(state.message_id, q + 1e-12 * (sent % 2))
            most = max(most, len(playout))
            if most > 30 and len(playout) <= 11:
                break
        assert most > 30
        assert len(playout) <= 11
        peer.udp.settimeout(PATIENCE)
        assert peer.ask(rci.StopMove()) == 0
        assert peer.receive_live_state().faults == ()


def test_a_reboot_is_answered_and_then_ends_the_connection(lockstep: Running) -> None:
    with Peer(lockstep) as peer:
        assert peer.ask(rci.RebootRobot()) == 0
        assert closes(peer.tcp)
    with Peer(lockstep) as peer:
        assert peer.ask(rci.GetMotorState()) == rci.MotorStateResponse(0)


def test_a_tcp_port_in_use_says_what_to_change(lockstep: Running) -> None:
    with pytest.raises(UsageError, match=rf"TCP port {lockstep.port} on 127.0.0.2 is in use.*--port N"):
        build_virtual_controller(ControllerConfig(model="xMate3", port=lockstep.port))


def test_a_udp_port_in_use_says_what_to_change(lockstep: Running) -> None:
    with pytest.raises(UsageError, match=rf"UDP port {lockstep.port} on 127.0.0.2 is in use.*--udp-port N"):
        build_virtual_controller(ControllerConfig(model="xMate3", port=0, udp_port=lockstep.port))


def test_an_address_of_another_machine_is_refused() -> None:
    with pytest.raises(UsageError, match=r"192\.0\.2\.1 is not an address of this machine"):
        build_virtual_controller(ControllerConfig(model="xMate3", port=0, host="192.0.2.1"))


def test_the_url_names_a_udp_port_that_differs() -> None:
    server = build_virtual_controller(ControllerConfig(model="xmate3", port=0, udp_port=0))
    try:
        assert f"?udp_port={server.url.rpartition('=')[2]}" in server.url
        assert server.description == f"listening {server.url} model=xMate3 plant=ideal"
    finally:
        server.close()


def test_an_unknown_arm_lists_the_known_ones() -> None:
    with pytest.raises(ModelError, match="xMatePro3, xMatePro7, xMate3, xMate7"):
        build_virtual_controller(ControllerConfig(model="xMate9", port=0))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"port": 70000}, "port: 70000 is not a valid port"),
        ({"client_port": 0}, "client_port: 0 is not a valid port"),
        ({"host": ""}, "host"),
        ({"plant": "rubber"}, "known: ideal, mujoco"),
        ({"lost_limit": 9}, "needs 10 to 20 cycles"),
        ({"on_loss": "panic"}, "known: hold, bridge"),
        ({"mode_delay": math.nan}, "needs 0 to 5 s"),
        ({"prefill": -1}, "needs 0 to 100 cycles"),
    ],
)
def test_a_configuration_that_cannot_be_is_refused_at_birth(options: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidValueError, match=words):
        ControllerConfig(model="xMate3", **options)  # type: ignore[arg-type]
