"""Safety box, tool, load and force-control frame on the page: requests in, state out, the controller told."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.check.check_actions import PressCheck
from rcilab.app.check.freshness import outdated
from rcilab.app.control_lock_actions import PageClosed, PageOpened
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import MoveJoint, PlanGoal, PoseGoal
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_draft import target_of
from rcilab.app.request import Request, TypeField
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.setup.configuration_state import (
    SetupState,
    describe_held,
    describe_part,
    has_other_limits,
    pending_parts,
    setup_obstacle,
)
from rcilab.app.setup.setup_actions import MoveSetup, OpenTab, PressSetup, ResizeBox, SetSetup
from rcilab.app.setup.setup_fields import FACE_NAMES, FIELD_NAMES, faces, read_field, with_field
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.app.view_actions import SetView
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.launch import start_controller
from rcilab.core.errors import CommandRejectedError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message
from rcilab.makers.configuration import SETUP_PARTS, ControllerParameters, RobotConfiguration, SoftJointLimits
from rcilab.makers.rokae import wire as rci
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench
from rcilab.workbench.panels.check import CheckPanel
from rcilab.workbench.panels.jog import reach_html
from rcilab.workbench.panels.program_list import list_html
from rcilab.workbench.panels.setup import SetupPanel
from rcilab.workbench.panels.target import TargetPanel, planned_html
from rcilab.workbench.scene.configuration_view import hides_target
from tests.workbench.opened import opened, told, wait

NO_TURN = (1.0, 0.0, 0.0, 0.0)


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

    while bench.store.state.setup.can_undo:
        act(PressSetup(what="undo"))
    act(PoseGoal(name="here"))
    wait(lambda: settled(bench), "the controller to have the first set-up")
    return act


def type_in(ask, **numbers: str) -> None:
    for name, text in numbers.items():
        ask(TypeField(field="setup." + name.replace("_", "."), text=text))


def settled(bench: Workbench) -> bool:
    return pending_parts(bench.store.state, bench.session.status()) == ()


def wanted(bench: Workbench) -> RobotConfiguration:
    return bench.store.state.setup.wanted


def test_a_typed_tool_is_what_the_controller_reports_and_what_the_goal_is_solved_with(bench, ask):
    q = np.array(bench.store.state.goal.q)
    flange = bench.store.state.model.forward(q)
    type_in(ask, tool_z="140", tool_pitch="-0.25")
    state = bench.store.state
    assert math.degrees(wanted(bench).tool.rpy[1]) == pytest.approx(-0.25)
    assert np.array_equal(state.goal.q, q)
    assert state.goal.target.is_close(flange @ wanted(bench).tool, 1e-12)
    wait(lambda: settled(bench), "the controller to have the tool")
    wait(
        lambda: (T := bench.session.status().T_flange_tool) is not None and T.is_close(wanted(bench).tool, 1e-9),
        "the controller to report the tool",
    )
    held = Text("en").render(describe_held(bench.session.status(), "tool"))
    assert held == Text("en").render(describe_part(wanted(bench), "tool")) == "0, 0, 140 mm, 0, -0.2, 0°"


def test_an_edit_makes_the_plan_stale_in_words_and_undo_makes_it_good_again(bench, ask):
    ask(MoveJoint(joint=0, angle=float(bench.session.status().q_c[0]) + 0.3))
    plan = bench.store.state.plan
    wait(lambda: bench.store.state.plan.complete, "a complete check")
    type_in(ask, load_mass="1.5", tool_z="100")
    wait(lambda: settled(bench), "the controller to have both")
    state, status = bench.store.state, bench.session.status()
    assert state.plan.motion is plan.motion
    assert not np.allclose(state.plan.path, plan.path)
    reason = obstacle(state, status)
    assert reason.code == "ready.stale"
    assert "tool, load" in Text("en").render(reason)
    for language in ("en", "zh"):
        assert Text(language)("check.outdated") in planned_html(state, status, Text(language))
    ask(RobotCommand(what="execute"))
    assert told(bench) == "ready.stale"
    ask(PressSetup(what="undo"))
    ask(PressSetup(what="undo"))
    wait(lambda: settled(bench), "the controller to have the first set-up")
    assert obstacle(bench.store.state, bench.session.status()) is None
    type_in(ask, load_mass="1.5")
    ask(PlanGoal())
    wait(lambda: settled(bench), "the controller to have the load")
    assert obstacle(bench.store.state, bench.session.status()) is None


def test_undo_of_soft_limits_is_sent_too():
    with opened() as bench:
        typed = (("setup.tool.z", "100"), ("setup.joints.lower.0", "-100"), ("setup.joints.lower.0", "-90"))
        for field, text in typed:
            bench.dispatcher.ask(TypeField(field=field, text=text))
        wait(lambda: bench.session.status().setup.joints is not None, "the soft limits at the controller")
        for _ in typed:
            bench.dispatcher.ask(PressSetup(what="undo"))
        wait(lambda: not bench.store.state.setup.can_undo, "everything undone")
        wait(lambda: not pending_parts(bench.store.state, bench.session.status()), "the controller to have everything")


def test_a_motion_out_of_the_box_is_refused_before_it_runs(bench, ask):
    model, q = bench.store.state.model, np.array(bench.session.status().q_c)
    x, y, z = 1000.0 * model.forward(q).position
    for name, value in zip(FACE_NAMES, (x - 60, y - 60, z - 60, x + 60, y + 60, z + 60), strict=True):
        type_in(ask, **{f"box_{name}": f"{value:.2f}"})
    ask(SetSetup(name="active", value=True))
    ask(MoveJoint(joint=0, angle=float(q[0]) + 0.3))
    wait(lambda: settled(bench), "the controller to have the box")
    state = bench.store.state
    assert not state.plan.report.ok
    assert "cartesian.position" in {violation.condition.id for violation in state.plan.report.violations}
    assert obstacle(state, bench.session.status()).code == "ready.violations"
    held = Text("en").render(describe_held(bench.session.status(), "box"))
    assert held.startswith("on, 120 × 120 × 120 mm, centre ")
    target = next(panel for panel in bench.renderer._panels if isinstance(panel, TargetPanel))
    wait(lambda: "violated: Tool inside the safety box" in target._reach._shown, "the target's verdict to say so")
    wait(lambda: bench.renderer._stage._ribbon._beads > 0, "a bead where it is broken")
    ask(SetSetup(name="active", value=False))
    wait(lambda: bench.renderer._stage._ribbon._beads == 0, "the bead to go")
    gone = outdated(bench.store.state)
    assert gone is not None
    assert "safety box" in Text("en").render(gone)  # What broke the box is no verdict on an arm without one.
    ask(PlanGoal())
    assert outdated(bench.store.state) is None
    wait(lambda: settled(bench), "the controller to have switched the box off")
    assert obstacle(bench.store.state, bench.session.status()) is None


def test_an_arm_that_stands_outside_the_box_is_told_so_in_setup_and_beside_execute(bench, ask):
    ask(MoveJoint(joint=0, angle=float(bench.session.status().q_c[0]) + 0.3))
    x = 1000.0 * bench.store.state.model.forward(bench.session.status().q_c).position[0]
    panel = next(panel for panel in bench.renderer._panels if isinstance(panel, SetupPanel))
    ask(SetSetup(name="active", value=True))
    type_in(ask, box_xmax=f"{x + 0.5:.2f}")
    assert obstacle(bench.store.state, bench.session.status()).code == "ready.stale"
    wait(lambda: "Out of date" in panel._planned._shown, "Setup to look")
    wait(lambda: "The controller uses what was set here: safety box" in panel._verdict._shown, "the confirmation")
    assert "Outside" not in panel._verdict._shown
    type_in(ask, box_xmax=f"{x - 74.03:.2f}")
    wait(lambda: "74.0 mm outside the safety box, past its +x face" in panel._verdict._shown, "Setup to say so")
    ask(PoseGoal(name="here"))
    verdict = "▲ Reachable, but</b> 74.0 mm outside the safety box, past its +x face"
    assert verdict in reach_html(bench.store.state, Text("en"))
    ask(PoseGoal(name="undo"))
    ask(PressCheck(what="again"))
    wait(lambda: obstacle(bench.store.state, bench.session.status()) is None, "a motion that leads in to be allowed")
    arrived = replace(bench.session.status(), q_c=bench.store.state.plan.motion.goal)
    assert obstacle(bench.store.state, arrived).code == "ready.done", "the arm stands inside now"
    ask(MoveJoint(joint=0, angle=float(bench.session.status().q_c[0])))
    ask(MoveJoint(joint=1, angle=float(bench.session.status().q_c[1]) + 0.2))
    reason = obstacle(bench.store.state, bench.session.status())
    assert (reason.code, dict(reason.values)) == (
        "ready.outside",
        {"distance": pytest.approx(0.074, abs=5e-5), "face": "+x"},
    )
    assert "74.0 mm" in Text("zh").render(reason)
    ask(SetSetup(name="active", value=False))
    wait(lambda: "Outside" not in panel._verdict._shown, "Setup to take it back")


def test_another_tool_says_once_what_it_makes_of_a_program_and_that_is_what_it_does(bench, ask):
    ask(EditProgram(what="clear"))
    for _ in range(2):
        ask(EditProgram(what="add", source="here"))
    typed = bench.store.state.program.draft.steps[1].key
    ask(TypeField(field=f"program.{typed}.z", text="500"))
    before = bench.store.state
    taught, posed = before.program.draft.steps
    ask(SetSetup(name="edited", value="tool"))
    ask(MoveSetup(part="tool", position=(0.0, 0.0, 0.05), wxyz=NO_TURN))
    said = bench.store.state.notice
    assert said.text.code == "setup.program_moves"
    ask(MoveSetup(part="tool", position=(0.0, 0.0, 0.1), wxyz=NO_TURN, ended=True))
    after = bench.store.state
    assert after.notice is said
    assert after.program.draft.steps == (taught, posed)
    assert taught.waypoint.q is not None
    assert posed.waypoint.q is None
    flange = before.model.forward(taught.waypoint.q)
    led = [target_of(step.waypoint, after.program.draft.arm(after.model)) for step in after.program.draft.steps]
    assert led[0].is_close(flange @ Pose((0.0, 0.0, 0.1)), 1e-12)
    assert led[1].position[2] == pytest.approx(0.5)
    shown = list_html(after, after.program.draft, None, Text("en"))
    assert f"<b>{1000.0 * led[0].position[2]:.0f}</b>" in shown
    assert "<b>500</b>" in shown
    ask(EditProgram(what="clear"))


def test_a_drag_is_one_step_to_undo_and_is_sent_when_it_has_ended(bench, ask):
    before = wanted(bench).tool
    ask(SetSetup(name="edited", value="tool"))
    for step in range(1, 4):
        ask(MoveSetup(part="tool", position=(0.0, 0.0, 0.03 * step), wxyz=NO_TURN))
    assert pending_parts(bench.store.state, bench.session.status()) == ("tool",)
    ask(MoveSetup(part="tool", position=(0.0, 0.0, 0.1), wxyz=NO_TURN, ended=True))
    assert wanted(bench).tool.position[2] == pytest.approx(0.1)
    wait(lambda: settled(bench), "the controller to have the tool")
    ask(PressSetup(what="undo"))
    assert wanted(bench).tool is before
    assert bench.store.state.model.T_flange_tool is before


def test_handles_belong_to_the_tab_that_is_open(bench, ask):
    ask(SetSetup(name="edited", value="load"))
    before = wanted(bench).load
    ask(OpenTab(name="tab.setup"))
    assert bench.store.state.setup.edited == "load"
    ask(OpenTab(name="tab.target"))
    assert bench.store.state.setup.edited == ""
    assert not hides_target(bench.store.state)
    ask(MoveSetup(part="load", position=(0.0, 0.0, 0.05), wxyz=NO_TURN, ended=True))
    assert wanted(bench).load is before


def test_a_face_of_the_box_follows_its_handle_and_cannot_pass_the_other(bench, ask):
    ask(SetSetup(name="edited", value="box"))
    low = faces(wanted(bench).box)
    ask(ResizeBox(face=3, hand=(0.5, 9.0, 9.0), ended=True))
    assert faces(wanted(bench).box) == pytest.approx([*low[:3], 0.5, *low[4:]])
    ask(ResizeBox(face=3, hand=(-7.0, 0.0, 0.0), ended=True))
    assert 0.0 < wanted(bench).box.size[0] < 0.05
    ask(ResizeBox(face=1, hand=(math.nan, 0.0, 0.0)))
    ask(ResizeBox(face=6, hand=(0.0, 0.0, 0.0)))
    assert faces(wanted(bench).box)[1] == low[1]


@pytest.mark.parametrize(
    ("field", "typed", "problem"),
    [
        ("box.xmin", "4000", "setup.faces"),
        ("box.zmax", "9999", "parse.range"),
        ("tool.x", "nan", "parse.not_finite"),
        ("tool.z", "1,000", "parse.two_ways"),
        ("load.mass", "-1", "parse.range"),
        ("load.mass", "99", "parse.range"),
        ("load.ixx", "0.1", "setup.massless"),
        ("load.iyy", "-0.1", "parse.range"),
        ("force.yaw", "", "parse.empty"),
    ],
)
def test_a_bad_number_is_answered_beside_its_field_and_changes_nothing(bench, ask, field, typed, problem):
    before = wanted(bench)
    type_in(ask, **{field.replace(".", "_"): typed})
    assert bench.store.state.problems[f"setup.{field}"].code == problem
    assert wanted(bench) is before


def test_an_inertia_is_taken_once_some_body_has_it(bench, ask):
    type_in(ask, load_mass="2", load_ixx="0.004")
    assert bench.store.state.problems["setup.load.ixx"].code == "setup.no_body"
    assert not wanted(bench).load.inertia.any()
    type_in(ask, load_iyy="0.003", load_izz="0.002")
    assert np.diagonal(wanted(bench).load.inertia).tolist() == [0.004, 0.003, 0.002]
    assert not any(name.startswith("setup.load.i") for name in bench.store.state.problems)
    type_in(ask, load_mass="0")
    assert not wanted(bench).load.inertia.any()


def test_what_is_no_number_or_no_part_is_ignored(bench, ask):
    ask(SetSetup(name="edited", value="tool"))
    before = bench.store.state.setup
    ask(MoveSetup(part="tool", position=(math.nan, 0.0, 0.0), wxyz=NO_TURN))
    ask(MoveSetup(part="tool", position=(0.0, 0.0, 0.1), wxyz=(0.0,) * 4))
    ask(MoveSetup(part="lamp", position=(0.0, 0.0, 0.1), wxyz=NO_TURN))
    ask(MoveSetup(part="tool", position=(0.0, 0.0, 7.0), wxyz=NO_TURN))
    ask(SetSetup(name="edited", value="lamp"))
    ask(SetSetup(name="axes", value="moon"))
    type_in(ask, lamp_x="1", tool_w="1")
    assert bench.store.state.setup.wanted is before.wanted
    assert told(bench) == "setup.far"


def test_a_watching_page_cannot_change_the_set_up(bench, ask):
    ask(PageOpened(page=1))
    ask(PageOpened(page=2))
    before = wanted(bench)
    ask(MoveSetup(page=2, part="tool", position=(0.0, 0.0, 0.1), wxyz=NO_TURN))
    ask(TypeField(page=2, field="setup.load.mass", text="1"))
    assert wanted(bench) is before
    for page in (1, 2):
        ask(PageClosed(page=page))


def test_after_a_new_connection_the_controller_is_told_again_and_the_page_says_so(bench, ask):
    type_in(ask, load_mass="1")
    wait(lambda: settled(bench), "the controller to have the load")
    ask(RobotCommand(what="reconnect"))
    wait(lambda: told(bench) == "setup.sent_again", "the page to say so")
    assert settled(bench)


def test_every_number_comes_back_as_it_was_typed():
    setup = SetupState()
    setup = replace(setup, wanted=setup.wanted.updated(RobotConfiguration(tool=Pose((0.1, 0.2, 0.3)))))
    turned = with_field(setup, "box", "yaw", 30.0, 2.0)
    assert isinstance(turned, SetupState)
    for part, names in FIELD_NAMES.items():
        for name in names:
            changed = with_field(turned, part, name, 20.0, 2.0)
            assert isinstance(changed, SetupState), (part, name)
            assert read_field(changed, part, name) == pytest.approx(20.0), (part, name)


def test_a_foreign_robot_is_told_nothing_before_a_second_yes(bench, ask):
    setup = replace(bench.store.state.setup, touched=frozenset({"tool"}))
    foreign = replace(bench.store.state, target="rci://192.168.0.160:1337", setup=setup)
    status = SupervisorStatus(phase="idle", target=foreign.target)
    reason = setup_obstacle(foreign, status)
    assert reason.code == "ready.setup_unsent"
    assert "192.168.0.160" in Text("zh").render(reason)
    refused = CommandRejectedError("SetLoad", rci.SettingStatus.INVALID_ARGUMENT, "")
    foreign = replace(foreign, setup=replace(setup, refusal=Message("notice.plain", {"text": str(refused)})))
    assert "SetLoad" in Text("en").render(setup_obstacle(foreign, status))


def test_the_check_tab_says_that_its_report_is_out_of_date(bench, ask):
    ask(MoveJoint(joint=0, angle=float(bench.session.status().q_c[0]) + 0.3))
    type_in(ask, tool_z="100")
    panel = next(panel for panel in bench.renderer._panels if isinstance(panel, CheckPanel))
    wait(lambda: "Out of date" in panel._verdict._shown, "the tab to say so")
    assert panel._again.visible
    ask(PressCheck(what="again"))
    wait(lambda: "Passed" in panel._verdict._shown, "a verdict")
    assert bench.store.state.plan.report.ok
    assert panel._slow.disabled is (not bench.store.state.plan.report.warnings), "there is nothing to slow down for"


def test_after_check_again_the_setup_tab_has_a_verdict_on_the_plan(bench, ask):
    ask(MoveJoint(joint=0, angle=float(bench.session.status().q_c[0]) + 0.3))
    type_in(ask, tool_z="100")
    panel = next(panel for panel in bench.renderer._panels if isinstance(panel, SetupPanel))
    wait(lambda: "Out of date" in panel._planned._shown, "the tab to say so")
    ask(PressCheck(what="again"))
    wait(lambda: "Passed" in panel._planned._shown, "a verdict")
    assert panel._planned._shown == planned_html(bench.store.state, bench.session.status(), Text("en"))
    assert panel._again.disabled


def test_limits_that_the_controller_reports_and_plans_do_not_have_are_named():
    model = load_model("RM75")
    joint, state = model.limits.joint, UiState(model=model, goal=goal_at(model, model.home))

    def differs(**reported):
        return has_other_limits(state, SupervisorStatus(phase="idle", reported=RobotConfiguration(**reported)))

    own = SoftJointLimits(lower=tuple(joint.lower + 2e-5), upper=tuple(joint.upper))
    speeds = tuple(joint.velocity * (1.0 - 1e-5))
    assert not differs()
    assert not differs(joints=own, control=ControllerParameters(joint_velocity=speeds, collision_stage=(8.0,)))
    assert differs(joints=replace(own, upper=(1.0, *own.upper[1:])))
    assert differs(control=ControllerParameters(joint_velocity=(1.0, *speeds[1:])))
    assert differs(control=ControllerParameters(tool_limits=(0.1, 1.6, 0.6, 4.0)))


def test_the_setup_tab_asks_for_no_goal(bench, ask):
    ask(PoseGoal(name="here"))
    panel = next(panel for panel in bench.renderer._panels if isinstance(panel, SetupPanel))
    wait(lambda: getattr(bench.store.state.no_plan, "code", "") == "plan.here", "no plan")
    wait(lambda: panel._planned._shown == "", "nothing about it")


def test_a_robot_that_is_not_ours_is_changed_only_after_a_second_yes(bench, ask):
    controller = start_controller("xMatePro7")
    try:
        ask(ChooseRobot(target=controller.address))
        wait(lambda: bench.session.status().phase == "idle" and bench.session.is_ready, "the other controller")
        told_before = setup_obstacle(bench.store.state, bench.session.status())
        type_in(ask, load_mass="1.5")
        assert setup_obstacle(bench.store.state, bench.session.status()).code == "ready.setup_unsent"
        ask(PressSetup(what="undo"))
        assert setup_obstacle(bench.store.state, bench.session.status()) == told_before
        type_in(ask, load_mass="1.5")
        ask(PressSetup(what="confirm"))
        ask(PressSetup(what="send"))
        ask(PressSetup(what="cancel"))
        ask(PressSetup(what="confirm"))
        ask(PressSetup(what="send"))
        type_in(ask, load_mass="1.6")  # Not what was asked about.
        ask(PressSetup(what="confirm"))
        assert bench.session.status().setup.parts == ()
        ask(PressSetup(what="send"))
        ask(PressSetup(what="confirm"))
        wait(lambda: bench.session.status().setup.load is wanted(bench).load, "the robot to have the load")
        assert bench.session.status().setup.parts == tuple(
            sorted(bench.store.state.setup.touched, key=SETUP_PARTS.index)
        )
    finally:
        ask(ChooseRobot(target="virtual"))
        controller.end()
    wait(lambda: bench.session.status().phase == "idle" and bench.session.is_ready, "our own controller")
    wait(lambda: settled(bench), "our own controller to have the set-up")


def test_what_belongs_to_an_arm_comes_back_with_it(bench, ask):
    type_in(ask, tool_z="80", load_mass="1.5")
    ask(SetSetup(name="active", value=True))
    wait(lambda: settled(bench), "the controller to have it")
    before = wanted(bench)
    name = bench.store.state.model.name
    ask(ChooseRobot(model="xMate3"))
    wait(lambda: bench.store.state.model.name == "xMate3", "the other arm")
    assert wanted(bench).tool.is_close(Pose(), 1e-12)
    ask(ChooseRobot(model=name))
    wait(lambda: bench.store.state.model.name == name, "the first arm again")
    assert bench.store.state.model.T_flange_tool.is_close(before.tool, 1e-12)
    assert (wanted(bench).tool, wanted(bench).load, wanted(bench).box) == (before.tool, before.load, before.box)
    assert told(bench) == "setup.back"
    wait(lambda: settled(bench), "the controller to have it again")
    wait(lambda: told(bench) == "setup.sent_again", "the page to say so")
    said = Text("en").render(bench.store.state.notice.text)
    assert said == "The controller was reconnected, and the configuration was sent again: safety box, tool, load."
