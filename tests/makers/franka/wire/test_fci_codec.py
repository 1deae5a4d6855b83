"""The wire of versions 5 and 10: sizes, offsets and numbers of the contract, and no bytes that surprise it."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import DecodeError
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import command_size, decode_command
from rcilab.makers.franka.wire.frame import (
    HEADER_SIZE,
    LARGEST_REQUEST,
    FrameReader,
    decode_header,
    decode_request,
    encode_connect_response,
    encode_response,
)
from rcilab.makers.franka.wire.requests import (
    SETTERS,
    AsyncMove,
    AutomaticErrorRecovery,
    Connect,
    GetCartesianLimit,
    GetRobotModel,
    LoadModelLibrary,
    Move,
    Request,
    SetCartesianImpedance,
    SetCollisionBehavior,
    SetEEToK,
    SetFilters,
    SetGuidingMode,
    SetJointImpedance,
    SetLoad,
    SetNEToEE,
    StopMove,
)
from rcilab.makers.franka.wire.state_packet import (
    ACCELEROMETERS,
    FIELDS,
    NO_ERRORS,
    NUMBERS,
    SLICES,
    StatePacket,
    encode_state,
    flags_of,
    renumber_state,
)
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, VERSIONS, FciVersion, Status

BOTH = pytest.mark.parametrize("version", [VERSION_5, VERSION_10], ids=["5", "10"])

OFFSETS = {  # Offset of each field in version 10 and in version 5, [bytes].
    "O_T_EE": (8, 8), "O_T_EE_d": (72, 136), "F_T_EE": (136, 264), "EE_T_K": (200, 392), "F_T_NE": (264, 520),
    "NE_T_EE": (328, 648), "m_ee": (392, 776), "I_ee": (396, 784), "F_x_Cee": (432, 856), "m_load": (444, 880),
    "I_load": (448, 888), "F_x_Cload": (484, 960), "elbow": (496, 984), "elbow_d": (504, 1000), "tau_J": (512, 1016),
    "tau_J_d": (540, 1072), "dtau_J": (568, 1128), "q": (596, 1184), "q_d": (624, 1240), "dq": (652, 1296),
    "dq_d": (680, 1352), "ddq_d": (708, 1408), "joint_contact": (736, 1464), "cartesian_contact": (764, 1520),
    "joint_collision": (788, 1568), "cartesian_collision": (816, 1624), "tau_ext_hat_filtered": (840, 1672),
    "O_F_ext_hat_K": (868, 1728), "K_F_ext_hat_K": (892, 1776), "O_dP_EE_d": (916, 1824), "O_ddP_O": (940, 1872),
    "elbow_c": (952, 1896), "delbow_c": (960, 1912), "ddelbow_c": (968, 1928), "O_T_EE_c": (976, 1944),
    "O_dP_EE_c": (1040, 2072), "O_ddP_EE_c": (1064, 2120), "theta": (1088, 2168), "dtheta": (1116, 2224),
}  # fmt: skip

PACKET = StatePacket(
    message_id=0x0102030405060708,
    numbers=np.arange(NUMBERS, dtype=np.float64) + 0.5,
    accelerometers=tuple(float(k) - 9.0 for k in range(ACCELEROMETERS)),
    motion_generator_mode=3,
    controller_mode=2,
    errors=flags_of((FrankaError.JOINT_VELOCITY_VIOLATION, FrankaError.BASE_ACCELERATION_INVALID_READING)),
    reflex_reason=flags_of((FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION,)),
    robot_mode=4,
    success_rate=0.75,
)


@BOTH
def test_every_number_of_a_state_is_at_the_offset_of_the_contract(version: FciVersion) -> None:
    data = encode_state(PACKET, version)
    code, size, column = ("f", 4, 0) if version.has_floats else ("d", 8, 1)
    assert len(data) == (1377 if version.has_floats else 2373)
    assert struct.unpack_from("<Q", data)[0] == PACKET.message_id
    assert [name for name, *_ in FIELDS] == list(OFFSETS)
    for name, count, _ in FIELDS:
        offset = OFFSETS[name][column]
        assert offset == 8 + size * SLICES[name].start
        assert list(struct.unpack_from(f"<{count}{code}", data, offset)) == PACKET.numbers[SLICES[name]].tolist()


@BOTH
def test_modes_errors_and_success_rate_follow_the_numbers(version: FciVersion) -> None:
    data = encode_state(PACKET, version)
    first = 1288 if version.has_floats else 2280
    assert data[first : first + 2] == bytes((3, 2))
    assert [i for i in range(41) if data[first + 2 + i]] == [3, 40]
    assert [i for i in range(41) if data[first + 43 + i]] == [25]
    assert data[first + 84] == 4
    assert struct.unpack_from("<f" if version.has_floats else "<d", data, first + 85)[0] == 0.75


def test_version_10_has_the_acceleration_sensors_of_both_sides() -> None:
    data = encode_state(PACKET, VERSION_10)
    assert struct.unpack_from("<18f", data, 1144) == PACKET.accelerometers[:18]
    assert struct.unpack_from("<18f", data, 1216) == PACKET.accelerometers[18:]


@BOTH
def test_a_state_is_renumbered_and_nothing_else(version: FciVersion) -> None:
    data = encode_state(PACKET, version)
    assert renumber_state(data, 9) == encode_state(PACKET._replace(message_id=9), version)


def test_no_errors_are_41_zeros() -> None:
    assert NO_ERRORS == flags_of(()) == bytes(41)


def some_command(version: FciVersion) -> tuple[bytes, list[float]]:
    numbers = [float(i) for i in range(1, 46)]
    head = struct.pack("<Q7d7d16d6d2d", 77, *numbers[:38])
    tail = struct.pack("<7d", *numbers[38:]) + (b"\1" if version.finishes_torques else b"")
    return head + b"\1\0" + tail, numbers


@BOTH
def test_a_command_is_decoded_field_by_field(version: FciVersion) -> None:
    data, numbers = some_command(version)
    assert len(data) == command_size(version) == (371 if version.finishes_torques else 370)
    command = decode_command(data, version)
    assert command.message_id == 77
    assert [*command.q_c, *command.dq_c, *command.O_T_EE_c, *command.O_dP_EE_c, *command.elbow_c] == numbers[:38]
    assert list(command.tau_c) == numbers[38:]
    assert (command.has_elbow, command.is_finished) == (True, False)
    assert command.has_ended_torques is version.finishes_torques  # In version 5 it is that of the generator.


def test_in_version_5_the_end_of_the_generator_is_that_of_the_torques() -> None:
    data = bytearray(some_command(VERSION_5)[0])
    data[313] = 1
    assert decode_command(bytes(data), VERSION_5).has_ended_torques


@given(st.binary(max_size=400), st.sampled_from((VERSION_5, VERSION_10)))
def test_any_datagram_is_a_command_or_a_decode_error(data: bytes, version: FciVersion) -> None:
    for datagram in (data, (data * 400)[: command_size(version)]):
        if len(datagram) == command_size(version):
            assert len(decode_command(datagram, version).q_c) == 7
        else:
            with pytest.raises(DecodeError, match=f"needs {command_size(version)}"):
                decode_command(datagram, version)


SIZES: dict[type[Request], int] = {
    Connect: 16, Move: 68, AsyncMove: 125, StopMove: 12, GetCartesianLimit: 16, SetCollisionBehavior: 428,
    SetJointImpedance: 68, SetCartesianImpedance: 60, SetGuidingMode: 19, SetEEToK: 140, SetNEToEE: 140, SetLoad: 116,
    SetFilters: 52, AutomaticErrorRecovery: 12, GetRobotModel: 12, LoadModelLibrary: 14,
}  # fmt: skip


@pytest.mark.parametrize(("kind", "size"), SIZES.items(), ids=[kind.__name__ for kind in SIZES])
def test_a_request_has_the_size_of_the_contract(kind: type[Request], size: int) -> None:
    assert HEADER_SIZE + kind.layout.size == size <= LARGEST_REQUEST


def test_the_commands_have_their_numbers_in_either_version() -> None:
    common = [SetCollisionBehavior, SetJointImpedance, SetCartesianImpedance, SetGuidingMode, SetEEToK, SetNEToEE]
    five = [Connect, Move, StopMove, GetCartesianLimit, *common, SetLoad, SetFilters]
    assert list(VERSION_5.commands) == [*five, AutomaticErrorRecovery, LoadModelLibrary]
    ten = [Connect, AsyncMove, StopMove, *common, SetLoad, AutomaticErrorRecovery, GetRobotModel]
    assert list(VERSION_10.commands) == ten
    assert set(VERSIONS) == {5, 10}


def frame_of(number: int, payload: bytes = b"", command_id: int = 5) -> bytes:
    return struct.pack("<III", number, command_id, HEADER_SIZE + len(payload)) + payload


def test_connect_is_decoded_before_the_version_is_known_and_nothing_else_is() -> None:
    frame = frame_of(0, struct.pack("<HH", 10, 40001))
    assert decode_request(frame, None) == Connect(10, 40001)
    assert decode_header(frame) == (0, 5, 16)
    with pytest.raises(DecodeError, match=r"begins with Connect \(0\)"):
        decode_request(frame_of(2), None)


@BOTH
def test_a_move_is_decoded_in_either_form(version: FciVersion) -> None:
    payload = struct.pack("<II6d", 1, 2, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
    if version is VERSION_10:
        payload += struct.pack("<?7d", True, *range(7))
    move = decode_request(frame_of(1, payload), version)
    assert isinstance(move, Move)
    assert (move.controller_mode, move.motion_generator_mode) == (1, 2)
    assert (move.path_deviation, move.goal_deviation) == ((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    if version is VERSION_10:
        assert isinstance(move, AsyncMove)
        assert (move.is_asynchronous, move.largest_velocity) == (True, tuple(map(float, range(7))))


@BOTH
def test_a_load_is_mass_centre_and_tensor(version: FciVersion) -> None:
    numbers = tuple(float(i) for i in range(13))
    request = decode_request(frame_of(version.number_of(SetLoad), struct.pack("<13d", *numbers)), version)
    assert request == SetLoad(0.0, numbers[1:4], numbers[4:])


@BOTH
def test_collision_thresholds_are_torques_and_then_forces(version: FciVersion) -> None:
    numbers = tuple(float(i) for i in range(52))
    request = decode_request(frame_of(version.number_of(SetCollisionBehavior), struct.pack("<52d", *numbers)), version)
    assert isinstance(request, SetCollisionBehavior)
    assert request.upper_torque_nominal == numbers[21:28]
    assert request.lower_force_acceleration == numbers[28:34]
    assert request.upper_force_nominal == numbers[46:]


@BOTH
def test_bytes_after_a_request_are_ignored_and_missing_ones_are_an_error(version: FciVersion) -> None:
    frame = frame_of(version.number_of(StopMove), b"later")
    assert decode_request(frame, version) == StopMove()
    with pytest.raises(DecodeError, match="SetLoad"):
        decode_request(frame_of(version.number_of(SetLoad), bytes(103)), version)
    with pytest.raises(DecodeError, match=f"unknown command 99: version {version.number}"):
        decode_request(frame_of(99), version)


@given(st.binary(max_size=500), st.integers(0, 20), st.sampled_from((None, VERSION_5, VERSION_10)))
def test_any_frame_is_a_request_or_a_decode_error(payload: bytes, number: int, version: FciVersion | None) -> None:
    try:
        request = decode_request(frame_of(number, payload), version)
    except DecodeError as error:
        ok = 0 <= error.offset <= HEADER_SIZE + len(payload)
    else:
        ok = isinstance(request, Request)
    assert ok


def test_frames_are_cut_for_any_division_into_reads() -> None:
    frames = [frame_of(0, b"abcd", 1), frame_of(2, b"", 2), frame_of(3, bytes(416), 3), frame_of(2, b"", 4)]
    stream = b"".join(frames)
    for size in (1, 7, 13, 100, len(stream)):
        reader = FrameReader()
        found = [frame for at in range(0, len(stream), size) for frame in reader.feed(stream[at : at + size])]
        assert found == frames


@pytest.mark.parametrize("size", [0, 11, LARGEST_REQUEST + 1, 2**32 - 1])
def test_an_impossible_size_ends_the_stream_with_its_offset(size: int) -> None:
    reader = FrameReader()
    assert len(reader.feed(frame_of(2))) == 1
    with pytest.raises(DecodeError, match=f"frame size {size} is outside 12 to 1024") as caught:
        reader.feed(struct.pack("<III", 2, 1, size))
    assert caught.value.offset == 12


def test_the_largest_frame_is_complete_only_with_its_last_byte() -> None:
    frame = frame_of(3, bytes(LARGEST_REQUEST - HEADER_SIZE))
    reader = FrameReader()
    assert reader.feed(frame[:-1]) == []
    assert reader.feed(frame[-1:]) == [frame]


def test_the_answer_to_connect_is_the_same_in_every_version() -> None:
    assert encode_connect_response(8, Status.SUCCESS, 10) == struct.pack("<IIIBH", 0, 8, 15, 0, 10)
    assert encode_connect_response(8, Status.INCOMPATIBLE, 5) == struct.pack("<IIIBH", 0, 8, 15, 1, 5)


MOVE_5 = {
    Status.SUCCESS: 0, Status.MOTION_STARTED: 1, Status.PREEMPTED: 2, Status.NOT_POSSIBLE: 3, Status.START_SINGULAR: 4,
    Status.INVALID_ARGUMENT: 5, Status.REFLEX_ABORTED: 6, Status.EMERGENCY_ABORTED: 7, Status.INPUT_ERROR_ABORTED: 8,
    Status.ABORTED: 9,
}  # fmt: skip
MOVE_10 = {
    Status.SUCCESS: 0, Status.MOTION_STARTED: 1, Status.PREEMPTED: 2, Status.PREEMPTED_BY_SAFETY: 3,
    Status.REJECTED_BY_SAFETY: 4, Status.NOT_POSSIBLE: 5, Status.START_SINGULAR: 6, Status.INVALID_ARGUMENT: 7,
    Status.REFLEX_ABORTED: 8, Status.EMERGENCY_ABORTED: 9, Status.INPUT_ERROR_ABORTED: 10, Status.ABORTED: 11,
}  # fmt: skip
RECOVERY_5 = {
    Status.SUCCESS: 0, Status.NOT_POSSIBLE: 1, Status.MANUAL_RECOVERY_REQUIRED: 2, Status.REFLEX_ABORTED: 3,
    Status.EMERGENCY_ABORTED: 4, Status.ABORTED: 5,
}  # fmt: skip
RECOVERY_10 = {
    Status.SUCCESS: 0, Status.NOT_POSSIBLE: 1, Status.REJECTED_BY_SAFETY: 2, Status.MANUAL_RECOVERY_REQUIRED: 3,
    Status.REFLEX_ABORTED: 4, Status.EMERGENCY_ABORTED: 5, Status.ABORTED: 6,
}  # fmt: skip


@pytest.mark.parametrize(
    ("version", "kind", "numbers"),
    [
        (VERSION_5, Move, MOVE_5),
        (VERSION_10, AsyncMove, MOVE_10),
        (VERSION_5, AutomaticErrorRecovery, RECOVERY_5),
        (VERSION_10, AutomaticErrorRecovery, RECOVERY_10),
        (VERSION_5, LoadModelLibrary, {Status.SUCCESS: 0, Status.ERROR: 1}),
        *(
            (version, kind, {Status.SUCCESS: 0, Status.NOT_POSSIBLE: 1, Status.INVALID_ARGUMENT: 2})
            for version in (VERSION_5, VERSION_10)
            for kind in SETTERS
            if kind in version.commands
        ),
    ],
)
def test_a_status_has_the_number_of_the_version(
    version: FciVersion, kind: type[Request], numbers: dict[Status, int]
) -> None:
    for status, number in numbers.items():
        frame = encode_response(version, kind, 3, status, b"content")
        assert frame == struct.pack("<IIIB", version.number_of(kind), 3, 20, number) + b"content"


@BOTH
def test_every_status_has_a_number_in_every_answer(version: FciVersion) -> None:
    of_move_or_connect = {Status.INCOMPATIBLE, Status.MOTION_STARTED, Status.PREEMPTED, Status.START_SINGULAR}
    for kind in version.commands[1:]:
        for status in set(Status) - of_move_or_connect - {Status.ERROR}:
            assert 0 <= version.status_number(kind, status) < len(version.statuses[kind])


def test_a_matrix_of_a_request_is_column_major_as_sent() -> None:
    numbers = tuple(math.sqrt(i) for i in range(16))
    request = decode_request(frame_of(VERSION_10.number_of(SetEEToK), struct.pack("<16d", *numbers)), VERSION_10)
    assert request == SetEEToK(numbers)
