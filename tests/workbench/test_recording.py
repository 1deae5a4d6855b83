"""What became of a motion on the page: recorded whole, in a file too, exported, and replayed with nothing connected."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rcilab
from rcilab.app.control_lock_actions import PageOpened
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import MoveJoint, SetSpeed
from rcilab.app.run.export_actions import ENDINGS, CancelExport, ExportRun
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.replay import replayed_pose, require_replayable
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.app.view_actions import Seek
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import UsageError
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.recording.run import decode_run
from rcilab.recording.run_setup import Setup
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.outcome import outcome_html, replay_html
from rcilab.workbench.panels.plot_marks import plot_marks
from rcilab.workbench.panels.recording import progress_html, summary_html
from rcilab.workbench.panels.timeline import TimelinePanel
from tests.recording.runs import PLAN, export_run, some_ideal_run, some_run
from tests.workbench.opened import told, wait


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Iterator[Workbench]:
    config = WorkbenchConfig(port=0, quality="light", runs=tmp_path_factory.mktemp("home") / "runs")
    with Workbench(config) as found:
        wait(lambda: bool(found.session.status().powered), "an arm with power")
        yield found
        assert found.dispatcher.errors == []
        assert found.renderer.errors == []


def execute(bench: Workbench, angle: float, speed: float = 0.5) -> None:
    bench.dispatcher.ask(SetSpeed(speed=speed))
    bench.dispatcher.ask(MoveJoint(joint=0, angle=angle))
    wait(
        lambda: (
            (plan := bench.store.state.plan) is not None
            and abs(plan.motion.goal[0] - angle) < 1e-9
            and obstacle(bench.store.state, bench.session.status()) is None
        ),
        "a plan that may be executed",
    )
    bench.dispatcher.ask(RobotCommand(what="execute"))


def finished(bench: Workbench):
    wait(lambda: (r := bench.store.state.recording) is not None and r.run is not None, "a finished recording")
    return bench.store.state.recording


def test_a_motion_is_recorded_whole_judged_against_its_plan_and_kept_in_a_file(bench):
    execute(bench, 0.2)
    recording = finished(bench)
    run = recording.run
    assert np.array_equal(np.diff(run.cycles["message_id"]), 1 + run.cycles["lost"][1:])  # Every cycle, none twice.
    assert run.t[-1] >= run.plan.duration
    assert run.stopped is None
    assert recording.tracking.joint_max.max() < 1e-6  # The ideal plant is where it is told to be.
    shown, end = bench.renderer, bench.renderer._timeline.end
    assert end > run.plan.duration
    assert shown.playhead_at(0.2) * run.plan.duration == pytest.approx(0.2 * end)  # A click goes where it was clicked.
    back = rcilab.load_run(recording.file)
    assert back.is_complete
    assert back.cycles.tobytes() == run.cycles.tobytes()
    assert (back.setup.target, back.setup.plant) == ("virtual", "ideal")
    assert "Ran to its end" in outcome_html(bench.store.state, bench.session.status(), Text("en"))
    assert "J7" in summary_html(recording, Text("en"))


def test_a_motion_whose_control_process_is_killed_leaves_every_cycle_until_then(bench):
    status = bench.session.status()
    execute(bench, -1.0 if status.q_c[0] > 0 else 1.0, speed=0.1)
    wait(lambda: (r := bench.store.state.recording) is not None and len(r.t) > 300, "a motion on its way")
    os.kill(bench.session.status().worker_pid, signal.SIGKILL)
    recording = finished(bench)
    run = recording.run
    assert 300 < len(run.t) < len(run.plan.q)
    assert np.array_equal(np.diff(run.cycles["message_id"]), 1 + run.cycles["lost"][1:])
    assert "control process" in run.stopped
    assert rcilab.load_run(recording.file).cycles.tobytes() == run.cycles.tobytes()
    assert "Stopped before its end" in outcome_html(bench.store.state, bench.session.status(), Text("en"))


def test_exports_reach_the_page_that_asked_and_problems_are_told(bench, monkeypatch):
    if bench.store.state.recording is None:
        execute(bench, 0.1)
    run = finished(bench).run
    bench.dispatcher.ask(PageOpened(page=7))
    wait(lambda: bench.store.state.control_lock.holder == 7, "the controls")
    sent = []
    actions = bench.dispatcher._export

    def deliver(page, name, stream, is_cancelled):
        stream.seek(0)
        sent.append((page, name, stream.read()))
        return not is_cancelled()

    monkeypatch.setattr(actions, "_deliver", deliver)
    bench.dispatcher.ask(ExportRun(page=8, ending=".csv"))  # A page that only watches gets none.
    for ending in (".csv", ".html", ".rcirun"):
        bench.dispatcher.ask(ExportRun(page=7, ending=ending))
        wait(lambda ending=ending: bool(sent) and sent[-1][1].endswith(ending), f"the {ending}")
        wait(lambda: bench.store.state.export is None, "the end of the export")
    assert {page for page, _, _ in sent} == {7}
    assert sent[0][1].startswith("xMatePro7-20")
    assert decode_run(sent[2][2]).cycles.tobytes() == run.cycles.tobytes()
    import sys

    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    bench.dispatcher.ask(ExportRun(page=7, ending=".mcap"))
    wait(lambda: told(bench) == "export.missing", "what is missing")
    wait(lambda: bench.store.state.export is None, "the end of the export")
    monkeypatch.setattr(
        actions, "_deliver", lambda page, name, stream, is_cancelled: bool(wait(is_cancelled, "a cancel"))
    )
    bench.dispatcher.ask(ExportRun(page=7, ending=".csv"))
    wait(lambda: bench.store.state.export is not None, "an export")
    bench.dispatcher.ask(CancelExport(page=7))
    wait(lambda: told(bench) == "export.cancelled", "that it was cancelled")
    wait(lambda: bench.store.state.export is None, "the end of the export")
    monkeypatch.setattr(actions, "_deliver", deliver)
    bench.dispatcher.ask(ExportRun(page=7, ending="../../etc/passwd"))
    bench.store.update(recording=None)
    bench.dispatcher.ask(ExportRun(page=7, ending=".csv"))
    wait(lambda: len(sent) == 4, "the run, which no other plan takes away")
    assert sent[3][1].endswith(".csv")
    wait(lambda: bench.store.state.export is None, "the end of the export")
    bench.store.update(last_run=None)
    bench.dispatcher.ask(ExportRun(page=7, ending=".csv"))
    wait(lambda: told(bench) == "export.nothing", "that there is nothing")
    assert len(sent) == 4


def test_what_became_of_a_run_is_said_of_the_robot_that_made_it():
    run = replace(some_ideal_run(), setup=Setup(target="virtual", plant="ideal"))
    made = UiState(model=run.model, goal=goal_at(run.model, run.model.home), last_run=whole_recording(run))
    idle, text = SimpleNamespace(phase="idle"), Text("en")
    assert "Last run: <b>Ran to its end" in outcome_html(made, idle, text)
    assert "rl-good" in outcome_html(made, idle, text)
    other = load_model("xMate3")
    for elsewhere, status in (
        (replace(made, plant="mujoco"), idle),
        (replace(made, target="rci://192.168.0.160:1337"), idle),
        (replace(made, model=other, goal=goal_at(other, other.home)), idle),
        (made, SimpleNamespace(phase="closed")),
    ):
        said = outcome_html(elsewhere, status, text)
        assert "rl-verdict" not in said
        assert f"virtual controller, ideal arm · {run.model.name}: Ran to its end" in said


def test_a_run_is_replayed_with_nothing_connected_until_it_is_asked_for(monkeypatch):
    run = some_run()
    with Workbench(WorkbenchConfig(port=0, quality="light", replay=run)) as bench:
        assert bench.store.state.model is run.model
        assert bench.store.state.recording.run is run
        bench.dispatcher.ask(Seek(playhead=0.5))
        wait(lambda: bench.store.state.playhead == 0.5, "the middle of the run")
        middle = replayed_pose(bench.store.state)
        row = int(np.searchsorted(run.t, 0.5 * run.plan.duration + 1e-3))
        assert np.array_equal(middle, run.q[row])
        bench.dispatcher.ask(MoveJoint(joint=0, angle=0.5))
        wait(lambda: abs(bench.store.state.goal.q[0] - 0.5) < 1e-9, "a goal that was posed")
        assert bench.store.state.recording.run is run, "posing a goal loses nothing of the run"
        assert bench.store.state.plan.motion is run.plan
        wanted = bench.store.state.setup.wanted
        assert wanted.tool.is_close(run.model.T_flange_tool, 0.0)
        assert wanted.load.mass == run.model.load.mass
        assert bench.store.state.setup.touched == {"tool", "load"}
        status = bench.session.status()
        assert (status.phase, status.worker_pid) == ("closed", None)
        banner = replay_html(bench.store.state, status, Text("en"))
        assert "Recorded run:</b> xMatePro7" in banner
        assert "Ran to its end, 0.06° from its goal at joint 2." in banner
        assert replay_html(bench.store.state, SimpleNamespace(phase="idle"), Text("en")) == ""
        assert obstacle(bench.store.state, status).code == "ready.closed"
        opened = []
        monkeypatch.setattr(bench.session, "open", lambda *what: opened.append(what[:2]))
        bench.dispatcher.ask(ChooseRobot(target="virtual"))
        wait(lambda: opened == [(run.model, "virtual")], "a virtual controller, once it is asked for")
        assert bench.dispatcher.errors == []
        assert bench.renderer.errors == []


def test_a_fault_is_marked_and_told_at_the_moment_it_was_reported():
    run = some_run()
    cycles = run.cycles.copy()
    cycles["faults"][40:] = 1 << Fault.COLLISION
    recording = whole_recording(replace(run, cycles=cycles))
    assert recording.moment == run.t[40]
    assert whole_recording(run).moment is None
    goal = goal_at(run.model, np.array(run.model.home))
    state = UiState(model=run.model, goal=goal, recording=recording)
    flag = {"share": 0.2, "label": Fault.COLLISION.manual_name, "fault": True}
    assert plot_marks(state, (run.t[40] - recording.delay * CYCLE_TIME) / 0.2) == [flag]
    banner = replay_html(state, SimpleNamespace(phase="closed"), Text("en"))
    assert f"Ended by a fault at {run.t[40]:.3f} s: {Fault.COLLISION.manual_name}." in banner


def test_a_run_that_cannot_be_replayed_says_why():
    from dataclasses import replace

    for facts, words in (
        ({"model": None}, "which arm"),
        ({"cycles": some_run().cycles[:0]}, "cycle"),
    ):
        with pytest.raises(UsageError, match=words):
            require_replayable(replace(some_run(), **facts))


def test_every_export_of_the_page_is_named_in_both_languages():
    for language in ("en", "zh"):
        text = Text(language)
        for ending in ENDINGS:
            assert text.has(f"export.{ending[1:]}")
            assert text.has(f"export.{ending[1:]}_hint")
        assert "40 %" in progress_html(".csv", 0.4, text)
    assert len(export_run(some_run(), ".npz")) > 1000


def test_a_run_of_a_callback_is_replayed_by_what_it_commanded():
    run = replace(some_run(), plan=None)
    with Workbench(WorkbenchConfig(port=0, quality="light", replay=run)) as bench:
        state = bench.store.state
        assert state.plan is not None
        assert np.allclose(state.plan.motion.q, PLAN.q[: len(state.plan.motion)], rtol=0, atol=1e-9)
        assert state.recording.run.plan is None
        for language, words in (("en", "solid: recorded, blue: commanded"), ("zh", "蓝色：指令")):
            status = SimpleNamespace(q=None, phase="closed")
            caption = TimelinePanel(Text(language), lambda request: None)._read(state, status)
            assert words in caption
            assert "plan" not in caption
