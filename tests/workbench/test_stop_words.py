"""Words about an error bit that an emergency stop has set, while it is pressed and after its release."""

from __future__ import annotations

import html

import numpy as np
import pytest

from rcilab.app.goal.goal import goal_at
from rcilab.app.run.plan_readiness import arm_obstacle
from rcilab.app.run.robot_requests import Outcome
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.status_text import describe_status
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import SAFETY_STOP, ControlError
from rcilab.core.state import RobotMode
from rcilab.i18n import translator
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.notebook.status_texts import outcome_html as notebook_outcome
from rcilab.recording.html_facts import describe_stop
from rcilab.recording.run import build_run, describe_end
from rcilab.sim.api import WorldStatus
from rcilab.workbench.panels.outcome import outcome_html
from rcilab.workbench.panels.run import faults_html

FAULTS = (Fault.INSTABILITY_DETECTION,)
LOST = Text("en")("fault.rokae.INSTABILITY_DETECTION")


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


@pytest.mark.parametrize(("language", "way_out"), [("en", "switch the power on"), ("zh", "上电")])
def test_after_the_release_the_way_out_is_the_power(language, way_out) -> None:
    released = SupervisorStatus(phase="fault", code="fault.released", faults=FAULTS, robot_mode=RobotMode.OTHER)
    text = Text(language)
    assert way_out in text.render(describe_status(released))
    refused = arm_obstacle("fault", False, is_released=True)
    assert refused is not None
    assert way_out in text.render(refused)
    assert text("fault.was_stop") in html.unescape(faults_html(released, text, None))


def test_the_times_of_a_clients_motion_count_from_its_first_played_command() -> None:
    cycles = np.zeros(61, cycle_dtype(7, playout=True))
    cycles["t"] = 1e-3 * np.arange(61)
    cycles["played"][51:55], cycles["age"][51:55] = 1, 51
    cycles["faults"][54:] = 1 << Fault.INSTABILITY_DETECTION
    model = load_model("xMatePro7")
    recording = whole_recording(build_run(cycles, plan=None, stopped="a fault", model=model))
    state = UiState(model=model, goal=goal_at(model, model.home), recording=recording)
    shown = outcome_html(state, SupervisorStatus(phase="idle"), Text("en"))
    assert "Ended by a fault at 0.003 s" in shown
    assert "Motion: 0.003 s. Recorded: 61 cycles, 0 without a command." in shown
    assert "no record" not in shown


@pytest.mark.parametrize("kind", ["estop", "gstop"])
def test_what_became_of_a_stopped_motion_names_the_stop_and_not_only_its_bit(kind) -> None:
    name = {"estop": "an emergency stop was pressed", "gstop": "the safety gate was opened"}[kind]
    error = ControlError("stopped", list(FAULTS)).coded(SAFETY_STOP, status=kind)
    cycles = np.zeros(3, cycle_dtype(7))
    cycles["t"] = [0.0, 0.001, 0.01]
    cycles["faults"][-1] = 1 << Fault.INSTABILITY_DETECTION
    run = build_run(cycles, plan=None, stopped=describe_end(error), model=load_model("xMatePro7"))
    assert run.stopped == name
    assert run.is_safety_stop
    recording = whole_recording(run)
    model = load_model("xMatePro7")
    state = UiState(model=model, goal=goal_at(model, model.home), recording=recording)
    shown = outcome_html(state, SupervisorStatus(phase="fault", code="fault.pressed", faults=FAULTS), Text("en"))
    assert f"{name} (reported as kInstabilityDetection)" in shown
    assert "Motion: 0.010 s. Recorded: 3 cycles, 0 without a command. 8 cycles have no record." in shown
    assert run.stopped is not None
    chinese = describe_stop(run.stopped, FAULTS, Text("zh"))
    assert {"estop": "急停", "gstop": "安全门"}[kind] in chinese
    told = notebook_outcome(Outcome(what="execute", error=error), None, translator.Text("en", "rcilab.notebook"))
    assert name in told
