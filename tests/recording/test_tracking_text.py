"""The table of errors says what it compares and why it may be all zeros: on the page and in the exported file alike."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.run.robot_requests import Outcome
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.text import Text as PageText
from rcilab.control_process import SupervisorStatus
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import load_model
from rcilab.notebook.status_texts import outcome_html as notebook_outcome
from rcilab.recording.html_facts import fact_rows
from rcilab.recording.run_html import run_html
from rcilab.recording.tracking_text import tracking_notes
from rcilab.workbench.panels.recording import summary_html
from tests.recording.runs import OFFSET, SETUP, export_run, some_ideal_run, some_run, some_stopped_run


def notes(run, language: str = "en") -> list[str]:
    """What the exported page says; the workbench must say the same."""
    page = export_run(run, ".html", language=language).decode()
    said = json.loads(page.split('id="content">')[1].split("</script>")[0])["facts"]["notes"]
    shown = summary_html(whole_recording(run), PageText(language))
    assert shown.count('<p class="rl-note">') == len(said)
    assert all(note in shown for note in said)
    assert said == tracking_notes(run, run.tracking, Text(language, "rcilab.recording"))
    return said


@pytest.mark.parametrize(("language", "word"), [("en", "follows exactly"), ("zh", "理想机械臂")])
def test_zeros_of_the_ideal_arm_are_explained(language, word):
    (note,) = notes(some_ideal_run(), language)
    assert word in note
    assert "MuJoCo" in note


def test_an_arm_that_lags_is_not_called_exact_and_an_unknown_one_is_not_called_ideal():
    assert notes(some_run()) == []  # MuJoCo.
    assert notes(replace(some_run(), setup=replace(SETUP, plant="ideal"))) == []  # With an impedance it lags, too.
    assert notes(replace(some_ideal_run(), setup=replace(SETUP, plant=""))) == []  # A controller somewhere.


@pytest.mark.parametrize(("language", "words"), [("en", "not with the planned elbow"), ("zh", "而不是与规划的肘部")])
def test_poses_without_the_elbow_are_compared_with_what_they_lead_to(language, words):
    run = replace(some_run(), model=load_model("FR3"), setup=replace(SETUP, mode="cartesian_position"))
    (note,) = notes(run, language)
    assert words in note
    assert notes(replace(run, setup=SETUP)) == []


def test_an_arm_that_yields_says_how_far_from_its_goal_it_ended():
    run = some_run()  # Joint 2 is off by 1 mrad.
    assert run.goal_error is not None
    assert np.allclose(run.goal_error, OFFSET * np.eye(7)[1], atol=1e-6)
    assert "ended 0.001 rad (0.057 deg) from its goal at joint 2" in repr(run)
    said = "Ran to its end, 0.06° from its goal at joint 2."
    assert said in run_html(run)
    run = replace(run, setup=replace(SETUP, mode="joint_impedance"))
    said = "Ran to its end, 0.06° from its goal at joint 2: the arm yields in a compliant mode."
    status = SupervisorStatus(phase="closed", code="closed")
    assert said in run_html(run)
    assert said in fact_rows(run, Text("en", "rcilab.recording"))[3][1]
    assert said in notebook_outcome(Outcome(what="execute", run=run), status, Text("en", "rcilab.notebook"))
    exact = some_ideal_run()
    assert exact.missed_goal is None
    assert "goal" not in repr(exact)
    assert some_stopped_run().goal_error is None


@pytest.mark.parametrize(("language", "words"), [("en", "until the stop at 0.300 s"), ("zh", "只比较到 0.300 s")])
def test_a_stopped_run_says_until_when_it_is_compared(language, words):
    (note,) = notes(some_stopped_run(), language)
    assert words in note


@pytest.mark.parametrize(("language", "word"), [("en", "speed override"), ("zh", "速度倍率")])
def test_a_run_at_another_pace_says_that_its_plan_has_other_times(language, word):
    (note,) = notes(some_run(has_speed_override=True), language)
    assert word in note
