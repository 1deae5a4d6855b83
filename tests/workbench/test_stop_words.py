"""Words about an error bit that an emergency stop has set, while it is pressed and after its release."""

from __future__ import annotations

import pytest

from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.state import RobotMode
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.faults import Fault
from rcilab.sim.api import WorldStatus
from rcilab.workbench.panels.run import faults_html

FAULTS = frozenset({Fault.INSTABILITY_DETECTION})
LOST = Text("en")("fault.INSTABILITY_DETECTION")


def world(code: str) -> WorldStatus:
    reason = Remark("an emergency stop was pressed", code)
    return WorldStatus(model="xMatePro7", plant="ideal", cycle=9, phase="off", reason=reason)


def test_after_the_release_no_lost_commands_are_named() -> None:
    released = SupervisorStatus(phase="fault", code="fault", faults=FAULTS, robot_mode=RobotMode.OTHER)
    said = faults_html(released, Text("en"), world("estop"))
    assert LOST not in said
    assert "Power on" in said
    assert LOST in faults_html(released, Text("en"), world("lost_in_row"))
    assert LOST in faults_html(released, Text("en"), None)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_a_pressed_stop_does_not_promise_that_its_release_clears_the_bit(language) -> None:
    pressed = SupervisorStatus(phase="fault", code="fault", faults=FAULTS, robot_mode=RobotMode.USER_STOPPED)
    said = faults_html(pressed, Text(language), None)
    assert {"en": "Power on", "zh": "上电"}[language] in said
