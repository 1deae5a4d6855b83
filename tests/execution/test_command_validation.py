"""The arm angle of a command counts for an arm with a redundancy, whatever its number of joints."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rcilab.core.command import CartesianPosition
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.execution.command_validation import describe_distance, distance_to, require_start
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
