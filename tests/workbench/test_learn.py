"""The Learn tab without a browser: a fault beside the page, its show, and lessons that watch."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.fault_lab.demo_view import body_html, head_html
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import ChooseBranch, GoalActions, SetArmAngle
from rcilab.app.learn.learn_actions import LearnActions, PressLearn
from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.learn.lessons import LESSONS, lessons_of
from rcilab.app.run.recording import Recording
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.units import Units
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.views.plots import build_frame, mark_moment, plan_curves
from rcilab.workbench.panels.learn_lesson import steps_html
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)


class Bench:
    """A page's Learn tab on an arm that does what it is told to."""

    def __init__(self, model=MODEL) -> None:
        q = np.array(model.home)
        self.status = SimpleNamespace(phase="idle", code="idle", q_c=q, tau_ext=None)
        session = SimpleNamespace(status=lambda: self.status)
        self.store = Store(UiState(model=model, goal=goal_at(model, q)))
        self.goal = GoalActions(self.store, session)
        self.learn = LearnActions(self.store, session)

    @property
    def state(self) -> UiState:
        return self.store.state

    def press(self, what, **values) -> None:
        self.learn.press(PressLearn(what=what, **values))

    def provoke(self, fault: Fault) -> None:
        self.press("provoke", fault=int(fault))

        def shown() -> bool:
            self.learn.tick()
            return self.state.learn.provoking is None

        wait_for(shown, 30.0, f"{fault.name} on show")

    def step(self) -> int:
        self.learn.tick()
        assert self.state.learn.lesson is not None
        return self.state.learn.lesson.step


@pytest.fixture
def bench() -> Iterator[Bench]:
    found = Bench()
    yield found
    found.learn.close()


def test_a_fault_is_shown_at_its_moment_and_the_plan_of_the_page_is_kept(bench: Bench) -> None:
    bench.goal.set_joints(HOME + 0.1)
    own = bench.state.plan
    bench.provoke(Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY)
    show = bench.state.learn.show
    assert show is not None
    assert show.demo.fault is Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY
    assert bench.state.plan is own
    seen = displayed_state(bench.state, scene=True)
    assert seen.plan is show.displayed.scene
    assert [row.id for row in show.displayed.plan.report.rows if not row.ok and row.fault] == ["joint.jerk"]
    assert (
        np.abs(
            seen.plan.motion.at(seen.playhead * seen.plan.motion.duration).q - show.demo.moved.q[show.demo.sample]
        ).max()
        < 1e-3
    )
    for language in LANGUAGES:
        for units, bound in ((Units(angle="rad", length="m"), "5000 rad/s³"), (Units(), "286479°/s³")):
            text = Text(language, units)
            said = head_html(show.demo, text) + body_html(show.demo, text)
            assert "kCommandJointAccelerationDiscontinuity" in said.replace("<wbr>", "")
            assert bound in said
            assert not re.search(r"\d ?(?:rad|m/)" if units.angle == "deg" else r"\d ?(?:°|mm)", said), said
    bench.goal.set_joints(HOME - 0.1)
    bench.learn.tick()
    assert bench.state.learn.show is None, "another plan is to be seen"
    assert displayed_state(bench.state) is bench.state


def test_the_controlled_stop_after_the_fault_is_shown_too_and_its_moment_marked(bench: Bench) -> None:
    bench.provoke(Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY)
    show = bench.state.learn.show
    assert show is not None
    demo, recording = show.demo, show.recording
    assert recording.moment == demo.time == demo.cycles["t"][-1]
    assert 0.1 < recording.t[-1] - demo.time <= 0.3
    assert np.abs(recording.dq[-1]).max() < 1e-3, "it stands still"
    assert 0.0 < bench.state.playhead == show.playhead < 1.0
    assert (
        show.displayed.scene.motion.duration
        == show.displayed.plan.motion.duration
        == pytest.approx(recording.t[-1], abs=2e-3)
    )
    frame = build_frame(plan_curves(show.displayed.plan.motion, "q"), None, MODEL.limits.joint, "q", 0)
    marked = mark_moment(frame, demo.time)
    assert np.abs(marked.t[marked.violated & ~frame.violated] - demo.time).min() < 0.02


def test_dropped_states_leave_one_clock_for_timeline_and_report(bench: Bench) -> None:
    bench.provoke(Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY)
    show = bench.state.learn.show
    assert show is not None
    kept = np.delete(np.arange(len(show.demo.cycles)), [5, 6, 7])
    demo = replace(show.demo, cycles=show.demo.cycles[kept])
    assert demo.sample == demo.cycle - 3
    assert demo.commanded.duration == demo.moved.duration == pytest.approx(show.demo.commanded.duration)
    np.testing.assert_allclose(demo.commanded.q[demo.cycle], show.demo.commanded.q[show.demo.sample])
    assert f"t = {demo.time:.3f} s, cycle {demo.cycle}" in head_html(demo, Text("en"))


def test_who_cancels_sees_nothing(bench: Bench) -> None:
    bench.press("provoke", fault=int(Fault.COLLISION))
    bench.press("cancel")
    bench.learn.tick()
    assert bench.state.learn.provoking is None
    assert bench.state.learn.show is None


def test_an_arm_of_six_axes_is_told_that_it_has_no_elbow() -> None:
    bench = Bench(load_model("xMate7"))
    bench.press("provoke", fault=int(Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION))
    problem = bench.state.learn.problem
    assert problem is not None
    assert problem.code == "learn.no_elbow"


def test_every_button_step_and_lesson_has_words() -> None:
    known = set(load_ui_catalogue("rcilab.app", "en"))
    wanted = {f"label.{fault.key}" for fault in Fault}
    wanted |= {f"lesson.{name}" for name in LESSONS}
    wanted |= {f"lesson.{name}.{step.name}" for name, steps in LESSONS.items() for step in steps}
    assert sorted(wanted - known) == []


def run_that(stopped: str | None) -> Recording:
    run, none = SimpleNamespace(is_complete=True, stopped=stopped, faults=()), np.zeros((1, 7))
    return Recording(t=np.zeros(1), q=none, q_c=none, dq=none, delay=0, run=run)


def test_a_lesson_that_an_arm_cannot_do_is_not_offered() -> None:
    assert lessons_of(MODEL) == tuple(LESSONS)
    assert set(LESSONS) - set(lessons_of(load_model("xMate3"))) == {"elbow"}
    assert set(LESSONS) - set(lessons_of(load_model("Panda"))) == {"push"}
    bench = Bench(load_model("xMate3"))
    bench.press("lesson", name="elbow")
    assert bench.state.learn.lesson is None


def test_the_first_lesson_ticks_itself_off(bench: Bench) -> None:
    bench.press("lesson", name="first")
    assert bench.step() == 0
    bench.goal.set_joints(HOME + 0.3)
    assert bench.step() == 1
    assert bench.step() == 1
    bench.store.update(playhead=0.4)
    assert bench.step() == 2
    bench.store.update(plan=bench.state.plan.completed())
    bench.step()
    assert bench.step() == 3
    bench.status.phase = "moving"
    bench.step()
    bench.step()
    bench.status.phase = "idle"
    bench.store.update(last_run=run_that("Stop was pressed"))
    assert bench.step() == 4  # Halfway is no arrival.
    bench.store.update(last_run=run_that(None))
    assert bench.step() == 5
    assert bench.state.notice is not None
    assert Text("en").render(bench.state.notice.text) == "✓ Done. Lesson complete."
    assert "Lesson complete" in steps_html(bench.state.learn.lesson, Text("en"))
    bench.press("leave")
    assert bench.state.learn.lesson is None


def test_a_step_can_be_skipped_and_says_so(bench: Bench) -> None:
    bench.press("lesson", name="push")
    bench.press("skip")
    assert bench.step() == 1
    assert 'aria-label="skipped"' in steps_html(bench.state.learn.lesson, Text("en"))


def test_the_elbow_lesson_sees_the_elbow_turn(bench: Bench) -> None:
    bench.goal.set_joints(HOME + 0.3)
    bench.press("lesson", name="elbow")
    bench.press("skip")
    assert bench.step() == 1
    assert bench.state.goal.psi is not None
    bench.goal.set_arm_angle(SetArmAngle(psi=bench.state.goal.psi + 0.25))
    assert bench.step() == 2
    bench.step()
    others = bench.state.goal.reach.solutions
    far = next(k for k, q in enumerate(others) if np.abs(q - bench.state.goal.q).max() > 0.5)
    bench.goal.choose_branch(ChooseBranch(index=far))
    assert bench.step() == 3
