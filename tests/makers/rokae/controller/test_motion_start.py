"""Where a motion may begin: at the reference, at what was measured, or at the client's own last command."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.generators.start import StartOffset, start_tolerance

MODEL = load_model("xMatePro7")
POSITION_MODES = [(0, 1), (1, 2), (2, 1), (3, 2)]


def hold(hand, mode: tuple[int, int], offset: float, cycles: int = 300) -> None:
    """Commands one constant place near the reference: an offset of joint 2 in [rad], or of the tool along y in [m]."""
    q, T = hand.state.q_c.copy(), hand.state.T_base_tool_c.matrix
    q[1] += offset
    T[1, 3] += offset
    for _ in range(cycles):
        if (hand.pose(T) if mode[1] == 2 else hand.command(q)).faults:
            break


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("mode", POSITION_MODES)
@pytest.mark.parametrize("offset", [1e-9, 1.6e-6, 2.5e-6, 4e-6, 1e-4, 9e-4])
def test_an_offset_at_the_start_is_absorbed_within_the_limits(make_hand, plant, mode, offset) -> None:
    hand = make_hand(plant=plant)
    hand.start(*mode)
    start, T_start = hand.state.q_c, hand.state.T_base_tool_c.matrix
    first = len(hand.states)
    hold(hand, mode, offset)
    assert hand.state.faults == ()
    if mode[1] == 2:
        assert hand.state.T_base_tool_c.matrix[1, 3] - T_start[1, 3] == pytest.approx(offset, abs=1e-12)
    else:
        assert hand.state.q_c[1] - start[1] == pytest.approx(offset, abs=1e-12)
    q_c = np.array([state.q_c for state in hand.states[first - 1 :]])
    limits = hand.model.limits.joint
    measured = np.array([state.q for state in hand.states[first - 1 :]])
    assert (np.abs(np.diff(measured, 2, axis=0)) <= limits.acceleration * 1e-6).all()
    if offset > 1e-5:
        assert (np.abs(np.diff(q_c, 2, axis=0)) <= 0.2 * limits.acceleration * 1e-6).all()
        assert (np.abs(np.diff(q_c, 3, axis=0)) <= 0.2 * limits.jerk * 1e-9).all()


@pytest.mark.parametrize(("mode", "words"), [((0, 1), "joint 2"), ((1, 2), "first commanded position")])
def test_a_start_beyond_the_tolerance_is_a_fault_that_names_the_start(make_hand, mode, words) -> None:
    hand = make_hand()
    hand.start(*mode)
    hold(hand, mode, 1.1e-3)
    assert Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY in hand.state.faults or (
        Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION in hand.state.faults
    )
    said = str(hand.cycle.reason)
    assert words in said
    assert "more than" in said
    assert "begin at" in said


def test_a_first_arm_angle_elsewhere_is_refused_with_its_numbers(make_hand) -> None:
    hand = make_hand()
    hand.start(1, 2)
    hand.pose(hand.state.T_base_tool_c, hand.state.psi_c + 0.1)
    assert hand.state.faults
    assert "the first commanded arm angle" in str(hand.cycle.reason)
    assert "5.73°" in str(hand.cycle.reason)


@pytest.mark.parametrize("mode", POSITION_MODES)
def test_a_motion_that_begins_at_full_jerk_is_no_new_start(make_hand, mode) -> None:
    """The first command may be as far off as one cycle's jerk: then it is the first step of the motion."""
    hand = make_hand()
    hand.start(*mode)
    q, T = hand.state.q_c.copy(), hand.state.T_base_tool_c.matrix
    jerk = 0.2 * hand.model.limits.cartesian.translation_jerk if mode[1] == 2 else 0.9 * hand.model.limits.joint.jerk[0]
    steps = np.cumsum(np.cumsum(np.cumsum(np.repeat([jerk, 0.0, -jerk], [1, 0, 1])))) * 1e-9
    for step in steps:  # Up and down again: a blip of two cycles.
        if mode[1] == 2:
            U = T.copy()
            U[1, 3] += step
            hand.pose(U)
        else:
            hand.command(q + np.eye(7)[0] * step)
        assert hand.state.faults == ()


def test_a_softer_spring_gives_more_tolerance_up_to_a_bound() -> None:
    settings = Settings.of(MODEL.description)
    stiff = start_tolerance(ControlLaw.POSITION, settings)
    assert stiff.joint == (1e-3,) * 7
    soft = start_tolerance(
        ControlLaw.CARTESIAN_IMPEDANCE, settings_with(settings, cartesian_stiffness=(1000.0,) * 3 + (100.0,) * 3)
    )
    assert soft.translation == pytest.approx(5e-3)
    assert soft.rotation == pytest.approx(5e-3)
    slack = start_tolerance(ControlLaw.CARTESIAN_IMPEDANCE, settings_with(settings, cartesian_stiffness=(0.0,) * 6))
    assert slack.translation == 0.02
    joint = start_tolerance(ControlLaw.JOINT_IMPEDANCE, settings_with(settings, joint_stiffness=(500.0,) * 7))
    assert joint.joint == pytest.approx((5e-3,) * 7)


def settings_with(settings, **values):
    from dataclasses import replace

    return replace(settings, **values)


@pytest.mark.parametrize("size", [1e-5, 1e-3, 5e-2])
def test_an_offset_is_absorbed_with_a_tenth_of_the_limits(size) -> None:
    limits = MODEL.limits.joint
    offset = StartOffset(limits, [size] * 7)
    rows = [[size] * 7] * 3
    while not offset.is_absorbed:
        rows.append(offset.step([0.0] * 7))
    rows += [offset.step([0.0] * 7) for _ in range(3)]
    q = np.array(rows)
    assert q[-1] == pytest.approx(np.zeros(7), abs=1e-15)
    assert (np.abs(np.diff(q, 2, axis=0)) <= 0.11 * limits.acceleration * 1e-6).all()
    assert (np.abs(np.diff(q, 3, axis=0)) <= 0.11 * limits.jerk * 1e-9).all()


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_an_endless_loop_of_impedance_motions_from_the_same_first_pose(make_hand, plant) -> None:
    """The vendor's cartesian_impedance_move: 4 s there and back, a pause, the same first pose again, for ever."""
    hand = make_hand(plant=plant)
    hand.ask(rci.SetMotorPower(1))
    hand.ask(rci.SetCartesianImpedance((1000.0, 1000.0, 1000.0, 100.0, 100.0, 100.0)))
    first = None
    for _ in range(3):
        hand.start(3, 2)
        T = hand.state.T_base_tool_c.matrix if first is None else first.copy()
        first = T.copy() if first is None else first
        for k in range(1, 4001):
            T[2, 3] = first[2, 3] - 0.1 * (1.0 - np.cos(np.pi / 4.0 * k * 1e-3 * 2.0)) / 2.0
            assert hand.pose(T).faults == (), str(hand.cycle.reason)
        assert hand.ask(rci.StopMove()) == 0
        hand.step(1000)


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("then", POSITION_MODES)
def test_after_a_push_of_a_few_newtons_the_first_pose_again_moves_the_arm_gently(make_hand, plant, then) -> None:
    """Under Cartesian impedance 4 N move the tool by 4 mm; then a motion begins where the last one was commanded to."""
    hand = make_hand(plant=plant)
    hand.ask(rci.SetMotorPower(1))
    hand.ask(rci.SetCartesianImpedance((1000.0, 1000.0, 1000.0, 100.0, 100.0, 100.0)))
    hand.start(3, 2)
    T, q = hand.state.T_base_tool_c.matrix, hand.state.q_c.copy()
    for k in range(600):
        hand.cycle.plant.push((0.0, 4.0 * min(1.0, k / 300.0), 0.0, 0.0, 0.0, 0.0))
        assert hand.pose(T).faults == ()
    assert hand.ask(rci.StopMove()) == 0
    hand.step(200)
    hand.start(*then)
    off = abs(hand.state.T_base_tool_c.matrix[1, 3] - T[1, 3])
    first = len(hand.states)
    for _ in range(600):
        state = hand.pose(T) if then[1] == 2 else hand.command(q)
        assert state.faults == (), str(hand.cycle.reason)
    measured = np.array([state.q for state in hand.states[first - 1 :]])
    assert 3e-3 < off < 5e-3
    assert (np.abs(np.diff(measured, 2, axis=0)) <= hand.model.limits.joint.acceleration * 1e-6).all()
    assert (
        np.allclose(hand.state.q_c, q, atol=1e-6)
        if then[1] == 1
        else np.allclose(hand.state.T_base_tool_c, T, atol=1e-9)
    )
