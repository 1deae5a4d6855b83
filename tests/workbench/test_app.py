"""The workbench without a browser, with the real controller behind it: requests in, state out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from rcilab.app import dispatcher
from rcilab.app.control_lock_actions import AnswerControls, PageClosed, PageOpened, TakeControls
from rcilab.app.goal.goal_actions import (
    ChooseBranch,
    MoveJoint,
    MoveTarget,
    PoseGoal,
    SetArmAngle,
    SetPathType,
    SetSpeed,
)
from rcilab.app.planning import make_plan
from rcilab.app.request import Request, TypeField
from rcilab.app.run.readiness import obstacle, time_shown
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.setup.setup_actions import SetSetup
from rcilab.app.text import Text
from rcilab.app.view_actions import Seek, SetView
from rcilab.core.errors import InvalidValueError, ModelError, UsageError
from rcilab.i18n.units import Units
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.arm_state import arm_html
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.panels.timeline import TimelinePanel
from tests.workbench.opened import opened, told, wait


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


@pytest.fixture
def ask(bench) -> Callable[[Request], None]:
    """Asks, and returns once it has been dealt with."""

    def act(request: Request) -> None:
        height = bench.store.state.height + 1.0
        bench.dispatcher.ask(request)
        bench.dispatcher.ask(SetView(name="height", value=height))
        wait(lambda: bench.store.state.height == height, f"an answer to {request}")

    act(PoseGoal(name="here"))
    act(SetSpeed(speed=0.5))
    return act


def test_it_is_connected_to_a_virtual_controller_from_the_start(bench):
    status = bench.session.status()
    assert status.target == "virtual"
    assert status.address is not None
    assert np.allclose(bench.store.state.goal.q, status.q_c)


def test_posing_a_joint_plans_and_judges_and_moves_nothing(bench, ask):
    before = np.array(bench.session.status().q_c)
    ask(MoveJoint(joint=0, angle=before[0] + 0.3))
    state = bench.store.state
    assert state.plan is not None
    assert state.plan.report.ok
    assert state.plan.motion.goal[0] == pytest.approx(before[0] + 0.3)
    assert np.array_equal(bench.session.status().q_c, before)
    assert obstacle(state, bench.session.status()) is None


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_an_angle_that_is_no_number_changes_nothing(bench, ask, angle):
    before = bench.store.state.goal
    ask(MoveJoint(joint=0, angle=angle))
    ask(MoveJoint(joint=99, angle=0.0))
    ask(MoveTarget(position=(angle, 0.0, 0.0), wxyz=(1.0, 0.0, 0.0, 0.0)))
    ask(MoveTarget(position=(0.5, 0.0, 0.5), wxyz=(0.0, 0.0, 0.0, 0.0)))
    ask(SetArmAngle(psi=angle))
    ask(SetSpeed(speed=angle))
    ask(Seek(playhead=angle))
    assert bench.store.state.goal is before


def test_an_angle_beyond_its_limit_is_taken_at_the_limit(bench, ask):
    ask(MoveJoint(joint=1, angle=77.0))
    state = bench.store.state
    assert state.goal.q[1] == state.model.limits.joint.upper[1]
    assert state.goal.reach.reason.code == "reach.at_limit"
    assert state.plan is None
    assert state.no_plan.code == "plan.at_limit"


def test_a_typed_number_is_taken_and_a_bad_one_is_answered_beside_its_field(bench, ask):
    ask(TypeField(field="joint.0", text="-0.25"))
    assert bench.store.state.goal.q[0] == pytest.approx(math.radians(-0.25))
    ask(TypeField(field="joint.0", text="nan"))
    assert bench.store.state.problems["joint.0"].code == "parse.not_finite"
    assert bench.store.state.goal.q[0] == pytest.approx(math.radians(-0.25))
    ask(TypeField(field="joint.0", text="3"))
    assert "joint.0" not in bench.store.state.problems


@pytest.mark.parametrize(
    ("typed", "speed", "problem"),
    [
        ("7.5", 0.075, None),
        ("33,3 %", 0.333, None),
        ("0.5", None, "parse.range"),
        ("500", None, "parse.range"),
        ("-3", None, "parse.range"),
        ("nan", None, "parse.not_finite"),
        ("abc", None, "parse.garbage"),
        ("", None, "parse.empty"),
    ],
)
def test_a_typed_speed_is_taken_as_it_was_typed_or_answered_in_words(bench, ask, typed, speed, problem):
    ask(TypeField(field="speed", text=typed))
    state = bench.store.state
    assert state.speed == pytest.approx(0.5 if speed is None else speed)
    assert (state.problems["speed"].code if "speed" in state.problems else None) == problem


def test_a_target_out_of_reach_has_no_ways_and_its_plan_says_how_far_short_it_ends(bench, ask):
    here = bench.store.state.model.forward(bench.store.state.goal.q)
    ask(MoveTarget(position=(2.0, 0.3, 0.6), wxyz=tuple(here.wxyz)))
    state = bench.store.state
    assert state.goal.reach.tone == "bad"
    assert state.goal.reach.solutions is None
    assert state.plan.missed_by.code == "reach.short_mm"
    reached = state.model.forward(state.goal.q).position
    short = np.linalg.norm(np.array((2.0, 0.3, 0.6)) - reached)
    assert state.plan.missed_by.values["distance"] == pytest.approx(short, abs=1e-3)
    for language in ("en", "zh"):
        shown = planned_html(state, bench.session.status(), Text(language))
        assert Text(language)("check.passed") not in shown
        assert f"{1000.0 * short:.0f} mm" in shown
    ask(ChooseBranch(index=0))
    assert bench.store.state.goal is state.goal
    caption = TimelinePanel(Text("en"), lambda request: None)._read(state, bench.session.status())
    assert "▲ stops short of the target" in caption
    ask(SetSpeed(speed=1.0))
    ask(RobotCommand(what="execute"))
    wait(lambda: told(bench) == "notice.arrived_short", "the arrival short of the target")


def test_labels_in_the_scene_follow_the_language_at_once(bench, ask):
    ask(SetPathType(kind="arc", via=True))
    label = bench.renderer._stage._goal._via_label
    try:
        for language in ("en", "zh", "en"):
            ask(SetView(name="language", value=language))
            said = Text(language)("target.via_label")
            wait(lambda said=said: label.text == said, f"the label in {language}")
    finally:
        ask(SetPathType(kind="joint"))


def test_a_safety_box_that_is_off_is_drawn_only_while_it_is_edited(bench, ask):
    label = bench.renderer._stage._setup._label
    assert not bench.store.state.setup.wanted.box.active
    ask(SetSetup(name="edited", value="box"))
    wait(lambda: label.visible, "the box that is edited")
    ask(SetSetup(name="edited", value=""))
    wait(lambda: not label.visible, "it to go")
    ask(SetSetup(name="box", value=False))


def test_connecting_without_an_address_asks_for_one_and_does_nothing(bench, ask):
    before = bench.session.status().address
    ask(ChooseRobot(target="  "))
    assert told(bench) == "run.address_needed"
    assert bench.session.status().address == before


@pytest.mark.parametrize("field", ["", "joint.", "joint.7", "joint.-1", "pose.w", "nonsense", "joint.²"])
def test_a_field_that_does_not_exist_is_ignored(bench, ask, field):
    before = bench.store.state.goal
    ask(TypeField(field=field, text="5"))
    assert bench.store.state.goal is before


def test_undo_brings_the_goal_back(bench, ask):
    ask(TypeField(field="joint.2", text="10"))
    ask(TypeField(field="joint.2", text="20"))
    ask(PoseGoal(name="undo"))
    assert math.degrees(bench.store.state.goal.q[2]) == pytest.approx(10.0)


def test_another_branch_keeps_the_tool_where_it_is(bench, ask):
    target = bench.store.state.model.forward(np.radians((100.0, 40.0, 95.0, 60.0, 80.0, 50.0, 20.0)))
    ask(MoveTarget(position=tuple(target.position), wxyz=tuple(target.wxyz)))
    solutions = bench.store.state.goal.reach.solutions
    assert solutions is not None
    assert len(solutions) > 1
    for index in range(len(solutions)):
        ask(MoveTarget(position=tuple(target.position), wxyz=tuple(target.wxyz)))
        ask(ChooseBranch(index=index))
        goal = bench.store.state.goal
        assert bench.store.state.model.forward(goal.q).is_close(target, 1e-6)


def test_the_arm_angle_turns_the_elbow_and_keeps_the_tool(bench, ask):
    target = bench.store.state.model.forward(bench.store.state.model.home)
    ask(MoveTarget(position=tuple(target.position), wxyz=tuple(target.wxyz)))
    ask(SetArmAngle(psi=0.4))
    goal = bench.store.state.goal
    assert goal.psi == pytest.approx(0.4)
    assert bench.store.state.model.forward(goal.q).is_close(target, 1e-6)


def is_refused(bench) -> bool:
    """Whether a page is still told that it has not got the controls."""
    return any(notice.cause == "control_lock" for notice in bench.store.state.notices)


def test_a_watching_page_may_look_but_not_touch(bench, ask):
    ask(PageOpened(page=1))
    ask(PageOpened(page=2))
    before = bench.store.state.goal
    ask(MoveJoint(page=2, joint=0, angle=0.1))
    assert bench.store.state.goal is before
    assert told(bench) == "notice.watching"
    assert bench.store.state.notice.page == 2, "the page that holds the controls need not be told"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rcilab.app.dispatcher._REFUSAL_INTERVAL", 1e9)
        before = bench.store.state.notices
        ask(MoveJoint(page=2, joint=0, angle=0.1))
        assert bench.store.state.notices == before, "it is informed once in that time"
    ask(PageClosed(page=1))
    wait(lambda: not is_refused(bench), "what is no longer so to be withdrawn")
    ask(MoveJoint(page=2, joint=0, angle=0.2))
    assert told(bench) == "control_lock.free"
    ask(PageClosed(page=2))
    ask(PageOpened(page=1))
    wait(lambda: not is_refused(bench), "that to be withdrawn, too: now a page has the controls")
    ask(PageOpened(page=2))
    ask(MoveJoint(page=1, joint=0, angle=0.1))
    assert bench.store.state.goal.q[0] == pytest.approx(0.1)
    ask(TakeControls(page=2))
    assert (bench.store.state.control_lock.holder, bench.store.state.control_lock.asking) == (1, 2)
    ask(AnswerControls(page=2, yes=True))
    assert bench.store.state.control_lock.holder == 1
    ask(AnswerControls(page=1, yes=True))
    assert bench.store.state.control_lock.holder == 2
    for page in (1, 2):
        ask(PageClosed(page=page))
    assert bench.store.state.control_lock.holder is None


def test_execute_runs_the_plan_records_it_and_then_asks_for_a_new_one(bench, ask):
    start = float(bench.session.status().q_c[0])
    ask(MoveJoint(joint=0, angle=start + (0.2 if start < 1.0 else -0.2)))
    goal = np.array(bench.store.state.goal.q)
    ask(RobotCommand(what="execute"))
    wait(lambda: told(bench) == "notice.arrived", "the arrival")
    assert np.abs(bench.session.status().q_c - goal).max() < 1e-9
    wait(lambda: bench.store.state.playhead == 1.0, "the preview to stand where the arm has arrived")
    recording = bench.store.state.recording
    assert recording is not None
    duration = bench.store.state.plan.motion.duration
    wait(lambda: bench.store.state.recording.t[-1] >= duration - 0.005, "the whole recording")
    recording, plan = bench.store.state.recording, bench.store.state.plan.motion
    rows = np.clip(np.rint(recording.t * 1000.0).astype(int) - recording.delay, 0, len(plan.q) - 1)
    assert recording.delay > 1  # The play-out, taken out where plan and actual are compared.
    assert np.median(np.abs(recording.q_c - plan.q[rows])[:, 0]) < 1e-9
    assert obstacle(bench.store.state, bench.session.status()).code == "ready.done"
    ask(RobotCommand(what="execute"))
    assert told(bench) == "ready.done"
    ask(PoseGoal(name="start"))
    assert abs(float(bench.store.state.plan.motion.goal[0]) - start) < 1e-9
    assert obstacle(bench.store.state, bench.session.status()) is None


@pytest.mark.parametrize("what", ["execute", "stop"])
def test_a_motion_that_was_seldom_looked_at_leaves_the_preview_where_it_ended(bench, ask, monkeypatch, what):
    start = float(bench.session.status().q_c[0])
    ask(MoveJoint(joint=0, angle=start + (0.1 if start < 1.0 else -0.1)))
    if what == "stop":
        ask(SetSpeed(speed=0.05))
    monkeypatch.setattr(dispatcher, "_TICK", 1.0)  # [s] A busy machine.
    ask(RobotCommand(what="execute"))
    if what == "stop":
        wait(lambda: (bench.session.status().motion_plan_time or 0.0) > 0.3, "a part of the way")
        ask(RobotCommand(what="stop"))
    wait(lambda: told(bench) == ("notice.arrived" if what == "execute" else "notice.stopped"), "its end to be told")
    left = bench.session.status().motion_plan_time / bench.store.state.plan.motion.duration
    assert (left == 1.0) is (what == "execute")
    wait(lambda: bench.store.state.playhead == left, "the preview to stand there")


def test_stop_ends_a_motion_and_says_so(bench, ask):
    ask(SetSpeed(speed=0.05))
    start = float(bench.session.status().q_c[0])
    ask(MoveJoint(joint=0, angle=start + (0.8 if start < 0.0 else -0.8)))
    ask(RobotCommand(what="execute"))
    wait(lambda: bench.session.status().phase == "moving", "the arm to move")
    ask(ChooseRobot(model="xMate3"))
    assert told(bench) == "notice.moving"
    wait(lambda: (bench.session.status().motion_plan_time or 0.0) > 0.2, "a part of the way")
    ask(RobotCommand(what="stop"))
    wait(lambda: told(bench) == "notice.stopped", "the stop to be told")
    assert bench.session.status().phase == "idle"
    assert abs(float(bench.session.status().q_c[0]) - start) < 0.7
    wait(lambda: 0.0 < bench.store.state.playhead < 0.9, "the preview to stand where the arm has left the plan")


def test_while_the_arm_moves_the_timeline_is_where_the_arm_is(bench):
    plan = make_plan(bench.store.state.model, np.zeros(7), np.full(7, 0.2), 0.5, "jerk_limited")
    state = replace(bench.store.state, plan=plan, playhead=0.25)
    still, moving = (replace(bench.session.status(), phase=phase, motion_plan_time=0.1) for phase in ("idle", "moving"))
    assert time_shown(state, still) == pytest.approx(0.25 * plan.motion.duration)
    assert time_shown(state, moving) == 0.1
    assert time_shown(replace(state, plan=None), still) == 0.0


def test_where_the_arm_is_stands_beside_the_goal_in_the_units_of_the_page():
    model, q = load_model("xMatePro7"), np.radians([10.0, 20.0, -0.04, 40.0, 0.0, 60.0, 0.0])
    shown = arm_html(model, q, Text("en"))
    assert all(f"<td>{angle}</td>" in shown for angle in ("10.0", "20.0", "0.0", "40.0"))
    assert f"x {1000.0 * model.forward(q).position[0]:.1f} mm" in shown
    assert "<td>0.175</td>" in arm_html(model, q, Text("en", Units("rad", "m")))
    assert Text("zh")("arm.unknown") in arm_html(model, None, Text("zh"))
    assert Text("en")("arm.unknown") in arm_html(model, q[:6], Text("en"))


def test_an_address_that_is_none_is_answered_and_nothing_is_lost(bench, ask):
    before = bench.session.status().address
    ask(ChooseRobot(target="http://robot"))
    assert bench.store.state.notice.tone == "bad"
    assert told(bench) == "address.bad"
    assert bench.store.state.notice.text.values["typed"] == "http://robot"
    assert bench.session.status().address == before


def test_an_unknown_model_lists_the_known_ones():
    with pytest.raises(ModelError, match="xMatePro3, xMatePro7, xMate3, xMate7"):
        Workbench(WorkbenchConfig(model="kuka", port=0))


def test_a_bad_robot_address_is_refused_before_anything_starts():
    with pytest.raises(InvalidValueError, match="rci://"):
        Workbench(WorkbenchConfig(target="http://robot", port=0))


def test_an_open_address_needs_a_token():
    with pytest.raises(UsageError, match="give a token"):
        Workbench(WorkbenchConfig(host="0.0.0.0", port=0))


def test_a_workbench_that_never_started_closes():
    bench = Workbench(WorkbenchConfig(port=0))
    bench.close()
    bench.close()


def test_undo_takes_back_a_drag_of_the_target_and_a_turn_at_a_slider(bench, ask):
    ask(PoseGoal(name="home"))
    home = bench.store.state.goal.q
    target = bench.store.state.goal.target
    for step in range(5):  # One drag.
        moved = target.position + [0.01 * step, 0.0, 0.0]
        ask(MoveTarget(position=tuple(moved), wxyz=tuple(target.wxyz), ended=step == 4))
    assert not np.array_equal(bench.store.state.goal.q, home)
    dragged = bench.store.state.goal.q
    for step in range(5):
        ask(MoveJoint(joint=0, angle=0.01 * step))
    ask(PoseGoal(name="undo"))
    assert np.array_equal(bench.store.state.goal.q, dragged)
    ask(PoseGoal(name="undo"))
    assert np.array_equal(bench.store.state.goal.q, home)
