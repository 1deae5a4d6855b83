"""A workbench that is killed leaves its goal, set-up and program to the next one; one that is closed its program."""

from __future__ import annotations

import json
import os
import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rcilab.app.autosave import Autosave, autosave_file
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import MoveJoint
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import LoadProgram
from rcilab.app.program.program_draft import draft_of
from rcilab.app.request import TypeField
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.app.view_actions import SetView
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import ForceControlFrame, RobotConfiguration
from rcilab.makers.rokae.wire import ForceFrame
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint
from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.recording.runs import some_run
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")
GOAL = MODEL.home + 0.1
PROGRAM = Program(model=MODEL.name, start=MODEL.home, waypoints=(Waypoint.joint(GOAL), Waypoint.joint(MODEL.home)))


SETUP = RobotConfiguration(
    tool=Pose((0.01, 0.0, 0.12), (0.8, 0.6, 0.0, 0.0)),
    load=Payload(mass=1.5, center_of_mass=(0.0, 0.01, 0.05), inertia=np.diag([0.01, 0.02, 0.015])),
    box=SafetyBox(size=(1.0, 1.2, 0.8), T_base_box=Pose((0.1, 0.0, 0.5)), active=True),
    force=ForceControlFrame(T_flange_force=Pose((0.0, 0.0, 0.1)), type=ForceFrame.TOOL),
)


def state_with_all() -> UiState:
    state = UiState(model=MODEL, goal=goal_at(MODEL, GOAL))
    wanted = state.setup.wanted.updated(SETUP)
    state = replace(state, setup=replace(state.setup, wanted=wanted, touched=frozenset(SETUP.parts)))
    return replace(state, program=replace(state.program, draft=draft_of(PROGRAM, MODEL)))


def test_what_was_kept_is_recalled(tmp_path):
    Autosave(tmp_path / "deep" / "kept.json").keep(state_with_all())
    autosave = Autosave(tmp_path / "deep" / "kept.json")
    kept = autosave.recall(MODEL)
    assert np.array_equal(kept.q, GOAL)
    assert [w.type for w in kept.program.waypoints] == ["joint", "joint"]
    assert kept.setup.tool.is_close(SETUP.tool, 1e-12)
    assert (kept.setup.load.mass, kept.setup.box.size, kept.setup.box.active) == (1.5, (1.0, 1.2, 0.8), True)
    assert np.array_equal(kept.setup.load.inertia, SETUP.load.inertia)
    assert kept.setup.force.type is ForceFrame.TOOL
    other = load_model("xMate3")
    assert autosave.recall(other) is None
    autosave.keep(UiState(model=other, goal=goal_at(other, other.home)))
    assert np.array_equal(Autosave(tmp_path / "deep" / "kept.json").recall(MODEL).q, GOAL), "each arm has its own"


def test_nothing_is_written_again_while_nothing_has_changed(tmp_path):
    autosave, state = Autosave(tmp_path / "kept.json"), state_with_all()
    autosave.keep(state)
    (tmp_path / "kept.json").unlink()
    autosave.keep(replace(state, speed=0.1))
    assert not (tmp_path / "kept.json").exists()


SHORT = '{"format": "rcilab workbench", "version": 1, "arms": {"xMatePro7": {"q": [1], "program": null}}}'


@pytest.mark.parametrize("text", [SHORT, "", "{", "[]", "{}", '{"format": "rcilab workbench", "version": 2}', "\udcff"])
def test_a_file_that_nobody_understands_is_as_good_as_none(tmp_path, text):
    (tmp_path / "kept.json").write_text(text, errors="surrogateescape")
    assert Autosave(tmp_path / "kept.json").recall(MODEL) is None


def test_where_nothing_can_be_written_the_page_goes_on(tmp_path):
    (tmp_path / "file").write_text("")
    autosave = Autosave(tmp_path / "file" / "kept.json")
    autosave.keep(state_with_all())
    assert autosave.recall(MODEL) is None
    autosave.close(state_with_all())


def test_the_next_workbench_at_the_port_has_goal_plan_and_program():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    file = autosave_file(port)
    with Workbench(WorkbenchConfig(port=port)) as bench:
        wait_for(lambda: bench.session.status().phase == "idle", what="an idle arm")
        for joint, angle in enumerate(GOAL.tolist()):
            bench.dispatcher.ask(MoveJoint(joint=joint, angle=angle))
        bench.dispatcher.ask(TypeField(field="setup.tool.z", text="120"))
        bench.dispatcher.ask(LoadProgram(name="mine.json", content=PROGRAM.to_json().encode()))
        wait_for(lambda: is_kept(file), what="the goal and the program to be written down")
        left = file.read_text()
    with Workbench(WorkbenchConfig(port=port)) as bench:
        assert (
            Text("en").render(bench.store.state.notice.text)
            == f"Configuration of the {MODEL.name} restored: program, tool."
        )
        assert bench.store.state.setup.seen == {"tool"}  # What was set is drawn.
        assert len(bench.store.state.program.draft.steps) == 2
        assert not np.allclose(bench.store.state.goal.q, GOAL, atol=1e-3)
        assert bench.store.state.model.T_flange_tool.position.tolist() == [0.0, 0.0, 0.12]
        wait_for(lambda: bench.session.status().setup.parts == ("tool",), what="our controller to be told the tool")
        bench.dispatcher.ask(EditProgram(what="clear"))
        wait_for(lambda: not bench.store.state.program.draft.steps, what="an empty program")
    with Workbench(WorkbenchConfig(port=port)) as bench:
        assert Text("en").render(bench.store.state.notice.text) == f"Configuration of the {MODEL.name} restored: tool."
    file.write_text(left)  # As if it had been killed.
    with Workbench(WorkbenchConfig(port=port)) as bench:
        assert np.allclose(bench.store.state.goal.q, GOAL, atol=1e-12)
        assert bench.store.state.notice.text.code == "notice.resumed"
        assert bench.store.state.model.T_flange_tool.position.tolist() == [0.0, 0.0, 0.12]
        wait_for(lambda: bench.session.status().setup.parts == ("tool",), what="the controller to be told the tool")
        assert len(bench.store.state.program.draft.steps) == 2
        plan = wait_for(lambda: bench.store.state.plan, what="a plan from the arm to the goal")
        assert np.allclose(plan.motion.goal, GOAL, atol=1e-12)


def test_after_an_orderly_end_every_arm_has_its_set_up_and_none_its_goal(tmp_path):
    file, other = tmp_path / "kept.json", load_model("xMate3")
    kept = Autosave(file)
    kept.keep(state_with_all())
    kept.close(UiState(model=other, goal=goal_at(other, other.home)))
    again = Autosave(file)
    assert again.recall(other) is None
    assert again.recall_setups(other)[MODEL.name].parts == SETUP.parts
    back = again.recall(MODEL)
    assert back.q is None
    assert back.setup.parts == SETUP.parts
    assert len(back.program.waypoints) == 2


def test_an_arm_that_was_exchanged_before_a_crash_has_its_set_up_again_when_it_is_chosen():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    file, other = autosave_file(port), load_model("xMate3")
    kept = Autosave(file)
    kept.keep(state_with_all())
    kept._next = 0.0
    kept.keep(UiState(model=other, goal=goal_at(other, other.home)))
    with Workbench(WorkbenchConfig(port=port, model="xMate3")) as bench:
        wait_for(lambda: bench.session.status().phase == "idle", what="an idle arm")
        assert bench.store.state.model.name == "xMate3"
        bench.dispatcher.ask(ChooseRobot(model=MODEL.name))
        wait_for(lambda: bench.store.state.model.name == MODEL.name, what="the other arm")
        assert bench.store.state.model.T_flange_tool.is_close(SETUP.tool, 1e-12)
        assert bench.store.state.setup.wanted.load.mass == SETUP.load.mass
        assert bench.store.state.setup.touched == frozenset(SETUP.parts)


def is_kept(file: Path) -> bool:
    if not os.path.exists(file):
        return False
    kept = json.loads(file.read_text())["arms"][MODEL.name]
    return kept["program"] is not None and np.allclose(kept["q"], GOAL)


def test_programs_of_other_arms_and_a_look_at_a_recording_lose_nothing():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    autosave = Autosave(autosave_file(port))
    autosave.close(state_with_all())
    with Workbench(WorkbenchConfig(port=port, replay=some_run())):
        pass
    with Workbench(WorkbenchConfig(port=port, model="xMate3")) as bench:
        wait_for(lambda: bench.session.status().phase == "idle", what="an idle arm")
        assert not bench.store.state.program.draft.steps
        bench.dispatcher.ask(ChooseRobot(model=MODEL.name))
        wait_for(lambda: len(bench.store.state.program.draft.steps) == 2, what="the program of the other arm")
    assert len(Autosave(autosave_file(port)).recall(MODEL).program.waypoints) == 2
    autosave_file(port).unlink()


def test_how_the_page_looks_comes_back_and_a_language_that_is_asked_for_wins(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with Workbench(WorkbenchConfig(port=port)) as bench:
        for name, value in (("language", "zh"), ("theme", "dark"), ("angle", "rad"), ("length", "m")):
            bench.dispatcher.ask(SetView(page=None, name=name, value=value))
        wait_for(lambda: bench.store.state.units.length == "m", what="the settings")
    with Workbench(WorkbenchConfig(port=port)) as bench:
        state = bench.store.state
        assert (state.language, state.theme, state.units.angle, state.units.length) == ("zh", "dark", "rad", "m")
        assert state.notices == ()
    with Workbench(WorkbenchConfig(port=port, language="en")) as bench:
        assert (bench.store.state.language, bench.store.state.theme) == ("en", "dark")
    autosave_file(port).write_text('{"format": "rcilab workbench", "version": 1, "arms": {}, "looks": {"theme": 7}}')
    with Workbench(WorkbenchConfig(port=port)) as bench:
        assert bench.store.state.theme == "light"
