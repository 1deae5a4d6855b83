"""A recorded run on the page: plan and recording, as after the run, without a connection."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rcilab.app.cell.cell_state import CellState
from rcilab.app.goal.goal import goal_at
from rcilab.app.learn.learn_state import LearnState
from rcilab.app.planning import build_plan_view
from rcilab.app.program.program_draft import ProgramState
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.scene.scene_extras import SceneState
from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import UsageError
from rcilab.makers.configuration import RobotConfiguration
from rcilab.recording.client_report import check_client
from rcilab.recording.run import load_run
from rcilab.recording.sent_motion import with_soft_limits

if TYPE_CHECKING:
    from rcilab.app.run.recording import Recording
    from rcilab.app.store import UiState
    from rcilab.core.arrays import JointVector
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run import Run


@dataclass(frozen=True, eq=False, kw_only=True)
class Replay:
    """A recorded run that the page shows in place of its robot."""

    shown: UiState
    """The state of a page that shows only this run."""

    @property
    def recording(self) -> Recording:
        """The run."""
        assert self.shown.recording is not None
        return self.shown.recording

    def over(self, state: UiState) -> UiState:
        """Returns a state with the run in place of what the page plans; views and settings are those of the page."""
        shown = self.shown
        return replace(
            state, model=shown.model, setup=shown.setup, cell=shown.cell, goal=shown.goal, recording=shown.recording,
            last_run=shown.last_run, plan=shown.plan, program=shown.program, scene=shown.scene, learn=shown.learn,
            plot_joint=min(state.plot_joint, shown.model.n),
        )  # fmt: skip


def open_replay(file: Path, settings: UiState) -> Replay:
    """Returns a run of a file for the page; its check takes seconds for a long one.

    Args:
        file: The run.
        settings: A state, for the settings of the page.

    Raises:
        InvalidValueError: The file cannot be read.
        UsageError: It cannot be replayed.
    """
    run = load_run(file)
    model = require_replayable(run)
    empty = replace(
        settings, model=model, goal=goal_at(model, model.home), program=ProgramState(), scene=SceneState(),
        learn=LearnState(), plan=None,
    )  # fmt: skip
    return Replay(shown=replayed(empty, run, str(file)))


def require_replayable(run: Run) -> RobotModel:
    """Returns the arm of a run.

    Raises:
        UsageError: The run has no cycle, or its arm is unknown.
    """
    if run.model is None:
        raise UsageError("this run cannot be replayed: its file does not say which arm made it").coded("run_no_arm")
    if not len(run.cycles):
        raise UsageError("this run cannot be replayed: not one cycle was recorded").coded("run_no_cycle")
    return run.model


def replayed(state: UiState, run: Run, file: str = "") -> UiState:
    """Returns a state that shows a run; `file`: that of the run, "" without one."""
    model = with_soft_limits(require_replayable(run), run)
    if run.has_playout:
        report = check_client(run)
        motion = report.motion
    else:
        motion = run.plan or run.commanded()  # A callback has no plan: its commands are drawn and checked.
        report = run.report or check(motion, model)
    plan = replace(build_plan_view(model, motion, report), complete=True, is_recorded=run.has_playout)
    goal = goal_at(model, motion.goal)
    wanted = state.setup.wanted.updated(RobotConfiguration(tool=model.T_flange_tool, load=model.load))
    setup = replace(state.setup, wanted=wanted, touched=frozenset({"tool", "load"}))
    recording = whole_recording(run, file)
    shown = replace(
        state, model=model, setup=setup, cell=CellState(cell=run.cell), goal=goal, recording=recording,
        last_run=recording, playhead=0.0,
    )  # fmt: skip
    return replace(shown, plan=replace(plan, cell=shown.cell_for(model)))


def replayed_pose(state: UiState) -> JointVector | None:
    """Returns the recorded position of the arm at the place of the timeline; None without a finished run."""
    recording = state.recording
    if recording is None or recording.run is None or state.plan is None:
        return None
    t = state.playhead * state.plan.motion.duration + recording.delay * CYCLE_TIME
    row = min(int(np.searchsorted(recording.t, t)), len(recording.t) - 1)
    return recording.q[row]
