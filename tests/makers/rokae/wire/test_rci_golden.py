"""Bytes captured from the vendor's client are reproduced and understood."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import CommandPacket

GOLDEN = json.loads((Path(__file__).parent / "golden_wire.json").read_text())

POSE = (1.0, 0.0, 0.0, 0.25, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.75, 0.0, 0.0, 0.0, 1.0)
ONE_TO_7 = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
ONE_TO_6 = ONE_TO_7[:6]
ONE_TO_9 = (*ONE_TO_7, 8.0, 9.0)
SOFT_LIMIT = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)

EXPECTED: list[rci.Request] = [
    rci.SetMotorPower(1),
    rci.GetMotorState(),
    rci.SetMotorPower(0),
    rci.GetMotorState(),
    rci.SetCollisionBehavior(ONE_TO_7),
    rci.SetCartesianLimit((0.1, 0.2, 0.3), POSE, True),
    rci.SetJointImpedance(ONE_TO_7),
    rci.SetCartesianImpedance(ONE_TO_6),
    rci.SetCoor(POSE),
    rci.SetLoad(1.5, (0.01, 0.02, 0.03), ONE_TO_9),
    rci.SetFilters(11.0, 12.0, 13.0),
    rci.SetCartImpDesiredTau(ONE_TO_6),
    rci.SetTorqueFilterCutOffFrequency(44.5),
    rci.AutomaticErrorRecovery(),
    rci.LoadRobotModel(),
    rci.EnableVirtualGuide(True),
    rci.EnableVirtualGuide(False),
    *(rci.SetDO(signal, signal % 2 == 1) for signal in range(6)),
    *(rci.GetDIState(signal) for signal in range(6)),
    rci.SetJointLimit(SOFT_LIMIT, tuple(-x for x in SOFT_LIMIT)),
    rci.SetJointLimit(SOFT_LIMIT, tuple(-x for x in SOFT_LIMIT)),
    *(rci.SetFcCoor(POSE, kind) for kind in range(3)),
    *(r for space in range(2) for kind in range(3) for r in (rci.StartDrag(space, kind), rci.StopDrag())),
    rci.GetSafetyStopState(),
    *(r for mode in range(5) for motion in range(3) for r in (rci.StartMove(mode, motion), rci.StopMove())),
    *(rci.StopMove() for _ in range(4)),
    rci.RebootRobot(),
]


def test_every_captured_request_is_expected() -> None:
    assert [entry["name"] for entry in GOLDEN["requests"]] == [type(request).__name__ for request in EXPECTED]
    assert {request.code for request in EXPECTED} == set(rci.CommandCode) - {rci.CommandCode.CONNECT}


@pytest.mark.parametrize(("entry", "request_"), list(zip(GOLDEN["requests"], EXPECTED, strict=True)))
def test_captured_requests_are_reproduced_byte_for_byte(entry: dict[str, object], request_: rci.Request) -> None:
    dots = str(entry["hex"])
    frame = bytes.fromhex(dots.replace(".", "0"))
    assert rci.encode_request(request_, int(str(entry["id"]))) == frame
    assert rci.decode_request(frame) == (entry["id"], request_)


def test_connect_names_its_port_big_endian() -> None:
    frame = rci.encode_request(rci.Connect(1337), 9)
    assert frame.hex() == "000c" + "00000009" + "00000000" + "0539"
    assert rci.decode_request(frame) == (9, rci.Connect(1337))


@pytest.mark.parametrize("kind", ["joint", "cart", "torque"])
def test_captured_commands_are_reproduced_and_decoded(kind: str) -> None:
    entry = GOLDEN["commands"][kind]
    datagram = bytes.fromhex(entry["hex"])
    packet = rci.decode_command(datagram, 7)
    assert packet == CommandPacket(
        entry["message_id"],
        tuple(entry["q_c"]),
        tuple(entry["toolTobase_pos_c"]),
        entry["psi_valid"],
        entry["psi_c"],
        entry["motion_generation_finished"],
        tuple(entry["tau_c"]),
    )
    assert rci.encode_command(packet) == datagram


def test_the_state_layout_is_the_one_the_vendor_client_decoded() -> None:
    # The ramp that was sent to the vendor's client: double number k holds k, errors alternate, modes 2, 3, 6.
    errors = bytes(place % 2 for place in range(20))
    ramp = struct.pack(">Q", 208) + struct.pack("<151d", *range(151)) + errors + struct.pack("<d3B", 0.875, 2, 3, 6)
    state = rci.decode_state(ramp, 7)
    assert state.message_id == 208
    names = "q q_c dq dq_c ddq_c T_base_tool T_base_tool_c tool_velocity_c tool_acceleration_c psi psi_c dpsi_c ddpsi_c"
    names += " tau tau_filtered tau_c dtau_c tau_ext_in_base tau_ext_in_stiff theta dtheta motor_tau motor_tau_filtered"
    in_order = np.concatenate([np.ravel(getattr(state, name)) for name in names.split()])
    assert np.array_equal(in_order, np.arange(151.0))
    assert state.faults == tuple(Fault(place) for place in range(1, 20, 2))
    assert state.success_rate == 0.875
    assert state.motion_generator_mode is MotionGeneratorMode.JOINT_VELOCITY
    assert state.controller_mode is ControllerMode.CARTESIAN_IMPEDANCE
    assert state.robot_mode is RobotMode.AUTOMATIC_ERROR_RECOVERY
    assert rci.encode_state(state) == ramp


@pytest.mark.parametrize(
    ("name", "offset"),
    [("q", 8), ("T_base_tool", 288), ("psi", 640), ("tau", 672), ("tau_ext_in_base", 896), ("theta", 992),
     ("errors", 1216), ("success_rate", 1236), ("robot_mode", 1246)],
)  # fmt: skip
def test_state_fields_stand_where_the_notes_say(name: str, offset: int) -> None:
    assert rci.STATE.offset(name) == offset


def test_datagrams_have_the_sizes_the_vendor_client_insists_on() -> None:
    assert (rci.STATE_SIZE, rci.COMMAND_SIZE, rci.MAX_FRAME_SIZE) == (1247, 290, 1291)
    assert rci.COMMAND.offset("psi_valid") == 192
    assert rci.COMMAND.offset("tau_c") == 234


def test_the_seventh_element_of_a_6_axis_arm_is_dropped_even_when_it_is_nan() -> None:
    datagram = bytearray(rci.encode_command(CommandPacket(1, ONE_TO_7, POSE)))
    struct.pack_into("<d", datagram, 8 + 6 * 8, math.nan)
    assert rci.decode_command(bytes(datagram), 6).q_c == ONE_TO_6


def test_a_6_axis_state_keeps_its_seventh_elements_empty_on_the_wire() -> None:
    ramp = struct.pack(">Q", 1) + struct.pack("<151d", *range(151)) + bytes(20) + struct.pack("<d3B", 1.0, 0, 5, 1)
    state = rci.decode_state(ramp, 6)
    assert state.q.shape == state.motor_tau_filtered.shape == (6,)
    again = rci.encode_state(state)
    assert len(again) == rci.STATE_SIZE
    assert np.frombuffer(again, "<f8", 7, 8).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.0]
    assert np.array_equal(rci.decode_state(again, 6).motor_tau, np.arange(137.0, 143.0))


def test_cartesian_motion_is_numbered_2_in_the_request_and_3_in_the_state() -> None:
    assert rci.StartMotionMode(2).shown_as == MotionGeneratorMode.CARTESIAN_POSITION == 3
