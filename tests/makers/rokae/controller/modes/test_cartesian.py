"""What is a pose, and what absurd numbers do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.conformance.pose_validation import find_frame_error
from rcilab.core.spatial import Pose
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault

GOOD = Pose.from_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)).as_row_major()


def changed(place: int, value: float) -> tuple[float, ...]:
    return (*GOOD[:place], value, *GOOD[place + 1 :])


def test_a_pose_is_a_pose_within_the_vendors_tolerance() -> None:
    assert find_frame_error(GOOD) is None
    assert find_frame_error(changed(0, GOOD[0] + 1e-6)) is None


@pytest.mark.parametrize(
    ("numbers", "word"),
    [
        (changed(0, GOOD[0] + 1e-4), "rotation"),
        (changed(3, math.nan), "finite"),
        (changed(7, math.inf), "finite"),
        (changed(15, 0.999), "last row"),
        (changed(12, 1e-9), "last row"),
        (tuple(np.diag((-1.0, 1.0, 1.0, 1.0)).ravel().tolist()), "reflection"),
        ((0.0,) * 16, "last row"),
    ],
)
def test_what_is_none_is_named(numbers: tuple[float, ...], word: str) -> None:
    assert word in (find_frame_error(numbers) or "")


@pytest.mark.parametrize("frequency", [1000.0, 50.0])
@pytest.mark.parametrize("value", [1e300, -1.7e308, math.nan, math.inf])
@pytest.mark.parametrize("gap", [1, 5])
def test_absurd_numbers_are_faults_and_never_followed(make_hand, frequency: float, value: float, gap: int) -> None:
    hand = make_hand()
    assert hand.ask(rci.SetFilters(frequency, frequency, frequency)) == 0
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix
    for _ in range(3):
        hand.pose(T)
    absurd = (*T.ravel()[:3].tolist(), value, *T.ravel()[4:].tolist())
    hand.cycle.receive(rci.CommandPacket(hand.state.message_id + gap - 1, T_base_tool_c=absurd))
    hand.step(gap)
    assert hand.state.faults
    assert {*hand.state.faults} <= {
        Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
        Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,
        Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME,
        Fault.INSTABILITY_DETECTION,
    }
    hand.step(50)
    assert all(np.isfinite(state.q_c).all() for state in hand.states)


@pytest.mark.parametrize("psi", [math.nan, math.inf, 3.2, -4.0])
def test_an_arm_angle_beyond_a_turn_is_an_elbow_fault(make_hand, psi: float) -> None:
    hand = make_hand()
    hand.start(1, 2)
    assert hand.pose(hand.state.T_base_tool_c, psi).faults == (
        Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
    )


def test_a_6_axis_arm_does_not_look_at_arm_angles(make_hand) -> None:
    hand = make_hand("xMate3")
    hand.start(1, 2)
    assert hand.pose(hand.state.T_base_tool_c, math.nan).faults == ()
