"""Modes, parameters, pauses, the lab and destinations without a browser: what is asked for happens at the robot."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.app.goal.goal_actions import MoveJoint, PoseGoal, SetLaw, SetSpeed
from rcilab.app.request import TypeField
from rcilab.app.run.drive_state import control_field
from rcilab.app.run.mode_actions import PressControl, SetDrive
from rcilab.app.run.mode_parameters import (
    find_group,
    format_ranges,
    held_rows,
    name_group,
    name_parameter,
    typed_range,
    typed_scale,
    typed_value,
)
from rcilab.app.run.played_motion import played_path
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.run.target_robot_actions import ChooseDestination
from rcilab.app.run.world_actions import PressSafety, SetNetwork
from rcilab.app.text import Text
from rcilab.app.view_actions import ShowPlot
from rcilab.control_process import SupervisorStatus
from rcilab.control_process.jitter_histogram import JitterHistogram, summarise
from rcilab.core.state import MODES
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.units import SI
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import default_parameters
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench
from rcilab.workbench.panels.health import histogram_html
from rcilab.workbench.panels.outcome import progress_html
from rcilab.workbench.panels.run import RunPanel
from tests.workbench.opened import opened, told, wait

MODEL = load_model("xMatePro7")


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


@pytest.fixture
def idle(bench):
    bench.dispatcher.ask(SetDrive(mode="joint_position", speed_override=1.0))
    settle(bench)
    return bench


def settle(bench):
    """Waits for an idle, powered arm; leaves a fault as a person would, whenever one shows."""
    was_faulty = False

    def is_settled() -> bool:
        nonlocal was_faulty
        status = bench.session.status()
        if status.phase == "fault" and not was_faulty:
            bench.dispatcher.ask(RobotCommand(what="recover"))
        was_faulty = status.phase == "fault"
        return status.phase == "idle" and bool(status.powered)

    wait(is_settled, "an idle, powered arm")


def plan(bench, speed=0.1, way=0.8):
    """Poses the goal, so that a motion of some seconds is planned and judged."""
    ask, q = bench.dispatcher.ask, bench.session.status().q_c
    before = bench.store.state.plan
    ask(SetSpeed(speed=speed))
    ask(MoveJoint(joint=0, angle=float(q[0]) + (way if q[0] < 0.1 else -way)))

    def planned() -> bool:
        state = bench.store.state
        return state.plan is not None and state.plan is not before and state.plan.complete

    wait(planned, "a plan")
    wait(lambda: bench.store.state.plan.mode == bench.store.state.drive.mode, "the judgement for the mode")


def execute(bench, place=0.3):
    bench.dispatcher.ask(RobotCommand(what="execute"))
    wait(
        lambda: bench.session.status().code == "moving" and (bench.session.status().motion_time or 0.0) > place,
        "the arm on its way",
    )


def test_what_the_page_takes_for_defaults_is_what_the_virtual_controller_wakes_up_with():
    ours, woken = default_parameters(parameters_of(MODEL)), Settings.of(MODEL.description)
    assert ours == {
        "joint_stiffness": woken.joint_stiffness,
        "cartesian_stiffness": woken.cartesian_stiffness,
        "desired_wrench": woken.desired_wrench,
        "collision_thresholds": woken.collision_thresholds,
        "filters": (woken.joint_filter, woken.cartesian_filter, woken.torque_filter),
        "report_filter": (woken.torque_report_filter,),
    }


def test_every_part_says_its_unit_and_range_and_has_its_words():
    groups = parameters_of(MODEL)
    assert format_ranges(find_group(groups, "joint_stiffness")) == "[0…3000, 300 N·m/rad]"
    thresholds = find_group(groups, "collision_thresholds")
    assert name_group(Text("en"), thresholds) == "Collision thresholds [N·m]"  # It fits into one line.
    assert name_parameter(Text("en"), thresholds, 2) == "J3 [0…60]"
    words = load_ui_catalogue("rcilab.app", "en")
    for mode in MODES:
        assert {f"mode.{mode}", f"mode.{mode}_note"} <= words.keys()
    assert {f"control.{group.name}" for group in groups} <= words.keys()
    assert {item.label.code for group in groups for item in group.parameters} <= words.keys()
    assert [group.name for group in groups if "cartesian_position" in group.modes] == [
        "collision_thresholds",
        "filters",
        "report_filter",
    ]
    assert [group.name for group in groups if group.is_first] == ["joint_stiffness", "cartesian_stiffness"]


def test_speeds_are_shown_and_typed_in_the_units_of_the_page():
    groups, text = parameters_of(load_model("RM75")), Text("en", maker="realman")
    speeds = find_group(groups, "joint_velocity")
    assert name_group(text, speeds) == "Joint speeds [0.5…180, 225 °/s]"
    assert name_group(Text("en", SI, "realman"), speeds) == "Joint speeds [0.0087266…3.1416, 3.927 rad/s]"
    assert (typed_range(speeds.parameters[0]), typed_scale(speeds.parameters[0])[1]) == ((0.5, 180.0), "°/s")
    assert typed_value(speeds.parameters[0], 180.0) == speeds.parameters[0].high


def test_a_group_of_different_quantities_names_each_of_them_with_its_unit():
    groups, text = parameters_of(load_model("RM75")), Text("en", maker="realman")
    tool = find_group(groups, "tool_limits")
    rows = dict(held_rows(groups, None, SupervisorStatus(), text, is_known=True))
    assert rows["Limits of the tool"] == (
        "Speed 250 mm/s; Acceleration 1600 mm/s²; Rotation speed 34.377°/s; Rotation acceleration 229.18°/s²"
    )
    assert name_parameter(text, tool, 0) == "Speed [10…10000 mm/s]"
    assert name_group(text, tool) == "Limits of the tool"


@pytest.mark.parametrize("name", ["control.joint_stiffness.7", "control.sideways.0", "control.filters", "control"])
def test_fields_that_do_not_exist_are_none(name):
    assert control_field(MODEL, name) is None


def test_a_typed_parameter_is_told_acknowledged_and_read_back(idle):
    ask = idle.dispatcher.ask
    ask(TypeField(field="control.joint_stiffness.2", text="1234 N·m/rad"))
    wait(
        lambda: (c := idle.session.status().setup.control) is not None and c["joint_stiffness"][2] == 1234.0,
        "the answer",
    )
    ask(TypeField(field="control.joint_stiffness.2", text="30000"))
    wait(lambda: "control.joint_stiffness.2" in idle.store.state.problems, "the complaint")
    assert idle.store.state.drive.control["joint_stiffness"][2] == 1234.0
    ask(PressControl(what="reset"))
    wait(lambda: idle.session.status().setup.control == default_parameters(parameters_of(MODEL)), "the defaults")
    assert "control.joint_stiffness.2" not in idle.store.state.problems


def test_the_plan_is_judged_by_the_conditions_of_the_mode(idle):
    idle.dispatcher.ask(SetLaw(law="jerk_limited"))
    plan(idle, speed=0.5)
    assert idle.store.state.plan.report.ok
    idle.dispatcher.ask(SetDrive(mode="torque"))
    wait(lambda: idle.store.state.plan.mode == "torque", "another judgement")
    report = idle.store.state.plan.report
    assert {row.condition.id for row in report.rows} >= {"torque.rate", "torque.range"}
    assert not report.ok  # Half of the speed asks for more than the torque rate.
    idle.dispatcher.ask(RobotCommand(what="execute"))
    wait(lambda: told(idle) == "ready.violations", "the refusal")
    idle.dispatcher.ask(SetDrive(mode="sideways"))
    idle.dispatcher.ask(SetDrive(mode="joint_position"))
    wait(lambda: idle.store.state.plan.report.ok, "the first judgement again")
    idle.dispatcher.ask(SetLaw(law="torque_rate_limited"))


def test_paused_gone_on_with_slower_and_recorded_as_it_was(idle):
    idle.dispatcher.ask(SetDrive(mode="joint_impedance"))
    wait(lambda: idle.store.state.drive.mode == "joint_impedance", "the mode")
    plan(idle)
    motion = idle.store.state.plan.motion
    execute(idle)
    idle.dispatcher.ask(RobotCommand(what="pause"))
    wait(lambda: idle.session.status().code == "moving.held", "the pause")
    shown = idle.session.status()
    share = f"{100.0 * shown.motion_plan_time / motion.duration:.0f}%"
    assert f"width:{share}" in progress_html(idle.store.state, shown, Text("en"))
    idle.dispatcher.ask(SetDrive(mode="torque"))
    wait(lambda: told(idle) == "notice.moving", "the refusal of another mode in mid-motion")
    idle.dispatcher.ask(SetDrive(speed_override=0.7))
    idle.dispatcher.ask(RobotCommand(what="resume"))
    wait(lambda: idle.session.status().speed_override == pytest.approx(0.7), "the way on")
    wait(lambda: told(idle) == "notice.arrived", "the arrival")
    wait(lambda: idle.store.state.last_run is not None and idle.store.state.last_run.run is not None, "the run")
    run = idle.store.state.last_run.run
    assert run.setup.mode == "joint_impedance"
    assert run.plan.duration > motion.duration + 0.5
    assert run.plan.goal == pytest.approx(motion.goal, abs=1e-9)
    assert np.degrees(np.nanmax(np.abs(run.tracking.joint))) < 2.0  # Against what was asked for, pauses and all.
    assert run.has_speed_override
    assert np.array_equal(played_path(idle.store.state)[1], run.plan.q)  # And so it is drawn.
    assert idle.renderer.playhead_at(1.0) == 1.0


def test_the_speed_of_the_slider_counts_from_the_start_and_a_pause_needs_a_motion(idle):
    idle.dispatcher.ask(RobotCommand(what="pause"))
    wait(lambda: told(idle) == "speed_override.nothing", "the answer")
    idle.dispatcher.ask(SetDrive(speed_override=5.0))
    wait(lambda: told(idle) == "parse.range", "the bounds")
    idle.dispatcher.ask(SetDrive(speed_override=0.2))
    plan(idle)
    execute(idle)
    wait(lambda: idle.session.status().speed_override == pytest.approx(0.2), "the slow motion")
    idle.dispatcher.ask(RobotCommand(what="stop"))
    wait(lambda: idle.session.status().phase == "idle", "rest")


def test_an_arm_at_its_goal_has_one_line_that_says_so(idle):
    idle.dispatcher.ask(PoseGoal(name="here"))
    wait(lambda: idle.store.state.plan is None, "no plan")
    panel = next(panel for panel in idle.renderer._panels if isinstance(panel, RunPanel))
    wait(lambda: "already at the goal" in panel._planned._shown, "the line")
    assert panel._reason._shown == ""


def test_a_stop_undoes_what_was_pressed_before_it_and_not_yet_looked_at(idle, monkeypatch):
    bench, is_busy, may_go_on = idle, threading.Event(), threading.Event()
    plan(bench)
    stands_at = bench.session.status().q_c

    def be_busy(request):
        is_busy.set()
        may_go_on.wait(10.0)

    monkeypatch.setitem(bench.dispatcher._handlers, ShowPlot, be_busy)
    bench.dispatcher.ask(ShowPlot(name="q", on=True))
    assert is_busy.wait(10.0)
    bench.dispatcher.ask(RobotCommand(what="execute"))
    bench.session.stop()
    may_go_on.set()
    wait(lambda: "error.stopped_before" in str(bench.store.state.notice), "the word that it was stopped before")
    assert bench.session.status().phase == "idle"
    assert np.array_equal(bench.session.status().q_c, stands_at)
    execute(bench)  # What is pressed after the stop goes.
    bench.session.stop()
    wait(lambda: bench.session.status().code == "idle.stopped", "a stopped arm")


def test_the_cable_is_pulled_in_a_motion_and_plugged_in_again(idle):
    plan(idle)
    execute(idle, 0.1)
    idle.dispatcher.ask(SetNetwork(pulled=True))
    wait(lambda: idle.session.status().phase == "lost", "the loss to be noticed")
    wait(lambda: told(idle) == "incident.lost.pulled", "the way out: the plug, not a restart")
    assert obstacle(idle.store.state, idle.session.status()).code == "incident.lost.pulled"
    idle.dispatcher.ask(SetNetwork(pulled=False))
    wait(lambda: not idle.store.state.world.pulled, "the cable in")
    idle.dispatcher.ask(SetNetwork(name="loss", value=9.0))
    wait(lambda: (w := idle.store.state.world.status) is not None and w.commands.loss == 0.3, "the bound of the slider")
    idle.dispatcher.ask(SetNetwork(clear=True))
    wait(lambda: (w := idle.store.state.world.status) is not None and w.commands.is_udp_clean, "a good network")
    idle.dispatcher.ask(RobotCommand(what="reconnect"))
    wait(lambda: idle.session.status().phase in ("idle", "fault"), "the connection")
    settle(idle)


def test_the_emergency_stop_has_a_way_out(idle):
    ask = idle.dispatcher.ask
    ask(PressSafety(button="estop"))
    wait(lambda: idle.session.status().powered is False, "the motors off")
    wait(lambda: idle.store.state.world.status.button == "estop", "the button to show")
    ask(PressSafety(button="none"))
    wait(lambda: idle.store.state.world.status.button == "none", "the release")
    ask(RobotCommand(what="power_on"))
    wait(lambda: bool(idle.session.status().powered), "the motors on")
    assert idle.session.status().faults == ()


def test_an_address_is_named_once_more_and_preview_connects_to_nothing(idle):
    ask = idle.dispatcher.ask
    ask(ChooseDestination(where="address", address=" rci://127.0.0.1:9 "))
    wait(lambda: idle.store.state.typed_address == "rci://127.0.0.1:9", "the question")
    assert idle.store.state.target == "virtual"
    ask(ChooseDestination(where="address", answer="no"))
    wait(lambda: idle.store.state.typed_address == "", "the end of it")
    ask(ChooseDestination(where="address", address="rci://127.0.0.1:9"))
    wait(lambda: idle.store.state.typed_address == "rci://127.0.0.1:9", "the question again")
    ask(ChooseDestination(where="address", address="999.1.1.1"))
    wait(lambda: told(idle) == "address.bad", "the complaint")
    assert "is not a valid controller address" in Text("en").render(idle.store.state.notice.text)
    assert idle.store.state.typed_address == "", "the question was about another address"
    ask(ChooseDestination(where="address", address="rci://127.0.0.1:9"))
    wait(lambda: idle.store.state.typed_address == "rci://127.0.0.1:9", "the question again")
    assert told(idle) != "address.bad", "a good address was typed"
    ask(ChooseDestination(where="address", address="rci://127.0.0.1:10", answer="yes"))
    wait(lambda: idle.store.state.typed_address == "rci://127.0.0.1:10", "the question about the other one")
    assert idle.store.state.target == "virtual", "a yes to one address connects to no other"
    ask(ChooseDestination(where="preview"))
    wait(lambda: idle.session.status().phase == "closed", "nothing connected")
    ask(ChooseDestination(where="ideal"))
    wait(lambda: idle.session.status().phase == "idle", "the virtual controller again")


def test_cycles_that_were_too_late_have_a_word_beside_their_bar():
    words = memoryview(bytearray(8 * 400)).cast("Q")
    histogram = JitterHistogram(words)
    for lateness in [2e-5] * 900 + [3e-3]:
        histogram.add(lateness)
    said = histogram_html(summarise(words), Text("en"))
    assert "900" in said
    assert said.count("too late") == 1
    assert histogram_html(summarise(memoryview(bytearray(8 * 400)).cast("Q")), Text("en")) == ""
