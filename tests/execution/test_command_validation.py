"""The arm angle of a command counts for an arm with a redundancy, whatever its number of joints."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcilab.core.command import CartesianPosition, JointPosition
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.execution.command_validation import describe_distance, distance_to, find_start_mismatch, require_start
from rcilab.makers.maker import start_tolerance_of
from rcilab.model.robot_model import load_model

LIMITS = load_model("xMatePro7").limits
TURNED = CartesianPosition(np.eye(4), 0.5)


@pytest.mark.parametrize("joints", [6, 7, 8])
def test_the_arm_angle_counts_by_the_redundancy_and_not_by_the_number_of_joints(joints: int) -> None:
    state: Any = SimpleNamespace(q_c=np.zeros(joints), T_base_tool_c=Pose(), psi_c=0.0)
    require_start(TURNED, state, LIMITS, has_psi=False)
    assert distance_to(state, TURNED, has_psi=False) == 0.0
    with pytest.raises(InvalidValueError, match="psi of the first command"):
        require_start(TURNED, state, LIMITS, has_psi=True)
    assert distance_to(state, TURNED, has_psi=True) == 0.5
    assert describe_distance(state, TURNED, has_psi=True) == "the arm angle is 28.65 deg"


@pytest.mark.parametrize(
    ("position", "is_named"),
    [((0.0, 0.0, 0.0), True), ((0.01, 0.0, 0.1034), True), ((-0.02123, 0.0117, 0.0986), False)],
)
def test_a_first_pose_names_the_tool_that_would_explain_it_if_that_is_one_of_round_numbers(
    position: tuple[float, float, float], is_named: bool
) -> None:
    ours, flange = Pose((0.0, 0.0, 0.12)), Pose((0.4, 0.1, 0.5), (0.5, -0.1, 0.7, 0.2))
    state: Any = SimpleNamespace(T_base_tool_c=flange @ ours)
    with pytest.raises(InvalidValueError, match="must be the present pose") as raised:
        require_start(
            CartesianPosition((flange @ Pose(position)).matrix), state, LIMITS, has_psi=False, T_flange_tool=ours
        )
    assert ("in the flange" in str(raised.value)) is is_named


def test_a_turned_first_pose_is_no_matter_of_the_tools_position() -> None:
    state: Any = SimpleNamespace(T_base_tool_c=Pose())
    with pytest.raises(InvalidValueError, match="must be the present pose") as raised:
        require_start(CartesianPosition(Pose(wxyz=(0.9, 0.1, 0.0, 0.0)).matrix), state, LIMITS, has_psi=False)
    assert "in the flange" not in str(raised.value)


def test_the_tolerance_of_a_start_is_a_number_to_read() -> None:
    said = find_start_mismatch(np.full(7, 1e-6), np.zeros(7))
    assert said is not None
    assert "(tolerance 1e-9 rad)" in said


def test_a_start_has_the_tolerance_of_the_states() -> None:
    rounded, tolerance = np.full(6, 1e-5), start_tolerance_of(load_model("RM65"))
    state: Any = SimpleNamespace(q_c=np.zeros(6))
    assert find_start_mismatch(rounded, np.zeros(6), tolerance) is None
    require_start(JointPosition(rounded), state, LIMITS, has_psi=False, resolution=tolerance)
    assert "(tolerance 1.7e-5 rad)" in str(find_start_mismatch(2.0 * rounded, np.zeros(6), tolerance))
    with pytest.raises(InvalidValueError, match=r"tolerance 0\.00100 deg"):
        require_start(JointPosition(2.0 * rounded), state, LIMITS, has_psi=False, resolution=tolerance)
