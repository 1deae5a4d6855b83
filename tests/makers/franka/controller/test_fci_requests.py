"""All commands of the FCI in both numberings: their answers, their statuses, and what they change in the state."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Output, Robot

NAN, INF = math.nan, math.inf
IDENTITY = (1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0)
FRAME = (0.0, 1.0, 0, 0, -1.0, 0, 0, 0, 0, 0, 1.0, 0, 0.01, 0.02, 0.1, 1.0)  # Column-major: 90 degrees about z.
NOT_PROPER = (2.0, *IDENTITY[1:])
ROWS = (1.0, 0, 0, 0.1, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0)  # Row-major by mistake.
TENSOR = (0.002, 0.0, 0.0, 0.0, 0.003, 0.0, 0.0, 0.0, 0.004)
GOOD = {
    "set_collision_behavior": wire.doubles(*((10.0,) * 7 + (20.0,) * 7) * 2, *((10.0,) * 6 + (20.0,) * 6) * 2),
    "set_joint_impedance": wire.doubles(*(3000.0,) * 7),
    "set_cartesian_impedance": wire.doubles(*(1000.0,) * 3, *(50.0,) * 3),
    "set_guiding_mode": bytes((1, 1, 0, 0, 1, 1, 0)),
    "set_ee_to_k": wire.doubles(*FRAME),
    "set_ne_to_ee": wire.doubles(*FRAME),
    "set_load": wire.doubles(0.5, 0.0, 0.01, 0.05, *TENSOR),
    "set_filters": wire.doubles(100.0, 200.0, 300.0, 400.0, 500.0),
}
BAD = {
    "thresholds crossed": ("set_collision_behavior", wire.doubles(*((20.0,) * 7 + (10.0,) * 7) * 2, *(10.0,) * 24)),
    "thresholds below zero": ("set_collision_behavior", wire.doubles(*(-1.0,) * 52)),
    "thresholds no numbers": ("set_collision_behavior", wire.doubles(*(NAN,) * 52)),
    "stiffness below zero": ("set_joint_impedance", wire.doubles(-1.0, *(3000.0,) * 6)),
    "stiffness too high": ("set_joint_impedance", wire.doubles(*(3000.0,) * 6, 14251.0)),
    "stiffness no number": ("set_joint_impedance", wire.doubles(*(3000.0,) * 6, NAN)),
    "Cartesian stiffness too high": ("set_cartesian_impedance", wire.doubles(3001.0, *(10.0,) * 5)),
    "Cartesian stiffness too low": ("set_cartesian_impedance", wire.doubles(*(10.0,) * 5, 0.5)),
    "Cartesian stiffness no number": ("set_cartesian_impedance", wire.doubles(*(10.0,) * 5, NAN)),
    "frame K not proper": ("set_ee_to_k", wire.doubles(*NOT_PROPER)),
    "frame K by rows": ("set_ee_to_k", wire.doubles(*ROWS)),
    "frame K no number": ("set_ee_to_k", wire.doubles(NAN, *IDENTITY[1:])),
    "frame EE not proper": ("set_ne_to_ee", wire.doubles(*NOT_PROPER)),
    "frame EE far away": ("set_ne_to_ee", wire.doubles(*IDENTITY[:12], 3.0, 0.0, 0.0, 1.0)),
    "mass below zero": ("set_load", wire.doubles(-0.1, 0.0, 0.0, 0.0, *TENSOR)),
    "mass no number": ("set_load", wire.doubles(NAN, 0.0, 0.0, 0.0, *TENSOR)),
    "mass above the rated one": ("set_load", wire.doubles(3.0000001, 0.0, 0.0, 0.0, *TENSOR)),
    "inertia of no body": ("set_load", wire.doubles(1.0, 0.0, 0.0, 0.0, -1.0, *TENSOR[1:])),
    "inertia no number": ("set_load", wire.doubles(1.0, 0.0, 0.0, 0.0, *TENSOR[:8], INF)),
    "filter too low": ("set_filters", wire.doubles(0.5, *(100.0,) * 4)),
    "filter too high": ("set_filters", wire.doubles(*(100.0,) * 4, 1001.0)),
    "filter no number": ("set_filters", wire.doubles(*(100.0,) * 4, NAN)),
}


def setters(robot: Robot) -> list[str]:
    return [name for name in wire.commands_of(robot.version) if name in wire.SETTERS]


def test_every_setter_is_taken_at_rest(robot: Robot) -> None:
    for name in setters(robot):
        assert robot.ask(name, GOOD[name]) == ("success", b"")


def test_no_setter_is_possible_in_a_motion(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    for name in setters(robot):
        assert robot.ask(name, GOOD[name]).status == "not possible"
    ending = robot.play(robot.state(), [Output(q=start.q_d)] * 5)
    assert ending.status == "success"
    for name in setters(robot):
        assert robot.ask(name, GOOD[name]).status == "success"


@pytest.mark.parametrize("case", BAD)
def test_a_value_out_of_its_bounds_is_an_invalid_argument_and_changes_nothing(
    robot: Robot, place: FciArena, case: str
) -> None:
    name, payload = BAD[case]
    if name not in setters(robot):
        return
    before, settings = robot.state(), place.controller.settings
    assert robot.ask(name, payload).status == "invalid argument"
    after = robot.skip(2)
    assert after.data[8:] == before.data[8:]
    assert place.controller.settings is settings


@pytest.mark.parametrize("version", [5, 10])
def test_a_refusal_is_one_line_that_names_the_value_and_its_bound(version: int) -> None:
    with fci_arena(version) as place, place.connect() as robot:
        robot.ask(*BAD["stiffness too high"])
        robot.ask("set_load", BAD["mass above the rated one"][1])
        assert place.simulate("set_load", mass=0.73)["ok"]
        robot.ask("set_load", wire.doubles(2.5, 0.0, 0.0, 0.0, *TENSOR))
        robot.skip(2)
        invalid = "was answered: an argument is not valid;"
        assert place.log("refused") == [
            f"SetJointImpedance {invalid} stiffness of joint 7: 14251.0 N m/rad is outside 0 to 14250 N m/rad",
            f"SetLoad {invalid} mass: 3.0000001 kg is above 3 kg, the rated payload",
            f"SetLoad {invalid} mass: 2.5 kg and 0.73 kg of the end effector are above 3 kg, the rated payload",
        ]


def test_frames_and_load_are_in_the_state_and_move_the_tool(robot: Robot) -> None:
    before = robot.state()
    for name in ("set_ee_to_k", "set_ne_to_ee", "set_load"):
        assert robot.ask(name, GOOD[name]).status == "success"
    after = robot.skip(3)
    assert after.EE_T_K == after.NE_T_EE == after.F_T_EE == pytest.approx(FRAME)
    assert after.F_T_NE == pytest.approx(IDENTITY)
    expected = matrix(before.O_T_EE) @ matrix(FRAME)
    assert matrix(after.O_T_EE) == pytest.approx(expected, abs=1e-6)
    assert matrix(after.O_T_EE_d) == pytest.approx(expected, abs=1e-6)
    assert after.m_load == (0.5,)
    assert after.F_x_Cload == pytest.approx((0.0, 0.01, 0.05))
    assert after.I_load == pytest.approx(TENSOR)
    assert after.m_ee == (0.0,)
    assert after.tau_J[1] != pytest.approx(before.tau_J[1], abs=0.1)  # It bears the load now.
    assert after.tau_ext_hat_filtered == programs.ZERO


def test_the_load_may_be_a_line_without_thickness(toucher: Robot) -> None:
    assert (
        toucher.ask("set_load", wire.doubles(0.3, 0.0, 0.0, 0.05, 0.0023, 0, 0, 0, 0.0023, 0, 0, 0, 0)).status
        == "success"
    )
    assert toucher.skip(3).m_load == pytest.approx((0.3,))


def test_a_soft_joint_gives_way_and_a_stiff_one_less(toucher: Robot, felt: FciArena) -> None:
    def deflection(stiffness: float) -> float:
        assert toucher.ask("set_joint_impedance", wire.doubles(*(stiffness,) * 7)).status == "success"
        state = start = toucher.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        felt.simulate("push", wrench=[0.0, 0.0, -15.0, 0.0, 0.0, 0.0])
        for _ in range(1000):
            toucher.answer(state, Output(q=start.q_d))
            state = toucher.state()
        felt.simulate("release")
        toucher.stop()
        toucher.skip(300)
        return abs(state.q[1] - start.q[1])

    soft, stiff = deflection(400.0), deflection(2000.0)
    assert soft > 3.0 * stiff > 0.0


def test_error_recovery_stop_and_wall_at_rest(robot: Robot) -> None:
    assert robot.ask("automatic_error_recovery") == ("success", b"")
    assert robot.ask("stop_move") == ("success", b"")
    if robot.version == 5:
        answer = robot.ask("get_cartesian_limit", struct.pack("<i", 0))
        assert answer.status == "success"
        *numbers, active = struct.unpack("<3d16d?", answer.content)
        assert (numbers[:3], tuple(numbers[3:]), active) == ([0.0] * 3, IDENTITY, False)


def test_recovery_is_refused_in_a_motion(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    assert robot.ask("automatic_error_recovery").status == "not possible"
    assert robot.play(robot.state(), [Output(q=start.q_d)] * 3).status == "success"


def test_the_model_is_a_urdf_or_a_library(robot: Robot) -> None:
    if robot.version == 10:
        answer = robot.ask("get_robot_model")
        assert answer.status == "success"
        assert answer.content.startswith(b'<?xml version="1.0" ?>')
        assert answer.content.rstrip().endswith(b"</robot>")
        return
    answer = robot.ask("load_model_library", bytes((0, 0)))
    assert answer.status == "success"
    assert answer.content.startswith(b"\x7fELF")
    for architecture, system in ((1, 0), (2, 0), (0, 1), (9, 9)):
        assert robot.ask("load_model_library", bytes((architecture, system))) == ("error", b"")


def test_a_move_at_a_singular_pose_is_refused_for_the_tool_and_begins_for_joints(robot: Robot, place: FciArena) -> None:
    flip = -0.467002423653011  # [rad] Joint 4 of the stretched arm.
    assert place.simulate("place_arm", q=[0.0, 0.0, 0.0, flip, 0.0, 1.6, 0.0])["ok"]
    robot.skip(2)
    for generator in (wire.CARTESIAN_POSE, wire.CARTESIAN_VELOCITY):
        assert robot.try_move(wire.JOINT_IMPEDANCE, generator) == "singular"
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION) == "started"
    robot.stop()


@pytest.mark.parametrize("bounds", [(NAN, 1.0, 1.0), (-0.1, 1.0, 1.0)])
def test_deviations_that_are_no_bounds_are_an_invalid_argument(robot: Robot, bounds: tuple[float, ...]) -> None:
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION, path=bounds) == "invalid argument"
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION, goal=bounds) == "invalid argument"


@pytest.mark.parametrize("version", [5, 10])
def test_a_move_with_an_invalid_argument_is_refused_with_the_reason(version: int) -> None:
    with fci_arena(version) as place, place.connect() as robot:
        robot.try_move(3, wire.JOINT_POSITION)
        robot.try_move(wire.JOINT_IMPEDANCE, 9)
        robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION, path=(0.1, -1.0, 0.1))
        robot.skip(2)
        invalid = "Move was answered: an argument is not valid;"
        assert place.log("refused") == [
            f"{invalid} controller mode must be 0 to 2, got 3",
            f"{invalid} motion generator mode must be 0 to {4 if version == 10 else 3} in version {version}, got 9",
            f"{invalid} path deviation must be 0 or more [m, rad, rad], got (0.1, -1.0, 0.1)",
        ]


@pytest.mark.parametrize("version", [5, 10])
def test_bytes_after_a_request_are_ignored(version: int) -> None:
    with fci_arena(version) as place, place.connect() as robot:
        assert robot.ask("stop_move", b"more").status == "success"
        assert robot.ask("set_joint_impedance", GOOD["set_joint_impedance"] + b"\0" * 9).status == "success"


def matrix(columns: tuple[float, ...]) -> np.ndarray:
    return np.reshape(columns, (4, 4)).T
