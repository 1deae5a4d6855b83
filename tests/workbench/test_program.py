"""The Program tab without a browser: edits with undo, typed numbers, planning beside, files, another arm."""

from __future__ import annotations

import math
import subprocess
import sys
import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.check.check_state import CheckState, Slowed
from rcilab.app.check.freshness import outdated
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, MoveJoint, MoveTarget, PoseGoal
from rcilab.app.program import program_actions, program_planning
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import CancelProgram, LoadProgram, PlanProgram, ProgramActions
from rcilab.app.program.program_draft import describe_place, draft_of, number_at, time_at, waypoint_times
from rcilab.app.request import TypeField
from rcilab.app.run.readiness import may_go_back, may_plan_again, obstacle
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import RobotConfiguration
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint
from rcilab.motion.program import payload_numbers
from rcilab.workbench.panels.plot_marks import plot_marks
from rcilab.workbench.panels.program_list import list_html, notes_html
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.scene.waypoint_markers import label_of, labels_of
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)
STANDING = SupervisorStatus(phase="idle", q=MODEL.home)
PLACE = MODEL.forward(HOME)
Edit = EditProgram


def beside(*step: float) -> Pose:
    return Pose(PLACE.position + step, PLACE.wxyz)


SQUARE = Program(
    model=MODEL.name,
    start=MODEL.home,
    name="square",
    waypoints=(
        Waypoint.joint(HOME + 0.1, speed=1.0),
        Waypoint.line(beside(0.0, 0.1, 0.0), speed=0.8, blend=0.02),
        Waypoint.line(beside(-0.1, 0.1, 0.0), speed=0.8, dwell=0.05),
    ),
)


class Bench:
    """A page's program on an arm that stands where it is told to."""

    def __init__(self, model=MODEL, q=HOME) -> None:
        self.status = SimpleNamespace(phase="idle", q_c=q)
        session = SimpleNamespace(status=lambda: self.status)
        self.store = Store(UiState(model=model, goal=goal_at(model, q)))
        self.goal = GoalActions(self.store, session)
        self.actions = ProgramActions(self.store, session, self.goal)
        self.actions.tick()

    @property
    def state(self):
        return self.store.state

    @property
    def program(self):
        return self.store.state.program

    @property
    def types(self) -> list[str]:
        return [step.waypoint.type for step in self.program.draft.steps]

    @property
    def told(self) -> str | None:
        return None if self.state.notice is None else self.state.notice.text.code

    def edit(self, what, **values) -> None:
        self.actions.editing.edit(Edit(what=what, **values))

    def type(self, name: str, text: str, key: int | None = None) -> str | None:
        """Types into a field of a step, and returns what is answered beside it."""
        field = f"program.{self.program.selected if key is None else key}.{name}"
        self.actions.editing.type_field(TypeField(field=field, text=text))
        problem = self.state.problems.get(field)
        return None if problem is None else problem.code

    def load(self, program: Program) -> None:
        self.actions.load(LoadProgram(name="square.json", content=program.to_json().encode()))

    def plan(self, **values) -> None:
        self.actions.plan(PlanProgram(**values))
        wait_for(self.is_done, 20.0, "the planning to end")

    def is_done(self) -> bool:
        self.actions.tick()
        return self.program.progress is None


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def square(bench) -> Bench:
    bench.load(SQUARE)
    return bench


def test_waypoints_are_added_after_the_selected_one_moved_copied_and_deleted_and_undo_brings_all_back(bench):
    bench.edit("add", source="here")
    bench.goal.move_target(MoveTarget(position=tuple(beside(0.0, 0.1, 0.0).position), wxyz=tuple(PLACE.wxyz)))
    bench.edit("add", source="target")
    assert bench.program.draft.start == tuple(HOME.tolist())
    assert np.allclose(MODEL.forward(bench.program.draft.steps[1].waypoint.q).position, beside(0.0, 0.1, 0.0).position)
    first, second = (step.key for step in bench.program.draft.steps)
    bench.edit("type", type="line")
    bench.edit("duplicate")
    assert bench.types == ["joint", "line", "line"]
    bench.edit("select", key=first)
    bench.edit("down")
    bench.edit("move", key=second, index=2)
    assert [step.key for step in bench.program.draft.steps][::2] == [first, second]
    bench.edit("delete", key=second)
    assert len(bench.types) == 2
    full = bench.program.draft
    for _ in range(7):
        bench.edit("undo")
    assert bench.types == []
    assert not bench.program.can_undo
    for _ in range(9):
        bench.edit("redo")
    assert bench.program.draft is full
    assert not bench.program.can_redo


def test_a_retyped_arc_has_a_via_that_can_be_planned_and_taught(square):
    key = square.program.draft.steps[1].key
    square.edit("type", key=key, type="arc")
    assert square.told == "program.via_made"
    square.plan()
    assert square.state.plan.report.ok
    square.goal.move_target(MoveTarget(position=tuple(beside(0.03, 0.05, 0.02).position), wxyz=tuple(PLACE.wxyz)))
    square.edit("via", key=key, source="target")
    assert np.allclose(square.program.draft.waypoint(key).via, beside(0.03, 0.05, 0.02).position)
    assert square.type("via_x", "600", key) is None
    assert square.program.draft.waypoint(key).via[0] == 0.6
    square.edit("type", key=key, type="joint")
    assert square.program.draft.waypoint(key).via is None


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("speed", "101", "parse.range"), ("speed", "0", "parse.range"), ("speed", "fast", "parse.garbage"),
        ("blend", "-1", "parse.range"), ("dwell", "nan", "parse.not_finite"), ("psi", "181", "parse.range"),
        ("x", "1e9", "parse.range"), ("yaw", "inf", "parse.not_finite"), ("rounds", "1.5", "program.whole"),
        ("rounds", "0", "parse.range"), ("name", "a\nb", "program.name_bad"),
    ],
)  # fmt: skip
def test_a_bad_number_is_answered_beside_its_field_and_changes_nothing(square, name, text, problem):
    before = square.program.draft
    assert square.type(name, text) == problem
    assert square.program.draft is before
    assert square.program.rounds == 1


def test_typed_numbers_change_the_step_they_were_typed_for(square):
    first, second = (step.key for step in square.program.draft.steps[:2])
    square.edit("select", key=second)
    for name, text in (("speed", "12.5"), ("blend", "15"), ("dwell", "0,25"), ("psi", "-10")):
        assert square.type(name, text, first) is None
    made = square.program.draft.waypoint(first)
    assert (made.speed, made.blend, made.dwell) == (0.125, 0.015, 0.25)
    assert made.q is None
    assert made.psi == pytest.approx(np.radians(-10.0))
    assert square.type("psi", "", first) is None
    assert square.program.draft.waypoint(first).psi is None
    before = square.program.draft.waypoint(second).position
    assert square.type("z", "400", second) is None
    assert square.program.draft.waypoint(second).position == (*before[:2], 0.4)
    square.type("rounds", "2")
    assert square.program.rounds == 2


def test_the_plan_of_a_program_is_the_pages_plan_with_a_certificate_and_names_its_segments(square):
    square.plan()
    plan = square.state.plan
    assert plan.complete
    plan.report.certificate.verify(plan.motion, MODEL, HOME)
    assert square.program.answer is None
    assert [number_at(plan, t) for t in (0.0, time_at(plan, 1) + 1e-6, plan.motion.duration)] == [1, 2, 3]
    said = Text("en").render(describe_place(plan, plan.motion.duration))
    assert said == "to waypoint 3 of 3, MoveL"
    second = square.program.draft.steps[1].key
    square.edit("select", key=second)
    assert square.state.playhead == pytest.approx(time_at(plan, 2) / plan.motion.duration)
    square.plan(upto=True)
    assert len(square.state.plan.program.waypoints) == 2


def test_an_arm_that_is_elsewhere_is_led_to_the_start_first_and_told_so(square):
    square.plan()
    alone = square.state.plan.motion
    square.status.q_c = HOME + 0.2
    square.type("rounds", "2")
    square.plan()
    plan = square.state.plan
    assert np.array_equal(plan.motion.start, HOME + 0.2)
    assert square.program.answer.code == "program.approach"
    assert describe_place(plan, 0.0).code == "program.at_start"
    first = round(plan.motion.segment_starts[1] * 1000)
    assert np.allclose(plan.motion.q[first : first + len(alone)], alone.q, atol=1e-9)
    starts = plan.motion.segment_starts
    assert [number_at(plan, t + 1e-6) for t in starts] == [0, 1, 2, 3, 0, 1, 2, 3]
    assert np.allclose(plan.motion.goal, alone.goal)


def test_the_plots_mark_each_waypoint_and_of_crowded_ones_the_first(square):
    square.status.q_c = HOME + 0.2
    square.type("rounds", "2")
    square.plan()
    plan, end = square.state.plan, square.state.plan.motion.duration
    starts = plan.motion.segment_starts
    arrivals = list(zip([1, 2, 3, 1, 2, 3], [starts[2], starts[3], starts[4], starts[6], starts[7], end], strict=True))
    assert waypoint_times(plan) == arrivals
    marks = plot_marks(square.state, end)
    assert [mark["label"] for mark in marks] == ["1", "2", "3", "1", "2", "3"]
    assert [mark["share"] for mark in marks] == pytest.approx([t / end for _, t in arrivals], abs=1e-4)
    assert [mark["label"] for mark in plot_marks(square.state, 100.0 * end)] == ["1"]


def test_many_shortened_blends_are_one_line_that_opens_and_marks_on_their_rows(bench):
    count = 60
    turns = np.linspace(0.0, math.tau, count, endpoint=False)
    circle = tuple(
        Waypoint.line(beside(0.03 * math.cos(turn) - 0.03, 0.03 * math.sin(turn), 0.0), blend=0.002) for turn in turns
    )
    bench.load(Program(model=MODEL.name, start=MODEL.home, waypoints=circle))
    bench.type("rounds", "2")
    bench.plan()
    notes, text = bench.program.notes, Text("en")
    assert len({note.key for note in notes}) == len(notes) > 40, "each once, however many rounds there are"
    assert bench.program.answer is None
    assert f"{len(notes)} blends shortened</summary>" in notes_html(notes, text)
    assert notes_html(notes[:1], text).startswith('<p class="rl-note">* waypoint')
    assert list_html(bench.state, bench.program.draft, None, text).count("<i title=") == len(notes)
    bench.edit("clear")
    assert notes_html(bench.program.notes, text) == ""


def test_close_waypoints_share_one_label_in_the_scene():
    points = [np.array((0.5, 0.001 * step, 0.3)) for step in range(5)] + [np.array((0.2, 0.0, 0.3))]
    numbers = [(number, "") for number in range(1, 7)]
    assert labels_of(points, numbers) == [([0, 1, 2, 3, 4], "1–5"), ([5], "6")]
    turns = np.linspace(0.0, 6.0 * math.pi, 400)
    circle = [np.array((0.6 + 0.08 * math.cos(turn), 0.08 * math.sin(turn), 0.5)) for turn in turns]
    assert len(labels_of(circle, [(number, "") for number in range(1, 401)])) < 4
    far = [np.array((0.1 * step, 0.0, 0.3)) for step in range(6)]
    assert [said for _, said in labels_of(far, numbers)] == ["1", "2", "3", "4", "5", "6"]
    assert label_of([(1, ""), (2, "[2]"), (3, ""), (7, "7 !")]) == "1–3, 7 · [2] · 7 !"
    assert (label_of([(4, "")]), label_of([(4, "[4]")])) == ("4", "[4]")
    assert labels_of([], []) == []


def test_an_error_names_the_waypoint_and_marks_it(square):
    key = square.program.draft.steps[1].key
    square.type("x", "2900", key)
    before = square.state.plan
    square.plan()
    assert square.program.failed == key
    assert "waypoint 2 (MoveL)" in Text("en").render(square.program.answer)
    assert square.state.plan is before
    assert "rl-failed" in list_html(square.state, square.program.draft, None, Text("en"))


def test_planning_can_be_cancelled_at_once_and_an_edit_drops_it(square, monkeypatch):
    going, ended = threading.Event(), threading.Event()

    def slowly(job, tell):
        def tell_late(share) -> None:
            going.wait(20.0)
            try:
                tell(share)
            except BaseException:
                ended.set()
                raise

        return program_planning.plan_job(job, tell_late)

    monkeypatch.setattr(program_actions, "plan_job", slowly)
    for give_up in (lambda: square.actions.cancel(CancelProgram()), lambda: square.edit("delete")):
        going.clear()
        ended.clear()
        square.actions.plan(PlanProgram())
        assert square.program.progress == 0.0
        assert square.state.busy is not None
        give_up()
        assert (square.program.progress, square.state.busy) == (None, None)
        going.set()
        assert ended.wait(20.0), "its thread ends, too"
        square.actions.tick()
        assert square.state.plan is None
        assert square.program.answer.code in ("program.cancelled", "program.changed")


def test_a_bad_file_is_answered_by_line_and_another_arms_by_name_and_nothing_is_lost(square):
    before = square.program.draft
    text = SQUARE.to_json().replace('"speed": 0.8', '"speed": 8', 1)
    square.actions.load(LoadProgram(name="bad.json", content=text.encode()))
    problem = Text("en").render(square.state.problems["program.0.file"])
    assert "bad.json, line 9" in problem
    assert "waypoint 2" in problem
    assert square.told == "program.loaded", "said once, beside the button"
    far = SQUARE.to_json().replace(str(list(SQUARE.waypoints[1].position)), "[55.0, 10.0, 4.0]")
    square.actions.load(LoadProgram(name="far.json", content=far.encode()))
    problem = Text("en").render(square.state.problems["program.0.file"])
    assert "(55.0, 10.0, 4.0) is farther than 10 m" in problem, "one message, one unit"
    assert "mm" not in problem
    for content in (b"", b"\xff\xfe", b"[" * 1000):
        square.actions.load(LoadProgram(name="bad.json", content=content))
        assert square.state.problems["program.0.file"].code == "program.file_bad"
    other = Program(model="xMate7", start=load_model("xMate7").home, waypoints=SQUARE.waypoints[1:])
    square.load(other)
    assert square.state.problems["program.0.file"].code == "program.file_other"
    assert square.program.draft is before
    square.load(SQUARE)
    assert "program.0.file" not in square.state.problems
    square.edit("undo")
    assert square.program.draft is before


def test_another_arm_has_its_own_program_and_the_first_one_comes_back(square):
    kept = square.program.draft
    other = load_model("xMate7")
    square.store.update(model=other, goal=goal_at(other, np.array(other.home)))
    square.status.q_c = np.array(other.home)
    square.actions.tick()
    assert square.program.draft.steps == ()
    assert square.told == "program.kept"
    square.edit("add", source="here")
    square.store.update(model=MODEL, goal=goal_at(MODEL, HOME))
    square.actions.tick()
    assert square.program.draft is kept
    assert square.program.can_undo
    assert square.told == "program.kept"


def test_the_script_run_as_a_process_makes_the_same_motion_to_the_last_sample(square, tmp_path):
    model = MODEL.with_tool(Pose((0.0, 0.0, 0.1)))
    square.store.update(model=model)
    square.plan()
    program = square.program.draft.program(model)
    assert program == square.state.plan.program
    script, out = tmp_path / "square.py", tmp_path / "out.npz"
    script.write_text(program.to_python(), encoding="utf-8")
    done = subprocess.run([sys.executable, script, out], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(Motion.load(out).q, square.state.plan.motion.q)


def test_files_bring_circles_and_elbow_moves_that_stay_as_they_are(bench):
    moves = (Waypoint.circle(beside(0.05, 0.0, 0.0).position, (0, 0, 1), 1.0), Waypoint.nullspace(0.3))
    bench.load(Program(model=MODEL.name, start=MODEL.home, waypoints=moves))
    for what in ("type", "teach", "aim"):
        bench.edit(what, type="line")
        assert bench.told == "program.no_target"
    assert "57°" in list_html(bench.state, bench.program.draft, None, Text("en"))
    assert draft_of(bench.program.draft.program(MODEL), MODEL).program(MODEL).waypoints == moves


def test_a_program_that_was_changed_since_is_not_executed(square):
    square.plan()
    status = SimpleNamespace(
        phase="idle", code="idle", powered=True, is_pressed=False, q_c=HOME, setup=RobotConfiguration()
    )
    assert obstacle(square.state, status) is None
    square.edit("delete")
    assert obstacle(square.state, status).code == "ready.program"
    square.edit("undo")
    square.type("rounds", "2")
    assert obstacle(square.state, status).code == "ready.program"
    square.plan()
    assert obstacle(square.state, status) is None


def test_a_plan_names_the_rejected_number_that_it_would_not_have(square):
    assert square.type("speed", "500") is not None
    square.actions.plan(PlanProgram())
    assert square.state.busy is None
    said = Text("en").render(square.state.notice.text)
    assert said.startswith("Not planned: waypoint 1, Speed [%]: 500 is outside 0.1 to 100 % and is not used.")
    square.type("speed", "50")
    square.type("rounds", "0")
    square.actions.plan(PlanProgram())
    assert square.told == "program.mend_rounds"
    square.type("rounds", "1")
    square.plan()
    assert square.program.planned is square.program.draft


def test_a_number_typed_again_leaves_plan_and_history_as_they_are(square):
    square.plan()
    assert square.type("blend", "-5") is not None
    assert square.type("blend", "0") is None
    assert square.program.planned is square.program.draft
    square.edit("undo")
    assert not square.program.draft.steps  # The load of the file.


def test_a_chosen_row_is_the_one_that_the_preview_shows(square):
    square.plan()
    for number, step in enumerate(square.program.draft.steps, start=1):
        square.edit("select", key=step.key)
        plan = square.state.plan
        assert number_at(plan, square.state.playhead * plan.motion.duration) == number


def test_why_a_program_failed_is_not_said_of_another_configuration(square):
    square.type("x", "2900")
    square.plan()
    assert square.program.tone == "bad"
    square.actions.tick()
    assert square.program.answer.code == "plan.failed"
    square.store.update(model=MODEL.with_tool(Pose([0.0, 0.0, 0.1])))
    square.actions.tick()
    assert square.program.answer is None
    assert square.program.failed is None


def test_a_changed_setup_is_not_taken_for_a_changed_program(square):
    square.plan()
    plan = square.state.plan
    square.store.update(model=MODEL.with_load(Payload(mass=1.0)))
    square.store.update(program=replace(square.program, planned=None))  # As after a plan that failed.
    assert square.state.plan is plan
    assert outdated(square.state).code == "ready.stale"


@pytest.mark.parametrize(
    "move",
    [
        MoveJoint(joint=1, angle=0.2),
        MoveTarget(position=tuple(PLACE.position), wxyz=tuple(PLACE.wxyz), ended=True),
        PoseGoal(name="zero"),
        PoseGoal(name="undo"),
    ],
)
def test_a_rejected_text_goes_when_the_arm_is_posed_in_another_way(bench, move):
    bench.goal.type_field(TypeField(field="joint.0", text="20"))
    bench.goal.type_field(TypeField(field="joint.3", text="abc"))
    bench.goal.type_field(TypeField(field="joint.1", text="30"))
    assert list(bench.state.problems) == ["joint.3"]  # Beside it, another number is typed.
    bench.goal.handlers[type(move)](move)
    assert not bench.state.problems


def test_a_program_that_plans_no_longer_is_never_shown_as_passed(square):
    square.plan()
    text = Text("en")
    assert text("check.passed") in planned_html(square.state, STANDING, text)
    square.type("x", "2900")
    assert outdated(square.state).code == "ready.program"
    square.plan()
    assert square.program.tone == "bad"
    changed = outdated(square.state)
    assert changed.code == "ready.program_fails"
    assert text("tab.program") in text.render(changed)
    assert text("check.passed") not in planned_html(square.state, STANDING, text)
    status = SimpleNamespace(
        phase="idle", code="idle", powered=True, is_pressed=False, q_c=HOME, setup=RobotConfiguration()
    )
    assert obstacle(square.state, status) == changed
    assert may_plan_again(changed)
    square.edit("undo")
    square.plan()
    assert outdated(square.state) is None


def test_a_bad_number_stays_complained_about_while_a_good_one_is_typed_beside_it(square):
    assert square.type("x", "far") is not None
    assert square.type("y", "120") is None
    assert f"program.{square.program.selected}.x" in square.state.problems
    square.edit("undo")
    assert not square.state.problems


def test_whoever_poses_the_goal_is_told_once_that_this_takes_the_place_of_the_programs_plan(square):
    square.plan()
    square.goal.move_joint(MoveJoint(joint=0, angle=0.2))
    assert square.state.plan.program is None
    assert square.told == "plan.replaced"
    serial = square.state.notice.serial
    square.goal.move_joint(MoveJoint(joint=0, angle=0.3))
    assert square.state.notice.serial == serial
    square.plan()
    square.status.q_c = square.state.plan.motion.goal  # It has been carried out: nothing is lost.
    square.goal.move_joint(MoveJoint(joint=0, angle=0.4))
    assert square.state.notice.serial == serial


def test_what_is_said_of_the_way_to_the_start_goes_when_the_arm_does(square):
    square.status.q_c = HOME + 0.05
    square.plan()
    assert square.program.answer.code == "program.approach"
    square.status.phase = "moving"
    square.actions.tick()
    assert square.program.answer is None


def test_a_plan_that_was_stretched_and_is_made_anew_says_that_it_is_fast_again(square):
    square.plan()
    plan = square.state.plan
    square.store.update(check=CheckState(slowed=Slowed(before=plan, after=plan, speed=0.5)))
    square.plan()
    assert square.program.answer.code == "program.unslowed"
    square.store.update(check=CheckState())
    square.plan()
    assert square.program.answer is None


def test_a_program_that_has_run_is_planned_again_or_one_goes_back_to_its_start(square):
    away = HOME + 0.05
    square.status.q_c = away
    square.plan()  # The way to its start comes first.
    end = square.state.plan.motion.goal
    square.status.q_c = end
    status = SimpleNamespace(
        phase="idle", code="idle", powered=True, is_pressed=False, q_c=end, setup=RobotConfiguration()
    )
    reason = obstacle(square.state, status)
    assert reason.code == "ready.done_program"
    assert may_plan_again(reason)
    assert may_go_back(square.state, reason)
    square.goal.pose_goal(PoseGoal(name="start"))
    plan = square.state.plan
    assert plan.program is None
    assert plan.motion.start == pytest.approx(end, abs=1e-12)
    assert plan.motion.goal == pytest.approx(HOME, abs=1e-12)
    square.plan()
    assert obstacle(square.state, status) is None
    status.q_c = away
    assert obstacle(square.state, status).code == "ready.elsewhere_program"


def test_a_program_for_another_tool_is_planned_and_judged_with_it_and_not_executed_with_this_one(bench):
    long = MODEL.with_tool(Pose([0.0, 0.0, 0.1]))
    T = long.forward(HOME)
    line = Waypoint.line(Pose(T.position + [0.0, 0.05, 0.0], T.wxyz))
    bench.load(Program(model=MODEL.name, start=MODEL.home, waypoints=(line,), tool=(0, 0, 0.1, 1, 0, 0, 0)))
    bench.plan()
    plan = bench.state.plan
    assert plan.model.forward(plan.motion.goal).is_close(line.pose, 1e-9)
    status = SimpleNamespace(
        phase="idle", code="idle", powered=True, is_pressed=False, q_c=HOME, setup=RobotConfiguration()
    )
    assert obstacle(bench.state, status).code == "ready.program_tool"
    bench.edit("aim")
    assert bench.state.model.forward(bench.state.goal.q).is_close(
        line.pose @ Pose([0.0, 0.0, 0.1]).inverse() @ MODEL.T_flange_tool, 1e-6
    )
    bench.edit("tool")
    assert bench.program.draft.is_for(MODEL)


def test_a_program_longer_than_any_motion_may_be_is_told_before_it_is_sampled(square):
    square.type("dwell", "3600")
    square.type("rounds", "100")
    square.plan()
    assert "the maximum is 300 s: use fewer rounds" in Text("en").render(square.program.answer)
    assert square.state.busy is None


def test_a_bug_in_the_planning_leaves_the_page_usable(square, monkeypatch):
    def fail(*args, **kwargs):
        raise MemoryError

    monkeypatch.setattr(program_planning, "build_plan_view", fail)
    with pytest.raises(MemoryError):
        square.plan()
    assert square.state.busy is None
    assert square.program.progress is None


def test_another_name_leaves_the_plan_as_it_is(square):
    square.plan()
    planned = square.program.planned
    assert planned is square.program.draft
    square.actions.editing.type_field(TypeField(field="program.0.name", text="abc"))
    assert square.program.draft.name == "abc"
    assert square.program.planned is square.program.draft
    assert outdated(square.state) is None
    square.edit("undo")
    assert square.program.draft.name == "square"


def test_load_and_box_of_a_file_survive_the_page_and_what_differs_from_setup_is_shown(bench):
    box = (1.0, 1.0, 2.0, 0.4, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0)
    step = Waypoint.joint(MODEL.home + 0.1)
    payload = payload_numbers(Payload(mass=2.0))
    bench.load(Program(model=MODEL.name, start=MODEL.home, waypoints=(step,), payload=payload, box=box))
    said = Text("en").render(bench.state.notices[-1].text)
    assert "different tool or load than in Setup" in said
    assert "safety box is not that of Setup" in said
    saved = bench.program.draft.program(MODEL)
    assert (saved.payload, saved.box) == (payload, box)
    bench.plan()
    assert bench.state.plan.model.load.mass == 2.0
    status = SimpleNamespace(
        phase="idle", code="idle", powered=True, is_pressed=False, q_c=HOME, setup=RobotConfiguration()
    )
    assert obstacle(bench.state, status).code == "ready.program_tool"
    bench.edit("tool")
    assert bench.program.draft.is_for(MODEL)
    assert not bench.program.draft.has_other_box(None)


def test_a_saved_program_has_load_and_box_of_the_page(square):
    loaded = MODEL.with_load(Payload(mass=1.5))
    box = SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose((0.4, 0.0, 0.5)))
    saved = square.program.draft.program(loaded, box=box)
    assert saved.payload[0] == 1.5
    assert saved.safety_box.size == box.size
