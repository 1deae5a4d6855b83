"""Laws of the codec: what was encoded is decoded, and no bytes whatever surprise it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.command import CartesianPosition, JointPosition, JointTorque
from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.core.message_layout import Field
from rcilab.makers.rokae import wire as rci

NUMBERS = st.floats(allow_nan=False)
FIELD_VALUES = {
    "f64": NUMBERS,
    "flag": st.booleans(),
    "u8": st.integers(0, 255),
    "u16": st.integers(0, 65535),
}
IDS = st.integers(0, 2**32 - 1)


def field_strategy(field: Field) -> st.SearchStrategy[object]:
    one = FIELD_VALUES[field.type]
    return one if field.count == 1 else st.tuples(*[one] * field.count)


REQUESTS = st.one_of(
    *(st.builds(kind, *(field_strategy(field) for field in kind.layout.fields)) for kind in rci.REQUESTS.values())
)


def some_response(command: rci.CommandCode) -> rci.Response:
    if command is rci.CommandCode.GET_MOTOR_STATE:
        return rci.MotorStateResponse(1)
    if command is rci.CommandCode.GET_SAFETY_STOP_STATE:
        return rci.SafetyStopResponse(rci.SafetyStop.GSTOP)
    if command is rci.CommandCode.GET_DI_STATE:
        return rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, True)
    if command is rci.CommandCode.LOAD_ROBOT_MODEL:
        ramp = tuple(map(float, range(160)))
        return rci.ModelResponse(ramp[:28], ramp[49:115], ramp[115:160], ramp[28:49])
    return rci.StatusResponse(rci.STATUS_TYPES[command](1))


def test_there_is_a_request_for_each_of_the_25_commands() -> None:
    assert list(rci.REQUESTS) == list(rci.CommandCode) == list(range(25))


@given(REQUESTS, IDS)
def test_decoding_a_request_undoes_encoding_it(request_: rci.Request, command_id: int) -> None:
    frame = rci.encode_request(request_, command_id)
    assert rci.decode_request(frame) == (command_id, request_)
    assert int.from_bytes(frame[:2], "big") == len(frame)


@pytest.mark.parametrize("command", rci.CommandCode)
def test_decoding_a_response_undoes_encoding_it(command: rci.CommandCode) -> None:
    response = some_response(command)
    frame = rci.encode_response(command, 77, response)
    assert rci.decode_response(command, frame) == (77, response)
    expected = {rci.CommandCode.LOAD_ROBOT_MODEL: 1291, rci.CommandCode.GET_DI_STATE: 12}.get(command, 11)
    assert len(frame) == expected


@pytest.mark.parametrize("command", rci.CommandCode)
def test_each_status_value_survives_the_wire(command: rci.CommandCode) -> None:
    if not isinstance(some_response(command), rci.StatusResponse):
        return
    for status in rci.STATUS_TYPES[command]:
        frame = rci.encode_response(command, 1, rci.StatusResponse(status))
        assert rci.decode_response(command, frame)[1] == rci.StatusResponse(status)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_request_or_a_decode_error(data: bytes) -> None:
    try:
        _, request = rci.decode_request(data)
    except DecodeError as error:
        ok = 0 <= error.offset <= len(data)
    else:
        ok = isinstance(request, rci.Request)
    assert ok


@given(st.sampled_from(rci.CommandCode), st.binary(max_size=300), IDS)
def test_any_payload_under_a_true_header_is_a_value_or_a_decode_error(
    command: rci.CommandCode, payload: bytes, command_id: int
) -> None:
    length = (10 + len(payload)).to_bytes(2, "big")
    frame = length + command_id.to_bytes(4, "big") + command.to_bytes(4, "big") + payload
    for decode in (rci.decode_request, lambda data: rci.decode_response(command, data)):
        try:
            ok = decode(frame)[0] == command_id
        except DecodeError as error:
            ok = 0 <= error.offset <= len(frame)
        assert ok


@given(st.binary(max_size=1300), st.sampled_from((6, 7)))
def test_any_datagram_is_a_state_or_a_decode_error(data: bytes, n: int) -> None:
    for datagram in (data, (data + bytes(1247))[:1247]):
        try:
            state = rci.decode_state(datagram, n)
        except DecodeError as error:
            ok = 0 <= error.offset <= len(datagram)
        else:
            ok = state.q.shape == (n,)
        assert ok


@given(st.binary(max_size=300), st.sampled_from((6, 7)))
def test_any_datagram_is_a_command_or_a_decode_error(data: bytes, n: int) -> None:
    for datagram in (data, (data + bytes(290))[:290]):
        if len(datagram) == 290:
            assert len(rci.decode_command(datagram, n).q_c) == n
        else:
            with pytest.raises(DecodeError, match="needs 290"):
                rci.decode_command(datagram, n)


@given(st.lists(REQUESTS, min_size=1, max_size=5), st.data())
def test_frames_survive_any_splitting_and_joining(requests: list[rci.Request], data: st.DataObject) -> None:
    frames = [rci.encode_request(request, number) for number, request in enumerate(requests)]
    stream = b"".join(frames)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    reader = rci.FrameReader()
    found = [frame for a, b in pairwise([0, *cuts, len(stream)]) for frame in reader.feed(stream[a:b])]
    assert found == frames


@given(st.lists(st.binary(max_size=50), max_size=5))
def test_a_frame_reader_gives_whole_frames_or_a_decode_error_for_any_stream(chunks: list[bytes]) -> None:
    reader = rci.FrameReader()
    for chunk in chunks:
        try:
            frames = reader.feed(chunk)
        except DecodeError:
            with pytest.raises(DecodeError):
                reader.feed(b"")
            return
        assert all(len(frame) == int.from_bytes(frame[:2], "big") >= 10 for frame in frames)


def test_a_web_browser_on_the_port_is_recognised_as_no_rci() -> None:
    with pytest.raises(DecodeError, match="frame length 18245"):
        rci.FrameReader().feed(b"GET / HTTP/1.1\r\n")


def test_an_unknown_mode_is_named_with_its_place() -> None:
    datagram = bytearray(1247)
    datagram[1245] = 9
    with pytest.raises(DecodeError, match="unknown controller_mode") as caught:
        rci.decode_state(bytes(datagram), 7)
    assert caught.value.offset == 1245


def test_a_request_with_the_wrong_number_of_elements_is_refused_at_birth() -> None:
    with pytest.raises(InvalidValueError, match="has 5 elements, needs 7"):
        rci.SetJointImpedance((1.0, 2.0, 3.0, 4.0, 5.0))
    with pytest.raises(InvalidValueError, match="0 to 255"):
        rci.StartMove(256, 0)
    assert rci.SetJointImpedance((1.0,) * 6).stiffness == (1.0,) * 6 + (0.0,)


def test_a_longer_state_is_cut_and_a_shorter_one_refused_as_the_vendor_client_does() -> None:
    datagram = bytes(1247)
    assert rci.decode_state(datagram + b"more", 7).message_id == 0
    with pytest.raises(DecodeError, match="needs 1247"):
        rci.decode_state(datagram[:-1], 7)


@pytest.fixture
def state() -> object:
    datagram = bytearray(np.arange(160.0).tobytes()[:1247])
    datagram[1216:1236] = bytes(20)
    datagram[1244:] = bytes((1, 0, 2))
    return rci.decode_state(bytes(datagram), 7)


def test_a_joint_command_repeats_the_measured_pose(state) -> None:
    packet = rci.build_command(5, JointPosition(np.full(7, 0.5)), state)
    assert packet.q_c == (0.5,) * 7
    assert packet.T_base_tool_c == state.T_base_tool.as_row_major()
    assert (packet.psi_valid, packet.psi_c, packet.tau_c) == (False, 0.0, (0.0,) * 7)


def test_a_cartesian_command_can_ask_for_an_arm_angle_of_zero(state) -> None:
    packet = rci.build_command(5, CartesianPosition(np.eye(4), psi=0.0), state)
    assert (packet.psi_valid, packet.psi_c) == (True, 0.0)
    assert packet.q_c == tuple(state.q)
    without = rci.build_command(5, CartesianPosition(np.eye(4)), state)
    assert without.psi_valid is False


def test_a_torque_command_leaves_the_rest_zero(state) -> None:
    packet = rci.build_command(5, JointTorque(np.arange(7.0), finished=True), state)
    assert packet.q_c == (0.0,) * 7
    assert packet.T_base_tool_c == (0.0,) * 16
    assert not packet.finished  # As with the vendor's client, which announces the end over TCP alone.
    assert rci.decode_command(rci.encode_command(packet), 7) == packet


def test_nan_commands_are_carried_as_they_are() -> None:
    packet = rci.decode_command(rci.encode_command(rci.CommandPacket(1, (math.nan,) * 7)), 7)
    assert all(map(math.isnan, packet.q_c))
