"""A motion that was slowed on its way: its plan is drawn at the times it was run at, and the cursor with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.planning import Plan, make_plan
from rcilab.app.run.played_motion import moment_played, played_at, played_path, scaled_motion_of, streamed_rows
from rcilab.app.run.replay import replayed
from rcilab.app.run.run_recorder import as_recording
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.conformance.speed_scaling_check import plan_speed_override
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion.speed_scaling import as_planned
from rcilab.views.plots import build_frame, plan_curves, recorded_curves, streamed_curves
from rcilab.workbench.panels.plot_contents import legend_html
from rcilab.workbench.panels.status import status_values
from tests.recording.runs import some_cycles, some_run
from tests.workbench.test_status_text import initial_state, status

CHANGED = 200  # [cycles] At which the motion is slowed.


@pytest.fixture(scope="module")
def slowed() -> UiState:
    """A state whose motion was run at half its pace from its 200th cycle on, by an arm that follows exactly."""
    state = initial_state()
    plan = make_plan(state.model, state.model.home, state.model.home + 0.3, 0.3, "jerk_limited")
    assert isinstance(plan, Plan)
    scaled_motion = plan_speed_override(as_planned(plan.motion), CHANGED, 0.5, state.model, "joint_position")
    motion = scaled_motion.as_motion()
    cycles = np.zeros(len(motion.q), some_cycles().dtype)
    cycles["t"], cycles["q"], cycles["q_c"], cycles["dq"] = motion.times, motion.q, motion.q, motion.dq
    return replace(state, plan=plan, recording=as_recording(cycles, 0, scaled_motion))


@pytest.mark.parametrize("quantity", ["q", "dq", "ddq", "jerk"])
def test_plan_and_actual_lie_on_each_other_and_break_no_limit(slowed, quantity):
    recording, (_, rows) = slowed.recording, played_path(slowed)
    planned = streamed_curves(rows, quantity, slowed.model)
    actual = recorded_curves(recording.t, recording.q, recording.q_c, recording.dq, quantity)
    once = plan_curves(slowed.plan.motion, quantity)
    count = min(len(once.t), len(actual.t))
    before = np.abs(once.values[CHANGED:count] - actual.values[CHANGED:count]).max()
    assert np.abs(planned.values - actual.values).max() < 0.02 * before
    assert not build_frame(planned, actual, slowed.model.limits.joint, quantity, 0).violated.any()


def test_the_torque_is_that_of_the_rows(slowed):
    rows = played_path(slowed)[1]
    still = streamed_curves(rows[-1:].repeat(5, axis=0), "tau", slowed.model).values[-1]
    assert streamed_curves(rows, "tau", slowed.model).values.shape == rows.shape
    assert still == pytest.approx(slowed.model.torque(rows[-1]).full)


def test_the_cursor_stands_where_the_plan_was_when_it_was_run_and_a_click_finds_it_again(slowed):
    moment = 0.6 * slowed.plan.motion.duration
    t = played_at(slowed, moment)
    assert t > moment + 0.1
    assert slowed.recording.scaled_motion.q[round(t / CYCLE_TIME)] == pytest.approx(
        slowed.plan.motion.at(moment).q, abs=1e-3
    )
    assert moment_played(slowed, t) == pytest.approx(moment, abs=2 * CYCLE_TIME)
    bar = status_values(replace(slowed, playhead=0.6), status(), Text("en"), 2.0 * t)
    assert bar["cursor"]["share"] == pytest.approx(0.5, abs=1e-3)


def test_the_legend_says_so_in_both_languages(slowed):
    for language, word in (("en", "as executed"), ("zh", "按实际执行的时间")):
        text = Text(language)
        assert word in legend_html(0, 7, text, "light", has_actual=True, is_scaled=True)
        assert word not in legend_html(0, 7, text, "light", has_actual=True)


def test_a_run_from_a_file_is_drawn_as_it_was_streamed():
    run = some_run(has_speed_override=True)
    shown = replayed(initial_state(), run)
    assert streamed_rows(shown) is run.plan.q
    assert streamed_rows(replayed(initial_state(), some_run())) is None


def test_another_plan_has_its_own_times(slowed):
    other = make_plan(slowed.model, slowed.model.home, slowed.model.home - 0.2, 0.3, "jerk_limited")
    assert isinstance(other, Plan)
    state = replace(slowed, plan=other)
    assert scaled_motion_of(state) is None
    assert played_path(state)[1] is other.motion.q
    assert played_at(state, 0.3) == moment_played(state, 0.3) == 0.3
