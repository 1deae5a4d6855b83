"""The wire: sizes and offsets of the contract, and no bytes that surprise it."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import DecodeError
from rcilab.makers.ufactory.wire.frame import (
    LARGEST_FRAME,
    Feedback,
    FrameReader,
    decode_frame,
    encode_feedback,
    encode_modbus_response,
    encode_response,
)
from rcilab.makers.ufactory.wire.functions import Function, decode_payload
from rcilab.makers.ufactory.wire.identity import IDENTITIES
from rcilab.makers.ufactory.wire.modbus import ModbusError, ModbusException, answer_modbus
from rcilab.makers.ufactory.wire.poses import (
    pose_as_mm_rotation,
    pose_as_mm_rpy,
    pose_from_mm_rotation,
    pose_from_mm_rpy,
)
from rcilab.makers.ufactory.wire.reports import HIGH_RATE, NORMAL, REAL, REPORTS, RICH

GET_VERSION = bytes.fromhex("0001 0002 0001 01")
GET_STATE = bytes.fromhex("0002 0003 0001 0d")


def test_frames_are_cut_for_any_division_into_reads() -> None:
    stream = GET_VERSION + bytes.fromhex("0000 0001 0002 0000") + GET_STATE
    for size in (1, 2, 5, len(stream)):
        reader = FrameReader()
        pieces = [stream[k : k + size] for k in range(0, len(stream), size)]
        frames = [frame for piece in pieces for frame in reader.feed(piece)]
        assert [decode_frame(frame)[:3] for frame in frames] == [(1, 2, 1), (0, 1, 0), (2, 3, 13)]


@pytest.mark.parametrize("header", ["0001 0009 0001 01", "0001 0002 0000 01", "0001 0002 ffff 01"])
def test_an_impossible_header_is_an_error_with_its_place(header: str) -> None:
    reader = FrameReader()
    reader.feed(GET_VERSION)
    with pytest.raises(DecodeError, match=r"at byte (9|11)\)"):
        reader.feed(bytes.fromhex(header))


@given(st.binary(max_size=64))
def test_any_bytes_are_frames_or_an_error(data: bytes) -> None:
    try:
        frames = FrameReader().feed(data)
    except DecodeError:
        return
    for frame in frames:
        request = decode_frame(frame)
        assert len(frame) <= LARGEST_FRAME
        if request.function in tuple(Function):
            try:
                decode_payload(Function(request.function), request.payload)
            except DecodeError:
                continue


def test_a_response_echoes_its_request() -> None:
    request = decode_frame(GET_STATE)
    assert encode_response(request, 0x10, b"\x04") == bytes.fromhex("0002 0003 0003 0d 10 04")
    modbus = decode_frame(bytes.fromhex("0007 0000 0006 01 03 0000 0001"))
    assert encode_modbus_response(modbus, b"\x83\x02") == bytes.fromhex("0007 0000 0003 01 83 02")


def test_a_feedback_has_its_fields_in_the_order_of_the_contract() -> None:
    frame = encode_feedback(Feedback(7, 3, 0, 2, 23, 300, 1, 5))
    assert frame == bytes.fromhex("0007 0003 000f ff 00 02 17 012c 01 0000000000000005")


def test_older_and_newer_forms_of_a_request_are_decoded() -> None:
    numbers = [float(k) for k in range(10)]
    old = struct.pack("<9f", *numbers[:9])
    new = struct.pack("<10f3B", *numbers, 1, 0, 0)
    assert decode_payload(Function.MOVE_LINE, old) == tuple(numbers[:9])
    assert decode_payload(Function.MOVE_LINE, new + b"\x07\x08") == (*numbers, 1, 0, 0, 7)
    assert decode_payload(Function.TOOL_WRITE_16, bytes.fromhex("09 0a15") + struct.pack("<f", 2.0)) == (9, 0x0A15, 2.0)
    with pytest.raises(DecodeError, match="MOVE_LINE needs 36 bytes, got 35"):
        decode_payload(Function.MOVE_LINE, old[:-1])


def test_reports_have_the_sizes_and_offsets_of_the_contract() -> None:
    assert [layout.size for layout in (NORMAL, REAL, HIGH_RATE)] == [145, 135, 804]
    expected = {
        "q": 7, "pose": 35, "torque": 59, "brakes": 87, "enabled": 88, "error": 89, "warning": 90, "tcp_offset": 91,
        "load": 115, "collision_sensitivity": 131, "gravity": 133, "type": 145, "axes": 146, "version": 151,
        "tcp_limits": 181, "joint_limits": 201, "rotation_limits": 221, "servo_codes": 229, "tool_codes": 243,
        "temperatures": 245, "tcp_speed": 252, "joint_speeds": 256, "counter": 284, "world_offset": 288,
        "io_reset": 312, "is_simulation": 314, "self_collision": 315, "tool_parameters": 317,
        "voltages": 341, "currents": 355,
        "external_force": 433, "raw_force": 457, "identification": 481, "rotation_vector": 482,
        "configuration": 494, "reduced": 495, "boundary": 496, "reduced_speeds": 508, "reduced_ranges": 516,
        "fence": 572, "rebound": 573, "io_alarm": 574, "switches": 578, "device": 579,
    }  # fmt: skip
    assert {name: RICH.offsets[name] for name in expected} == expected
    assert RICH.size == 587
    high = {"state_and_mode": 12, "queued": 13, "target_q": 32, "q": 116, "currents": 200, "joint_torque": 228}
    assert {name: HIGH_RATE.offsets[name] for name in high} == high
    assert HIGH_RATE.offsets["target_pose_aa"] == 424
    assert HIGH_RATE.offsets["pose_aa"] == 472


def test_every_field_is_written_where_it_belongs() -> None:
    for layout in REPORTS:
        empty = layout.encode({})
        assert struct.unpack_from(">I", empty) == (layout.size,)
        for field in layout.fields[1:]:
            value = b"v" * 30 if field.code == "s" else [7] * field.length if field.length > 1 else 7
            filled = layout.encode({field.name: value})
            changed = np.flatnonzero(np.frombuffer(filled, np.uint8) != np.frombuffer(empty, np.uint8))
            first = layout.offsets[field.name]
            size = struct.calcsize(f">{field.length}{field.code}")
            assert first <= changed.min()
            assert changed.max() < first + size


def test_the_version_ends_with_a_zero() -> None:
    assert IDENTITIES["xArm6"].encode_version() == b"6,6,XI130400000006,AC1304,v2.7.103\0"


def test_poses_return_from_both_forms() -> None:
    values = (207.0, -10.0, 112.0, 3.0, -0.4, 1.2)
    pose = pose_from_mm_rpy(values)
    np.testing.assert_allclose(pose_as_mm_rpy(pose), values, atol=1e-12)
    np.testing.assert_allclose(pose_from_mm_rotation(pose_as_mm_rotation(pose)).matrix, pose.matrix, atol=1e-12)


class _Memory:
    """64 registers and bits, from address 0."""

    def __init__(self) -> None:
        self.registers = [0] * 64
        self.bits = [False] * 64

    def read_coils(self, address: int, count: int) -> Sequence[bool]:
        return self._part(self.bits, address, count)

    def read_inputs(self, address: int, count: int) -> Sequence[bool]:
        return [not bit for bit in self.read_coils(address, count)]

    def read_holding(self, address: int, count: int) -> Sequence[int]:
        return self._part(self.registers, address, count)

    def read_registers(self, address: int, count: int) -> Sequence[int]:
        return [value + 1 for value in self.read_holding(address, count)]

    def write_coils(self, address: int, bits: Sequence[bool]) -> None:
        self._part(self.bits, address, len(bits))
        self.bits[address : address + len(bits)] = bits

    def write_holding(self, address: int, registers: Sequence[int]) -> None:
        self._part(self.registers, address, len(registers))
        self.registers[address : address + len(registers)] = registers

    @staticmethod
    def _part(values: list, address: int, count: int) -> list:
        if address + count > len(values):
            raise ModbusError(ModbusException.ADDRESS)
        return values[address : address + count]


MODBUS_ROWS = (  # Requests in their order, and their answers.
    ("05 0003 ff00", "05 0003 ff00"),
    ("01 0000 000a", "01 02 0800"),
    ("02 0000 0004", "02 01 07"),
    ("0f 0008 0003 01 05", "0f 0008 0003"),
    ("01 0008 0003", "01 01 05"),
    ("06 0004 1234", "06 0004 1234"),
    ("10 0005 0002 04 04d2 0d80", "10 0005 0002"),
    ("03 0004 0003", "03 06 1234 04d2 0d80"),
    ("04 0004 0001", "04 02 1235"),
    ("16 0004 f00f 0550", "16 0004 f00f 0550"),
    ("03 0004 0001", "03 02 1554"),
    ("17 0004 0002 0005 0001 02 0007", "17 04 1554 0007"),
    ("2b 0000", "ab 01"),
    ("03 003f 0002", "83 02"),
    ("03 0000 0000", "83 03"),
    ("03 00", "83 03"),
    ("05 0003 0001", "85 03"),
    ("10 0005 0002 02 04d2", "90 03"),
    ("0f 0008 0009 01 05", "8f 03"),
)


def test_modbus_functions() -> None:
    memory = _Memory()
    for request, answer in MODBUS_ROWS:
        assert answer_modbus(bytes.fromhex(request), memory).hex(" ") == bytes.fromhex(answer).hex(" "), request


@given(st.binary(max_size=24))
def test_any_modbus_request_has_an_answer(pdu: bytes) -> None:
    assert answer_modbus(pdu, _Memory())
