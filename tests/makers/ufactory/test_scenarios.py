"""The fault lab of UFACTORY's arms."""

from __future__ import annotations

import pytest

from rcilab.app.fault_lab import FaultLab
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.robots import ROBOTS
from rcilab.makers.ufactory.scenarios import scenarios_of
from rcilab.model.robot_model import load_model
from tests.makers.ufactory.library import needs_library


@needs_library
def test_errors_come_with_their_reason_and_the_arm_moves_again():
    with FaultLab("xArm6") as lab:
        for fault in (UfactoryError.SAFETY_BOUNDARY, UfactoryError.SELF_COLLISION):
            demo = lab.provoke(fault)
            assert demo.reported == (fault,)
            assert demo.condition.fault is fault
            assert demo.way_out == ("recover", "move")


@pytest.mark.parametrize("name", ROBOTS)
def test_a_scenario_is_possible_on_every_arm(name):
    model = load_model(name)
    for scenario in scenarios_of(name):
        start = scenario.start(model)
        assert ((start > model.limits.joint.lower) & (start < model.limits.joint.upper)).all()
        assert model.clearance(start[None]).distance[0] > 0.005
