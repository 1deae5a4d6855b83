"""Recorded runs of the folder: listed, opened over the robot, which nothing reaches meanwhile, and closed again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rcilab.app.goal.goal_actions import MoveJoint
from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.run.folder_actions import FolderActions
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.replay_actions import CloseRun, OpenRun
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.store import Store
from rcilab.app.text import Text
from rcilab.app.view_actions import Play, Seek
from rcilab.core.cycle_recorder import Recorder
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.recording.run import Run, build_run
from rcilab.recording.run_summary import summarize_run
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.recording import runs_html
from tests.recording.runs import MODEL, SETUP, some_run, some_stopped_run
from tests.workbench.opened import told, wait
from tests.workbench.test_status_text import initial_state


def faulty_run() -> Run:
    run = some_run()
    cycles = run.cycles.copy()
    cycles["faults"][len(cycles) // 2 :] = 1 << Fault.COLLISION
    return replace(run, cycles=cycles[: len(cycles) // 2 + 20], stopped="a fault")


def run_of(name: str) -> Run:
    """A run of another arm, with six joints."""
    model = load_model(name)
    plan = plan_joint(model, model.home, model.home + 0.2, speed=0.3)
    recorder = Recorder(6, len(plan.q))
    for k, (q, dq) in enumerate(zip(plan.q, plan.dq, strict=True)):
        stamp = 1_000_000 * k
        recorder.write(
            k + 5, k * 1e-3, stamp, stamp + 90_000, 2e-5, 1.0, q, q, dq, q, 0, 0, (1, 1, 1), [1.0] * 6
        )  # fmt: skip
    return build_run(recorder.rows(), plan=plan, model=model, setup=SETUP)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    for number, run in enumerate((some_run(), some_stopped_run(), faulty_run(), run_of("xMate3"))):
        run.save(folder / f"{number}.rcirun")
    whole = (folder / "0.rcirun").read_bytes()
    (folder / "cut.rcirun").write_bytes(whole[:-20])
    (folder / "no.rcirun").write_bytes(b"no run")
    return folder


def test_a_run_is_summarized_from_the_ends_of_its_file(folder):
    found = {name: summarize_run(folder / f"{name}.rcirun") for name in ("0", "1", "2", "3", "cut", "no", "none")}
    run = some_run()
    assert found["0"].duration == run.duration
    assert found["0"].started_ns == run.setup.started_ns
    assert [found[name].ended for name in ("0", "1", "2", "cut")] == ["arrived", "stopped", "fault", "cut"]
    assert found["2"].faults == (Fault.COLLISION,)
    assert [found[name].model for name in ("0", "3")] == ["xMatePro7", "xMate3"]
    assert found["no"] is found["none"] is None


def test_the_newest_runs_are_listed_first_and_followed(tmp_path):
    store = Store(replace(initial_state(), runs=tmp_path))
    actions = FolderActions(store)

    def names() -> list[str]:
        for _ in range(4):
            actions._next = float("-inf")
            actions.tick()
        return [run.name for run in store.state.folder.runs]

    assert names() == []
    for number in range(6):
        some_run().save(tmp_path / f"{number}.rcirun")
    assert names() == [f"{number}.rcirun" for number in (5, 4, 3, 2, 1, 0)]
    (tmp_path / "5.rcirun").unlink()
    growing = (tmp_path / "4.rcirun").read_bytes()[:-20]
    (tmp_path / "growing.rcirun").write_bytes(growing)
    assert names() == [f"{number}.rcirun" for number in (4, 3, 2, 1, 0)], "a file that is being written is left out"


@pytest.mark.parametrize(("language", "words"), [("en", ("completed", "stopped")), ("zh", ("完成", "已停止"))])
def test_the_list_says_arm_and_end_of_a_run(folder, language, words):
    names = [summarize_run(folder / f"{number}.rcirun") for number in (2, 1, 0)]
    state = initial_state()
    html = runs_html(replace(state, folder=replace(state.folder, runs=tuple(names))), Text(language))
    for word in (*words, Fault.COLLISION.manual_name, "xMatePro7", 'data-run="2.rcirun"'):
        assert word in html
    assert runs_html(state, Text(language)) == ""


@pytest.fixture(scope="module")
def bench(folder) -> Iterator[Workbench]:
    with Workbench(WorkbenchConfig(port=0, quality="light", runs=folder)) as found:
        wait(lambda: bool(found.session.status().powered), "an arm with power")
        wait(lambda: len(found.store.state.folder.runs) == 5, "the list")
        yield found
        assert found.dispatcher.errors == []
        assert found.renderer.errors == []


@pytest.mark.parametrize("name", ["2.rcirun", "3.rcirun"])
def test_an_opened_run_is_shown_over_the_robot_which_nothing_reaches_until_it_is_closed(bench, name):
    ask, before = bench.dispatcher.ask, bench.store.state
    ask(OpenRun(name=name))
    wait(lambda: bench.store.state.replay is not None, "the run")
    seen = displayed_state(bench.store.state)
    assert (seen.model.name, seen.recording.run.setup) == (
        "xMate3" if name == "3.rcirun" else MODEL.name,
        some_run().setup,
    )
    assert seen.last_run is seen.recording, "exports are of the opened run"
    if name == "2.rcirun":
        at = seen.playhead * seen.plan.motion.duration
        assert at == pytest.approx(seen.recording.moment - 1e-3 * seen.recording.delay), "it opens at its fault"
    ask(Seek(playhead=0.25))
    wait(lambda: bench.store.state.playhead == 0.25, "another place")
    ask(MoveJoint(joint=0, angle=0.3))
    wait(lambda: told(bench) == "ready.replay", "what to do first")
    ask(RobotCommand(what="execute"))
    ask(Play(playing=False))
    wait(lambda: not bench.store.state.playing, "all of them")
    status = bench.session.status()
    assert status.phase == "idle", "the robot stays connected"
    assert obstacle(bench.store.state, status).code == "ready.replay"
    assert np.array_equal(bench.store.state.goal.q, before.goal.q)
    ask(CloseRun())
    wait(lambda: bench.store.state.replay is None, "the robot")
    assert displayed_state(bench.store.state).model is before.model
    assert bench.store.state.plan is before.plan
    assert obstacle(bench.store.state, status).code != "ready.replay"


def test_a_run_that_is_not_in_the_list_is_not_opened_and_a_motion_closes_one(bench):
    ask = bench.dispatcher.ask
    ask(OpenRun(name="../0.rcirun"))
    ask(OpenRun(name="0.rcirun"))
    wait(lambda: bench.store.state.replay is not None, "the run")
    assert bench.store.state.replay.recording.file.endswith("/0.rcirun")
    bench.session.robot().start_guiding("joint", "free")
    wait(lambda: bench.store.state.replay is None, "the robot, which moves")
    assert told(bench) == "replay.moving"
    bench.session.robot().stop_guiding()
    wait(lambda: bench.session.status().phase == "idle", "the end")
