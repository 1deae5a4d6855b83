"""What the scene is told of goal and plan, and what is done in it: without a page, and with nothing connected."""

from __future__ import annotations

import json
import math
import re
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.goal.elbow import compute_elbow, nearest_free
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import SETTLED, GoalActions, MoveTarget, PlanGoal, PoseGoal, SetArmAngle, SetPathType
from rcilab.app.request import TypeField
from rcilab.app.scene.scene_actions import (
    CutWorkspace,
    DragElbow,
    EditElbow,
    HighlightBranch,
    SceneActions,
    ShowExtra,
    ShowViolation,
)
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.units import Units
from rcilab.model.robot_model import load_model
from rcilab.views.null_scene import NullScene
from rcilab.workbench.live import Here, Home, LiveChannel, PageMessage, Peek
from rcilab.workbench.panels.branches import BranchesPanel
from rcilab.workbench.panels.elbow import ring_html
from rcilab.workbench.panels.scene_legends import scene_legends
from rcilab.workbench.panels.scene_tools import scene_tools
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.panels.timeline import TimelinePanel
from rcilab.workbench.scene.elbow_view import ElbowSceneView
from rcilab.workbench.scene.goal_view import folded
from rcilab.workbench.scene.path_strip_view import bead_words

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)
STANDING = SupervisorStatus(phase="idle", q=MODEL.home)


class Bench:
    """Goal and scene as the dispatcher has them, with an arm that stands at home."""

    def __init__(self, q_c: np.ndarray | None = HOME, model=MODEL) -> None:
        self.store = Store(UiState(model=model, goal=goal_at(model, np.array(model.home))))
        self.goal = GoalActions(self.store, SimpleNamespace(status=lambda: SimpleNamespace(phase="idle", q_c=q_c)))
        self.scene = SceneActions(self.store, self.goal)
        self.scene.tick()

    @property
    def state(self) -> UiState:
        return self.store.state

    def aim(self, *step: float) -> None:
        target = self.state.goal.target
        self.goal.move_target(MoveTarget(position=tuple(target.position + step), wxyz=tuple(target.wxyz)))


@pytest.fixture
def bench():
    made = Bench()
    yield made
    made.scene.close()


def test_the_arcs_of_an_elbow_go_all_round_and_agree_with_the_inverse():
    elbow = compute_elbow(MODEL, HOME, None)
    assert sum(arc.end - arc.start for arc in elbow.arcs) == pytest.approx(math.tau)
    for arc in elbow.arcs:
        middle = 0.5 * (arc.start + arc.end)
        q = MODEL.inverse_batch(MODEL.forward(HOME).matrix[None], middle).q[0, elbow.branch]
        inside = bool(((MODEL.limits.joint.lower < q) & (q < MODEL.limits.joint.upper)).all())
        assert inside == (arc.kind == "free")
        assert bool(arc.joints) == (arc.kind == "limits")


def test_a_tool_outside_the_safety_box_forbids_every_arm_angle_and_says_so():
    box = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose((2.0, 0.0, 0.0)))
    kinds = {arc.kind for arc in compute_elbow(MODEL, HOME, box).arcs}
    assert "box" in kinds
    assert not kinds & {"free", "other"}


def test_arms_without_a_circle_have_none(bench):
    assert compute_elbow(load_model("xMate3"), np.zeros(6), None) is None
    assert compute_elbow(MODEL, np.zeros(7), None) is None
    six = Bench(None, load_model("xMate3"))
    six.scene.drag_elbow(DragElbow(eye=(2.0, 0.0, 1.0), hand=(0.0, 0.0, 1.0), phase="update"))
    assert six.state.scene.elbow is None


def test_dragging_the_handle_turns_the_elbow_and_holds_the_tool(bench):
    elbow = bench.state.scene.elbow
    eye = (2.0, -2.1, 1.45)
    hand = tuple(elbow.circle.points(0.8, 0.105)[0])
    bench.scene.drag_elbow(DragElbow(eye=eye, hand=hand, phase="start"))
    assert bench.state.goal.psi == pytest.approx(0.0, abs=1e-9)
    bench.scene.drag_elbow(DragElbow(eye=eye, hand=hand, phase="update"))
    goal = bench.state.goal
    assert goal.psi == pytest.approx(0.8, abs=math.radians(0.5))
    assert goal.snapped is None
    assert MODEL.forward(goal.q).is_close(goal.target, 1e-9)
    bench.goal.pose_goal(PoseGoal(name="undo"))
    assert bench.state.goal.psi == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_drag_that_is_no_place_changes_nothing(bench, number):
    before = bench.state.goal
    bench.scene.drag_elbow(DragElbow(eye=(number, 0.0, 0.0), hand=(0.0, 0.0, 0.0), phase="update"))
    bench.scene.drag_elbow(DragElbow(eye=(), hand=(), phase="update"))
    assert bench.state.goal is before


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_forbidden_arm_angle_is_left_for_the_nearest_free_one_and_told_why(bench, language):
    bench.goal.set_arm_angle(SetArmAngle(psi=2.5))
    goal = bench.state.goal
    assert goal.reach.tone != "bad"
    assert goal.psi is not None
    assert goal.psi < 2.0
    said = Text(language).render(goal.snapped)
    assert "143" in said
    assert "6" in said
    free, why = nearest_free(MODEL, goal.target, 0.4)
    assert (free, why) == (0.4, None)


def test_a_stretched_arm_has_no_free_range_from_0_to_0(bench):
    bench.aim(0.0, 0.2, 0.8)
    bench.scene.tick()
    said = ring_html(bench.state.scene.elbow, Text("en"))
    assert "Feasible:" not in said
    assert Text("en")("elbow.stretched") in said


@pytest.mark.parametrize("language", LANGUAGES)
def test_out_of_reach_the_ring_names_its_orange_and_the_pose_that_it_is_about(bench, language):
    text = Text(language)
    bench.aim(2.0, 0.0, 0.0)
    bench.scene.tick()
    elbow, goal = bench.state.scene.elbow, bench.state.goal
    assert goal.reach.tone == "bad"
    html = ring_html(elbow, text, is_nearest=True)
    legend = html[html.index('<div class="rl-arcs">') :]
    assert text("elbow.kind.near") in legend
    assert "rl-arc-free" not in legend, "nothing of it is blue-green"
    shown = {"en": "reachable pose that is shown", "zh": "所示的可达位姿"}[language]
    assert shown in legend


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_ring_laid_out_flat_tells_its_arcs_in_words_and_patterns(bench, language):
    html = ring_html(bench.state.scene.elbow, Text(language))
    assert "−" not in html, "one minus on the page"
    assert "url(#rl-arc-limits)" in html
    assert Text(language)("elbow.kind.limits") in html
    assert "98°" in html
    assert "elbow." not in html


def test_every_goal_has_its_branches_and_one_can_be_looked_at_before_it_is_chosen(bench):
    assert len(bench.state.goal.reach.solutions) >= 1
    bench.scene.peek(HighlightBranch(index=0))
    assert bench.state.scene.peek == 0
    bench.scene.peek(HighlightBranch(index=99))
    assert bench.state.scene.peek is None
    bench.scene.peek(HighlightBranch(index=0))
    bench.aim(0.0, 0.05, 0.0)
    bench.scene.tick()
    assert bench.state.scene.peek is None


def test_the_ways_to_reach_a_target_are_listed_nearest_first_and_lead_where_they_say(bench):
    target = MODEL.forward(np.radians((100.0, 40.0, 95.0, 60.0, 80.0, 50.0, 20.0)))
    bench.goal.move_target(MoveTarget(position=tuple(target.position), wxyz=tuple(target.wxyz)))
    solutions = np.array(list(bench.state.goal.reach.solutions))
    panel, shown = BranchesPanel(Text("en"), lambda request: None), []
    panel._rows = SimpleNamespace(show=shown.append)
    here = np.radians((-100.0, 20.0, 0.0, 40.0, -90.0, 60.0, 0.0))
    panel.show(bench.state, SimpleNamespace(q_c=here))
    rows = re.findall(
        r'data-branch="(\d+)".*?<span>(\d+)</span>[^/]*?(?:</span>.*?)?<span>(\d+)°</span><small>', shown[0]
    )
    told = re.findall("<small>(.*?)</small>", shown[0])
    assert len(set(told)) == len(solutions), "no two rows read alike"
    numbers, away = [int(number) for _, number, _ in rows], [float(angle) for _, _, angle in rows]
    assert len(rows) == len(solutions) > 2
    assert numbers == list(range(1, len(rows) + 1))
    assert away == sorted(away)
    meant = np.degrees(np.abs(solutions[[int(at) for at, _, _ in rows]] - np.round(here, 2)).max(axis=1))
    assert np.allclose(meant, away, atol=0.51)  # Shown in whole degrees.


def test_only_a_page_that_is_known_is_received():
    received: list[tuple[int, PageMessage]] = []
    live = LiveChannel(lambda: None, lambda page, message: received.append((page, message)), lambda: None)
    page = live.receive(json.dumps({"kind": "hello", "page": 3, "key": live.introduce(3)}))
    for message in ('{"kind": "home"}', '{"kind": "peek", "branch": 2}', '{"kind": "peek", "branch": null}'):
        live.receive(message, page)
        live.receive(message)
    assert received == [(3, message) for message in (Here(), Home(), Peek(2), Peek(None))]


def test_a_plan_that_leaves_the_box_has_a_bead_that_leads_to_its_moment(bench):
    box = SafetyBox(size=(1.0, 0.4, 1.5), T_base_box=Pose((0.5, 0.0, 0.5)))
    setup = bench.state.setup
    bench.store.update(setup=replace(setup, wanted=replace(setup.wanted, box=box)))
    bench.aim(-0.05, 0.3, 0.0)
    bench.scene.tick()
    ribbon = bench.state.scene.ribbon
    assert ribbon.usage.max() > 1.0
    bead = ribbon.markers[0]
    assert box.excess(bead.position) > 0.0
    bench.scene.show_violation(ShowViolation(number=0))
    assert bench.state.playhead == pytest.approx(bead.playhead)
    assert bench.state.notice.tone == "bad"
    for language in LANGUAGES:
        assert "condition." not in bead_words(bead, Text(language))
    assert bead_words(bead, Text("en")).startswith("◆ violated: Tool inside the safety box · ")
    assert bead_words(bead, Text("zh")).startswith("◆ 违反：")
    assert "violated: Tool inside the safety box</p>" in planned_html(bench.state, STANDING, Text("en"))
    bench.scene.show_violation(ShowViolation(number=99))
    bench.goal.pose_goal(PoseGoal(name="home"))
    bench.scene.tick()
    assert bench.state.scene.ribbon is None


def test_a_line_is_planned_once_the_goal_stands_still_and_keeps_the_tool_on_it(bench, monkeypatch):
    from rcilab.app.goal import goal_actions as actions

    now = [100.0]
    monkeypatch.setattr(actions, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=time.sleep))
    bench.goal.set_path_type(SetPathType(kind="line"))
    bench.aim(-0.05, 0.1, 0.05)
    assert bench.state.plan is None
    assert bench.state.no_plan.code == "plan.soon"
    bench.goal.settle()
    assert bench.state.plan is None
    now[0] += 1.1 * SETTLED
    bench.goal.settle()
    plan = bench.state.plan
    assert plan.kind == "line"
    way = plan.path[-1] - plan.path[0]
    beside = np.linalg.norm(np.cross(plan.path - plan.path[0], way / np.linalg.norm(way)), axis=1)
    assert beside.max() < 1e-6
    assert Text("en")("target.planned.line", duration=f"{plan.motion.duration:.3f}") in planned_html(
        bench.state, STANDING, Text("en")
    )


def test_the_arm_is_said_to_be_moved_only_while_it_is(bench):
    bench.store.update(plan=None, no_plan=None, jog=replace(bench.state.jog, robot=True))

    def said(phase: str, code: str) -> str:
        status = SimpleNamespace(q=HOME, q_c=HOME, phase=phase, code=code)
        return TimelinePanel(Text("en"), lambda request: None)._read(bench.state, status)

    by_hand = Text("en")("timeline.by_hand")
    assert by_hand not in said("idle", "idle"), "only ticked: nothing moves"
    assert "Move the robot" in said("idle", "idle")
    assert by_hand in said("moving", "moving.jog")
    bench.store.update(jog=replace(bench.state.jog, robot=False))
    assert by_hand in said("moving", "moving.guided")
    assert Text("en")("timeline.nothing") in said("idle", "idle")


def test_an_arc_needs_a_place_to_lead_over_and_then_does(bench):
    bench.goal.set_path_type(SetPathType(kind="arc"))
    bench.aim(-0.03, 0.08, 0.0)
    bench.goal.plan(PlanGoal())
    assert bench.state.no_plan.code == "plan.no_via"
    said = TimelinePanel(Text("en"), lambda request: None)._read(bench.state, SimpleNamespace(q_c=HOME, code="idle"))
    assert Text("en")("plan.no_via") in said, "not how to begin, but what is missing"
    bench.goal.set_path_type(SetPathType(via=True))
    via = bench.state.via.position
    bench.aim(0.0, 0.08, 0.05)
    bench.goal.plan(PlanGoal())
    assert bench.state.plan.kind == "arc"
    assert np.linalg.norm(bench.state.plan.path - via, axis=1).min() < 5e-3
    bench.goal.set_path_type(SetPathType(kind="sideways"))
    assert bench.state.path_type == "arc"


def test_a_typed_quaternion_turns_the_target_and_a_bad_one_is_answered(bench):
    position = bench.state.goal.target.position
    bench.goal.type_field(TypeField(field="pose.wxyz", text="0 0.2 0.97 0"))
    target = bench.state.goal.target
    assert np.allclose(target.position, position)
    assert abs(float(target.wxyz @ (0.0, 0.2, 0.97, 0.0))) == pytest.approx(math.hypot(0.2, 0.97))
    bench.goal.type_field(TypeField(field="pose.wxyz", text="0 0 0 0"))
    assert bench.state.problems["pose.wxyz"].code == "parse.no_turn"
    assert bench.state.goal.target is target
    bench.goal.type_field(TypeField(field="pose.x", text="500"))
    assert "pose.wxyz" in bench.state.problems  # Still the orientation that it was typed for.
    bench.goal.type_field(TypeField(field="pose.yaw", text="5"))
    assert not bench.state.problems


def test_extras_are_computed_when_they_are_switched_on_and_gone_when_off(bench):
    bench.aim(0.0, 0.1, 0.0)
    for name in ("ellipsoid", "cloud", "swept", "nonsense"):
        bench.scene.show_extra(ShowExtra(name=name, on=True))
    assert "nonsense" not in bench.state.scene.extras
    bench.scene.tick()
    for made in dict(bench.scene._made).values():
        made.result(30.0)
    bench.scene.tick()
    seen = bench.state.scene
    J = MODEL.jacobian(bench.state.goal.q)[:3]
    assert np.allclose((seen.ellipsoid.axes * seen.ellipsoid.radii**2) @ seen.ellipsoid.axes.T, J @ J.T)
    assert len(seen.cloud) > 1000
    assert len(seen.swept.faces) > 1000
    for name in ("ellipsoid", "cloud", "swept"):
        bench.scene.show_extra(ShowExtra(name=name, on=False))
    bench.scene.tick()
    assert (bench.state.scene.ellipsoid, bench.state.scene.cloud, bench.state.scene.swept) == (None, None, None)


@pytest.mark.parametrize("language", LANGUAGES)
def test_path_and_workspace_have_legends_and_the_workspace_can_be_cut(bench, language):
    assert scene_legends(bench.state, Text(language)) == []
    bench.aim(0.0, 0.1, 0.0)
    bench.scene.show_extra(ShowExtra(name="cloud", on=True))
    bench.scene.tick()
    bench.scene._made["cloud"].result(30.0)
    bench.scene.tick()
    path, cloud = scene_legends(bench.state, Text(language))
    assert (path["id"], cloud["id"]) == ("path", "cloud")
    assert path["colors"][0] == "rgb(20, 140, 170)"
    assert path["beyond"]["color"] == "rgb(214, 30, 38)"
    assert "legend." not in str((path, cloud))
    assert cloud["cut"]["axis"] == "none"
    position = bench.state.scene.cloud.position
    for axis, column, sign in (("x", 0, 1.0), ("y", 1, -1.0), ("z", 2, 1.0)):
        bench.scene.cut(CutWorkspace(axis=axis, at=0.2))
        kept = bench.state.scene.cut.keeps(position)
        assert 0 < kept.sum() < len(position)
        assert (sign * position[kept, column] <= sign * 0.2).all(), "the side away from the first view's camera"
        assert (sign * position[~kept, column] > sign * 0.2).all()
    assert scene_legends(bench.state, Text(language))[1]["cut"]["shown"] == "200 mm"
    bench.scene.cut(CutWorkspace(axis="x", at=math.nan))
    assert bench.state.scene.cut.axis == "z"
    bench.scene.cut(CutWorkspace(axis="none", at=0.0))
    assert bench.state.scene.cut is None


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_tools_of_the_scene_get_texts_units_and_the_preview(bench, language):
    tools = scene_tools(bench.state, STANDING, Text(language))
    assert [tool["name"] for tool in tools["tools"]] == ["measure", "picture", "film", "spacemouse"]
    assert not re.search(r"\b(tool|measure|film|spacemouse)\.[a-z]", str(tools))
    assert tools["measure"]["length"] == {"factor": 1000.0, "unit": " mm", "digits": 1}
    assert tools["measure"]["angles"]["unit"] == "°"
    in_si = scene_tools(bench.state, STANDING, Text(language, Units(angle="rad", length="m")))["measure"]
    assert in_si["length"] == {"factor": 1.0, "unit": " m", "digits": 4}
    assert in_si["angles"] == {"factor": 1.0, "unit": " rad", "digits": 3}
    assert tools["preview"] is None, "nothing is planned"
    bench.aim(0.0, 0.1, 0.0)
    assert scene_tools(bench.state, STANDING, Text(language))["preview"] == {"share": 0.0, "playing": False}
    moving = replace(STANDING, phase="moving")
    assert scene_tools(bench.state, moving, Text(language))["preview"] is None, "the arm moves, not the preview"


class Drawn:
    """A scene of viser that keeps the labels only."""

    def add_label(self, name: str, text: str, **props: object) -> SimpleNamespace:
        return SimpleNamespace(text=text, **props, remove=lambda: None)


class ElbowScene(NullScene):
    """A scene whose nodes can be dragged."""

    def on_drag(self, name: str, callback: object) -> None:
        pass


def test_the_circle_of_the_elbow_is_drawn_only_while_the_elbow_is_edited_or_switched_on(bench):
    drawing = ElbowScene()
    view = ElbowSceneView(SimpleNamespace(scene=Drawn()), drawing, lambda request: None)

    def shown(status: SupervisorStatus = STANDING) -> tuple[bool, bool, bool]:
        view.show(bench.state, status, Text("en"))
        return drawing.is_shown("/elbow_handle"), drawing.is_shown("/elbow"), view._label.visible

    act = bench.scene.handlers
    assert shown() == (True, False, False)
    act[EditElbow](EditElbow(on=True))
    assert shown() == (True, True, True)
    assert view._label.text == "Elbow: ψ 0°"
    assert shown(replace(STANDING, phase="moving")) == (False, False, False)
    act[EditElbow](EditElbow(on=False))
    assert shown() == (True, False, False)
    bench.scene.show_extra(ShowExtra(name="elbow", on=True))
    assert shown() == (True, True, True)


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_label_of_the_target_is_broken_into_lines(language: str) -> None:
    text = Text(language)
    reason = text("joined", first=text("plan.here"), second=text("plan.watched"))
    lines = folded(reason).split("\n")
    assert len(lines) > 1
    assert max(len(line) for line in lines) <= 30
    assert not any(line[0] in "，。；" for line in lines)
    assert "".join(lines).replace(" ", "") == reason.replace(" ", "")
