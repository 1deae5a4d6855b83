"""The Check tab without a browser: a row leads to its moment, a slow-down is found, taken back, and explained."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from rcilab.app.check.check_actions import CheckActions, PressCheck, plot_of
from rcilab.app.check.report_rows import passed_sentence, row_facts, row_tone, row_word
from rcilab.app.check.slowdown_job import scaled, slow_to_goal
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.planning import Plan, build_plan_view, make_plan
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import PlanProgram, ProgramActions
from rcilab.app.program.program_draft import Draft, number_at
from rcilab.app.run.plan_readiness import plan_obstacle
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.app.view_actions import PLOTS
from rcilab.conformance.check import check
from rcilab.conformance.time_scaling import can_slow_down_help
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.status import Phase
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.units import Units
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint, plan_joint
from rcilab.workbench.panels.check import CheckPanel
from rcilab.workbench.panels.check_rows import rows_html
from rcilab.workbench.panels.target import planned_html
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)


class Bench:
    """A page's check on an arm that stands at home."""

    def __init__(self, model=MODEL) -> None:
        session = SimpleNamespace(status=lambda: SimpleNamespace(phase="idle", q_c=HOME))
        self.store = Store(UiState(model=model, goal=goal_at(model, HOME)))
        self.goal = GoalActions(self.store, session)
        self.program = ProgramActions(self.store, session, self.goal)
        self.program.tick()
        self.check = CheckActions(self.store, session, self.goal, self.program)

    @property
    def state(self) -> UiState:
        return self.store.state

    @property
    def plan(self) -> Plan:
        assert self.state.plan is not None
        return self.state.plan

    def plan_far(self) -> None:
        """A motion at full speed that asks for more torque than the manual recommends."""
        self.store.update(speed=1.0, law="jerk_limited")
        self.goal.set_joints(HOME + np.array([1.0, 0.8, 0.0, -0.6, 0.0, 0.0, 0.0]))
        self.store.update(plan=self.plan.completed())
        assert self.plan.report.ok
        assert broken(self.plan)

    def press(self, what, row: str = "") -> None:
        self.check.press(PressCheck(what=what, row=row))

    def settle(self) -> None:
        def done() -> bool:
            self.check.tick()
            return self.state.check.doing is None

        wait_for(done, 30.0, "the work beside")


def broken(plan: Plan) -> set[str]:
    return {row.id for row in plan.report.rows if not row.ok}


@pytest.fixture
def bench() -> Bench:
    found = Bench()
    found.plan_far()
    return found


def test_a_row_leads_to_its_worst_moment_and_its_joint(bench: Bench) -> None:
    row = next(row for row in bench.plan.report.rows if row.id == "joint.velocity")
    bench.press("row", row.id)
    assert bench.state.playhead * bench.plan.motion.duration == pytest.approx(row.time)
    assert bench.state.plot_joint == row.joint
    bench.press("row", "joint.torque_rate")
    assert "tau" in bench.state.plots
    bench.press("row", "no.such")
    assert bench.state.check.seek_count == 2


def test_a_slow_down_changes_the_speed_until_it_passes_and_can_be_taken_back(bench: Bench) -> None:
    fast = bench.plan
    bench.press("slow")
    bench.settle()
    assert broken(bench.plan) == set()
    assert bench.plan.complete
    assert bench.plan.motion.duration > fast.motion.duration
    answer = bench.state.check.answer
    assert answer is not None
    assert answer.code in ("check.slowed", "check.stretched")
    bench.press("undo")
    assert bench.plan is fast
    assert bench.state.speed == 1.0
    assert bench.state.check.slowed is None


def test_what_passes_already_stays_and_says_so(bench: Bench) -> None:
    bench.press("slow")
    bench.settle()
    slow = bench.plan
    bench.press("slow")
    bench.settle()
    assert bench.plan is slow
    answer = bench.state.check.answer
    assert answer is not None
    assert answer.code == "check.already"


def test_a_way_into_the_floor_is_mended_by_no_slow_down() -> None:
    bench = Bench()
    bench.goal.set_joints(HOME + np.array([0.0, 1.4, 0.0, 0.9, 0.0, 0.0, 0.0]))
    bench.store.update(plan=bench.plan.completed())
    assert not bench.plan.report.ok
    assert not can_slow_down_help(bench.plan.report)
    bench.press("slow")
    bench.settle()
    advised = next(row for row in bench.plan.report.rows if row.id == "clearance.floor.advised")
    assert row_word(advised, Text("en")) == "below recommended"
    answer, found = bench.state.check.answer, bench.state.check.found
    assert answer is not None
    assert found is not None
    assert answer.code == "check.none"
    assert found.obstacle == "position"


def test_where_a_lower_speed_does_it_the_plan_is_made_anew_with_that(bench: Bench) -> None:
    slower = slow_to_goal(bench.plan, 1.0, "s_profile", None, lambda share: None)
    assert slower.plan is not None
    assert not slower.is_stretched
    assert slower.plan.motion.speed == pytest.approx(slower.scale)
    assert broken(slower.plan) == set()
    assert can_slow_down_help(bench.plan.report)
    assert not can_slow_down_help(slower.plan.report)


def test_a_line_that_is_slowed_down_stays_a_line() -> None:
    start = np.array(HOME)
    goal = MODEL.inverse(MODEL.forward(HOME) @ Pose((0.0, 0.15, 0.0)), psi=MODEL.arm_angle(HOME), near=HOME)[0]
    line = make_plan(MODEL, start, goal, 1.0, "jerk_limited", kind="line")
    assert isinstance(line, Plan)
    slower = slow_to_goal(line.completed(), 1.0, "jerk_limited", None, lambda share: None)
    assert slower.plan is not None
    path = slower.plan.path
    along = path[-1] - path[0]
    assert np.linalg.norm(np.cross(path - path[0], along / np.linalg.norm(along)), axis=1).max() < 1e-4


def test_a_slow_down_is_offered_only_where_it_meets_every_recommendation(bench: Bench) -> None:
    assert "Slow down to fit" in passed_sentence(bench.plan.report, Text("en"))
    arm = load_model("RM75")
    near = check(plan_joint(arm, arm.home, np.radians([60.0, -30.0, 0.0, 70.0, 0.0, 90.0, 0.0]), speed=0.5), arm)
    assert [row.id for row in near.rows if not row.ok] == ["clearance.links.advised"]
    sentence = passed_sentence(near, Text("en"))
    assert "Recommended ones exceeded, in amber: 1." in sentence
    assert "Slow down" not in sentence


def planned_program(bench: Bench) -> Draft:
    playhead = MODEL.forward(HOME)
    waypoints = (
        Waypoint.joint(HOME + np.array([1.0, 0.8, 0.0, -0.6, 0.0, 0.0, 0.0]), speed=1.0),
        Waypoint.line(Pose(playhead.position, playhead.wxyz), speed=0.5),
    )
    bench.program.restore(Program(model=MODEL.name, start=MODEL.home, waypoints=waypoints))
    bench.program.plan(PlanProgram())

    def planned() -> bool:
        bench.program.tick()
        return bench.state.plan is not None and bench.state.plan.program is not None

    wait_for(planned, 30.0, "the program's plan")
    return bench.state.program.draft


def test_a_program_is_slowed_as_a_whole_and_stays_that_program(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (
        "program.program_planning",
        "check.slowdown_job",
    ):  # By its own law this program conforms to everything.
        monkeypatch.setattr(f"rcilab.app.{module}.PROGRAM_LAW", "jerk_limited")
    draft, fast = planned_program(bench), bench.plan
    assert broken(fast)
    bench.press("slow")
    bench.settle()
    assert broken(bench.plan) < broken(fast)
    assert bench.plan.program is fast.program
    assert number_at(bench.plan, bench.plan.motion.duration) == number_at(fast, fast.motion.duration) == 2
    bench.press("undo")
    assert bench.plan is fast
    assert bench.state.program.planned is bench.state.program.draft is draft


def test_a_program_that_is_exchanged_for_a_slower_one_can_be_had_back(bench: Bench) -> None:
    draft, fast = planned_program(bench), bench.plan
    slow = scaled(draft, 0.5)
    assert [step.waypoint.speed for step in slow.steps] == [0.5, 0.25]
    bench.program.exchange(slow, fast)
    assert bench.state.program.planned is bench.state.program.draft is slow
    bench.program.editing.edit(EditProgram(what="undo"))
    assert bench.state.program.draft is draft


def test_what_is_cancelled_changes_nothing(bench: Bench) -> None:
    fast = bench.plan
    bench.press("slow")
    bench.press("cancel")
    bench.settle()
    assert bench.plan is fast
    assert bench.state.check.answer is None


def test_the_report_is_told_in_words(bench: Bench) -> None:
    bench.press("explain")
    bench.settle()
    explained = bench.state.check.explained
    assert explained is not None
    report, slowed = explained
    assert report is bench.plan.report
    assert report.explain("en", slowed=slowed) == bench.plan.report.explain("en")


def test_rows_and_words_are_in_the_units_of_the_page(bench: Bench) -> None:
    report = bench.plan.report
    degrees, radians = (Text("en", Units(angle=angle, length="m")) for angle in ("deg", "rad"))
    row = next(row for row in report.rows if row.id == "joint.velocity")
    assert f"{math.degrees(row.value):.4g} / {math.degrees(row.bound):.4g}°/s" in rows_html(report, MODEL, "", degrees)
    assert f"{row.value:.4g} / {row.bound:.4g} rad/s" in rows_html(report, MODEL, "", radians)
    assert not re.search(r"\d ?rad", rows_html(report, MODEL, "", degrees))
    assert not re.search(r"\d ?(?:mm|°)", rows_html(report, MODEL, "", radians))


def test_what_only_allows_for_rounding_is_0_and_the_verdict_counts_conditions_as_the_cards_do(bench: Bench) -> None:
    box = SafetyBox(size=(1.0, 0.4, 1.5), T_base_box=Pose((0.5, 0.0, 0.5)))
    setup = bench.state.setup
    bench.store.update(setup=replace(setup, wanted=replace(setup.wanted, box=box)))
    bench.goal.set_joints(HOME + np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    report = bench.plan.report
    assert report.violated_conditions == 1
    cards = rows_html(report, MODEL, "", Text("en"))
    assert cards.count("rl-card rl-bad") == 1
    card = next(card for card in cards.split('<div class="rl-card') if "Tool inside the safety box" in card)
    assert re.search(r"\d mm \(must be 0\)", card)
    assert '<span class="rl-share"></span>' in card
    assert "10⁻" not in cards
    rest = next(card for card in cards.split('<div class="rl-card') if "Starts at the arm" in card)
    assert "0° (should be 0)" in rest
    assert "%" not in rest.partition("rl-meter")[0]
    headline = CheckPanel(Text("en"), lambda request: None)._headline(bench.plan, None, None, is_current=True)
    assert f"Violated conditions: 1 (occurrences: {len(report.violations)})." in headline


@pytest.mark.parametrize(("name", "is_free"), [("FR3", True), ("Panda", False)])
def test_the_tab_says_where_the_controller_chooses_the_elbow(name: str, is_free: bool) -> None:
    model, text, panel = load_model(name), Text("en"), CheckPanel(Text("en"), lambda request: None)
    motion = plan_joint(model, model.home, model.home + 0.1, speed=0.3)
    plan = build_plan_view(model, motion, check(motion, model))
    said = "sent without the arm angle"
    assert said not in panel._headline(plan, None, None, is_current=True)
    there = plan.completed("cartesian_position")
    assert (said in panel._headline(there, None, None, is_current=True)) is is_free
    away = np.degrees(np.abs(there.motion.goal - motion.goal).max())
    assert (f"up to {away:.1f}° from the plan" in panel._headline(there, None, None, is_current=True)) is is_free
    done = plan_obstacle(there, there.motion.goal)
    assert done is not None
    assert (f"The joints are up to {away:.1f}° from the plan" in text.render(done)) is is_free
    state = UiState(model=model, goal=goal_at(model, motion.goal), plan=there)
    line = planned_html(state, SupervisorStatus(phase="idle", q=model.home, q_c=model.home), text)
    assert (f"The joints end up to {away:.1f}° from the plan" in line) is is_free
    assert ("工具在此规划的目标处" in Text("zh").render(done)) is is_free
    assert (there.motion is motion) is not is_free
    assert there.completed("joint_position").motion is motion


def test_the_share_of_an_uneven_range_can_be_derived_from_what_is_shown() -> None:
    model = load_model("xArm7")
    report = check(plan_joint(model, model.home, model.home + 0.01, speed=0.3), model)
    row = next(row for row in report.rows if row.id == "joint.position")
    assert (row.joint, f"{row.ratio:.3f}") == (4, "0.398")  # (107 - 60) / (107 + 11).
    assert row_facts(row, Text("en"))[0] == "60°, range -11° to 225° (0 % at 107°)"
    assert row_facts(row, Text("zh"))[0] == "60°，范围 -11° 至 225°（107° 处为 0 %）"
    assert all(row.limits is None for row in report.rows if row.id != "joint.position")


@pytest.mark.parametrize("phase", ["closed", "lost", "crashed"])
def test_no_tab_says_passed_while_nothing_is_connected(bench: Bench, phase: Phase) -> None:
    text, panel = Text("en"), CheckPanel(Text("en"), lambda request: None)
    panel.build(MagicMock(), bench.state)
    for status, is_said in ((SupervisorStatus(phase="idle", q=HOME), True), (SupervisorStatus(phase=phase), False)):
        panel.show(bench.state, status)
        assert (text("check.passed") in panel._verdict._shown) is is_said
        assert (text("check.passed") in planned_html(bench.state, status, text)) is is_said
    assert text("check.unconnected") in panel._verdict._shown


def test_every_row_of_a_joint_or_the_tool_has_a_plot() -> None:
    found = {plot_of(row) for row in RCI_CONDITIONS.conditions} - {None}
    assert found <= set(PLOTS)
    assert found >= {"q", "dq", "ddq", "jerk", "tau", "speed", "acceleration", "psi"}


def test_rows_say_what_they_are_beside_every_colour(bench: Bench) -> None:
    html = rows_html(bench.plan.report, MODEL, "joint.torque", Text("en"))
    assert html.count('role="button"') == len(bench.plan.report.rows)
    assert html.count("aria-current") == 1
    assert "no load set" in html
    assert {row_tone(row) for row in bench.plan.report.rows} >= {"good", "warn"}
