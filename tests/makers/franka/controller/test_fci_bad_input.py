"""Wrong bytes and clients: Franka's own status or error, one line in the log, and the next good client works."""

from __future__ import annotations

import math
import re
import socket
import struct
from collections.abc import Callable, Iterator

import pytest

from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import PATIENCE, Output, Robot


@pytest.fixture(params=[5, 10], ids=["v5", "v10"])
def place(request: pytest.FixtureRequest) -> Iterator[FciArena]:
    """An arm of its own for each test: its log is read."""
    with fci_arena(request.param) as running:
        yield running


@pytest.fixture
def robot(place: FciArena) -> Iterator[Robot]:
    with place.connect() as client:
        yield client


def good_client_works(place: FciArena) -> None:
    """Recovers and runs a motion to its end."""
    with place.connect() as robot:
        assert robot.connected.status == "success"
        robot.state_when(lambda state: state.robot_mode != wire.ROBOT_MOVE)
        assert robot.ask("automatic_error_recovery").status == "success"
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        ending = robot.play(start, programs.motion(start, wire.JOINT_POSITION, height=0.005), cycles=201)
        assert (ending.status, ending.state.errors) == ("success", ())


def raw(place: FciArena, data: bytes) -> bytes:
    """Sends bytes over TCP and ends the sending; returns all that comes back before the controller hangs up."""
    with socket.create_connection((place.arena.host, place.arena.port), timeout=PATIENCE) as tcp:
        tcp.sendall(data)
        tcp.shutdown(socket.SHUT_WR)
        answer = b""
        try:
            while data := tcp.recv(65536):
                answer += data
        except ConnectionResetError:
            pass
    return answer


@pytest.mark.parametrize("claimed", [0, 3, 4, 6, 9, 11, 65535])
def test_another_version_is_incompatible_and_gets_no_states(place: FciArena, claimed: int) -> None:
    with place.connect(claimed=claimed) as robot:
        assert robot.connected.status == "incompatible"
        assert robot.server_version == place.version
        robot.udp.settimeout(0.05)
        with pytest.raises(TimeoutError):
            robot.udp.recv(4096)
    (line,) = place.log("refused")
    assert line == f"refused a client of version {claimed}: this arm has version {place.version} of the FCI"
    good_client_works(place)


def test_the_other_arms_client_learns_this_version(place: FciArena) -> None:
    other = 15 - place.version
    with Robot(place.arena.host, place.arena.port, other) as robot:
        assert robot.connected.status == "incompatible"
        assert robot.server_version == place.version
    good_client_works(place)


BYTES: dict[str, tuple[Callable[[int], bytes], str]] = {
    "half a header": (lambda version: b"\x00\x00\x00", "closed"),
    "half a frame": (lambda version: connect(version)[:14], "closed"),
    "a frame shorter than its header": (lambda version: struct.pack("<III", 0, 1, 11), "frame size 11 is outside"),
    "a frame of no size": (lambda version: struct.pack("<III", 0, 1, 0), "frame size 0 is outside"),
    "a huge frame": (lambda version: struct.pack("<III", 0, 1, 2**32 - 1) + bytes(100), "frame size 4294967295"),
    "no Connect": (lambda version: struct.pack("<III", 2, 1, 12), "a client begins with Connect (0)"),
    "an unknown command": (lambda version: connect(version) + struct.pack("<III", 99, 2, 12), "unknown command 99"),
    "a command that is too short": (
        lambda version: connect(version) + struct.pack("<III", 1, 2, 12), "sent what is no request of the FCI"),
    "a browser": (lambda version: b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n", "frame size"),
    "a state port below 1024": (lambda version: struct.pack("<IIIHH", 0, 1, 16, version, 80), "states at port 80"),
    "a state port of zero": (lambda version: struct.pack("<IIIHH", 0, 1, 16, version, 0), "states at port 0"),
}  # fmt: skip


def connect(version: int) -> bytes:
    return struct.pack("<IIIHH", 0, 1, 16, version, 40_000)


@pytest.mark.parametrize("name", BYTES)
def test_bytes_that_are_no_request_end_the_connection_with_one_line(place: FciArena, name: str) -> None:
    make, expected = BYTES[name]
    raw(place, make(place.version))
    good_client_works(place)
    lines = [text for text in place.log() if "127.0.0.1" in text][:2]
    assert lines[0] == "client 127.0.0.1 connected"
    assert (expected in lines[1]) or (expected == "closed" and "disconnected" in lines[1]), lines


def test_a_connection_that_says_nothing_receives_nothing_and_the_next_one_is_refused_while_it_lasts(
    place: FciArena,
) -> None:
    with socket.create_connection((place.arena.host, place.arena.port), timeout=PATIENCE):
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            place.connect()
        place.between(lambda: None)
        assert len(place.log("client_refused")) == 1
    good_client_works(place)


def test_a_second_client_is_refused_and_the_first_continues(place: FciArena, robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION)

    def callback(state: wire.State, k: int) -> Output:
        if k == 50:
            with pytest.raises((ConnectionResetError, BrokenPipeError)):
                place.connect()
        return program(state, k)

    assert robot.play(start, callback, cycles=201).status == "success"
    assert place.log("client_refused") == ["refused another client from 127.0.0.1: 127.0.0.1 is connected"]


@pytest.mark.parametrize("generator", [wire.JOINT_POSITION, wire.JOINT_VELOCITY])
def test_a_client_that_is_killed_in_a_motion_stops_the_arm_and_the_next_one_moves_it(
    place: FciArena, generator: int
) -> None:
    robot = place.connect()
    state = start = robot.move(wire.JOINT_IMPEDANCE, generator)
    program = programs.motion(start, generator, cycles=600, height=0.05)
    for k in range(200):
        robot.answer(state, program(state, k))
        state = robot.state()
    robot.tcp.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # As a killed process.
    robot.close()
    good_client_works(place)
    (line,) = place.log("client_lost")
    assert line.endswith("during a motion: the arm stops")
    kind = {wire.JOINT_POSITION: "joint position", wire.JOINT_VELOCITY: "joint velocity"}[generator]
    assert place.log("motion_started")[0] == f"motion started: {kind} under joint impedance"
    pattern = r"motion ended after 0\.\d+ s: \d+ cycles, 0 without a command; 0 commands late$"
    assert re.match(pattern, place.log("motion_ended")[0])


def test_a_client_that_leaves_between_move_and_its_first_command_blocks_nobody(place: FciArena) -> None:
    robot = place.connect()
    robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    robot.close()
    good_client_works(place)


@pytest.mark.parametrize("size", [0, 1, 369, 370, 371, 372, 1400, 3000])
def test_datagrams_of_another_size_change_nothing(place: FciArena, robot: Robot, size: int) -> None:
    if size == wire.COMMAND_SIZES[place.version]:
        return
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION)

    def callback(state: wire.State, k: int) -> Output:
        if k % 20 == 10:
            robot.send(bytes(size))
        return program(state, k)

    ending = robot.play(start, callback, cycles=201)
    assert (ending.status, ending.state.errors) == ("success", ())
    assert len(place.log("bad_datagram")) == 5  # Those of 10 s.


def test_commands_without_a_motion_are_ignored(place: FciArena, robot: Robot) -> None:
    before = robot.state()
    state = before
    for _ in range(50):
        robot._is_external = robot._is_torque_alone = False
        robot.answer(state, Output(q=(1.0,) * 7, dq=(math.nan,) * 7))
        state = robot.state()
    assert state.data[8:] == before.data[8:]
    assert place.simulate("status")["status"]["ignored"] == 50


FIELDS = ("q", "dq", "pose", "twist", "elbow", "tau")
LENGTHS = {"q": 7, "dq": 7, "pose": 16, "twist": 6, "elbow": 2, "tau": 7}
USED = {
    wire.JOINT_POSITION: "q",
    wire.JOINT_VELOCITY: "dq",
    wire.CARTESIAN_POSE: "pose",
    wire.CARTESIAN_VELOCITY: "twist",
}


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf, 1e308, -1e308])
@pytest.mark.parametrize("generator", USED)
def test_a_number_that_is_none_in_any_field_ends_the_motion_and_in_other_fields_nothing(
    place: FciArena, robot: Robot, generator: int, number: float
) -> None:
    for field in FIELDS:
        robot.ask("automatic_error_recovery")
        start = robot.move(wire.JOINT_IMPEDANCE, generator)
        quiet = Output(q=start.q_d, dq=programs.ZERO, pose=start.O_T_EE_c, twist=(0.0,) * 6, tau=programs.ZERO)
        bad = quiet._replace(**{field: (number,) * LENGTHS[field]})
        ending = robot.play(start, [quiet] * 3 + [bad] * 3)
        is_used = field == USED[generator] or (field == "elbow" and generator >= wire.CARTESIAN_POSE)
        assert bool(ending.state.errors) is is_used, (field, ending.state.errors)
        assert ending.status == ("reflex" if is_used else "success")
        last = robot.skip(60)
        assert all(math.isfinite(value) for name in last.names for value in getattr(last, name))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("generator", "field", "error"),
    [
        (wire.JOINT_POSITION, "q", None),
        (wire.JOINT_VELOCITY, "dq", "joint_motion_generator_velocity_limits_violation"),
        (wire.CARTESIAN_POSE, "pose", "cartesian_position_motion_generator_invalid_frame_flag"),
        (wire.CARTESIAN_VELOCITY, "twist", "cartesian_motion_generator_velocity_limits_violation"),
    ],
)
def test_a_number_that_is_none_raises_the_error_of_its_quantity(
    robot: Robot, generator: int, field: str, error: str | None, number: float
) -> None:
    of_position = {5: "joint_motion_generator_position_limits_violation", 10: "joint_position_limits_violation"}
    start = robot.move(wire.JOINT_IMPEDANCE, generator)
    quiet = Output(q=start.q_d, dq=programs.ZERO, pose=start.O_T_EE_c, twist=(0.0,) * 6)
    numbers = (*getattr(quiet, field)[:-1], number)
    ending = robot.play(start, [quiet] * 3 + [quiet._replace(**{field: numbers})] * 3)
    assert ending.state.errors == (error or of_position[robot.version],)


def test_a_first_command_that_is_the_last_one_is_a_motion_of_length_zero(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    robot.answer(start, Output(q=start.q_d), finished=True)
    assert robot.ending() == "success"
    assert robot.state_when(lambda state: state.generator == 0).q_d == start.q_d


def test_a_foreign_host_commands_nothing(place: FciArena, robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION)
    assert robot._source is not None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.9", 0))

        def callback(state: wire.State, k: int) -> Output:
            stranger.sendto(robot.pack(state.message_id, Output(q=(1.0,) * 7)), robot._source)  # type: ignore[arg-type]
            return program(state, k)

        ending = robot.play(start, callback, cycles=201)
    assert (ending.status, ending.state.errors) == ("success", ())
    assert len(place.log("unknown_sender")) == 1


def test_another_program_of_the_clients_machine_commands_nothing(place: FciArena, robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    assert robot._source is not None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        other.sendto(robot.pack(start.message_id, Output(q=(1.0,) * 7)), robot._source)
        place.between(lambda: None)
        ending = robot.play(robot.state(), programs.motion(start, wire.JOINT_POSITION), cycles=201)
    assert (ending.status, ending.state.errors) == ("success", ())
    assert len(place.log("unknown_sender")) == 1


def test_frames_that_came_with_a_bad_one_are_void(place: FciArena) -> None:
    move = wire.pack_frame(1, 3, wire.pack_move(place.version, wire.JOINT_IMPEDANCE, wire.JOINT_POSITION))
    raw(place, connect(place.version) + struct.pack("<III", 99, 2, 12) + move)
    good_client_works(place)
    assert len(place.log("motion_started")) == 1  # That of the good client.


def test_old_repeated_and_early_commands_do_not_move_the_arm_twice(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION)
    earlier: list[bytes] = []

    def callback(state: wire.State, k: int) -> Output:
        for datagram in earlier[-3:]:
            robot.send(datagram)
        earlier.append(robot.pack(state.message_id, program(state, k)))
        return program(state, k)

    ending = robot.play(start, callback, cycles=201)
    assert (ending.status, ending.state.errors) == ("success", ())


def test_requests_one_after_the_other_without_reading_are_all_answered(robot: Robot) -> None:
    ids = [robot.request("stop_move") for _ in range(200)]
    assert [robot.response("stop_move", number).status for number in ids] == ["success"] * 200


@pytest.mark.parametrize(
    ("name", "value"),
    [("on_loss", {"behaviour": "hold"}), ("loop_back", {"on": True}), ("auto_limit", {"on": True})],
)
def test_what_this_controller_has_not_is_refused_at_the_simulation_port(
    place: FciArena, name: str, value: dict[str, object]
) -> None:
    answer = place.simulate(name, **value)
    assert not answer["ok"]
    assert f"the controller of {place.controller.model.name} has no such option" in answer["error"]
    assert place.log("set_up") == []
