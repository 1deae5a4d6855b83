"""The fault lab of UFACTORY's arms."""

from __future__ import annotations

from html import escape

import pytest

from rcilab.app.fault_lab import FaultLab
from rcilab.app.fault_lab.demo_view import body_html, head_html
from rcilab.app.text import Text
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.robots import ROBOTS
from rcilab.makers.ufactory.scenarios import scenarios_of
from rcilab.model.robot_model import load_model
from tests.makers.ufactory.library import needs_library


@needs_library
def test_errors_come_with_their_reason_and_the_arm_moves_again():
    with FaultLab("xArm6") as lab:
        assert [fault.manual_name for fault in lab.faults] == ["C23", "C35", "C22", "C60", "C31"]
        for fault in lab.faults:
            demo = lab.provoke(fault)
            assert demo.reported == (fault,)
            assert demo.condition.fault is fault
            assert demo.signal.is_broken
            assert demo.bound == 0.0 or fault is not UfactoryError.SAFETY_BOUNDARY
            assert demo.describe("sent", "en") != demo.describe("sent", "zh")
            assert demo.way_out[-2:] == ("recover", "move")
            assert all(
                demo.recovery_steps(language)[-1] in body_html(demo, Text(language)) for language in ("en", "zh")
            )
            assert f"reported by the controller: {escape(fault.cause)}" in head_html(demo, Text("en"))
            assert "个周期" not in head_html(demo, Text("zh")), "the record has every fifth cycle"
            assert ("客户端记录" in head_html(demo, Text("zh"))) is demo.signal.has_curve


@needs_library
@pytest.mark.parametrize("name", sorted(set(ROBOTS) - {"xArm6"}))
def test_a_tool_can_be_too_fast_on_every_arm(name):
    with FaultLab(name) as lab:
        demo = lab.provoke(UfactoryError.SERVO_LINEAR_SPEED)
    assert demo.bound == pytest.approx(1.2 * load_model(name).limits.cartesian.translation_velocity)
    assert demo.value > demo.bound


@pytest.mark.parametrize("name", ROBOTS)
def test_a_scenario_is_possible_on_every_arm(name):
    model = load_model(name)
    for scenario in scenarios_of(name):
        start = scenario.start(model)
        assert ((start > model.limits.joint.lower) & (start < model.limits.joint.upper)).all()
        assert model.clearance(start[None]).distance[0] > 0.005
