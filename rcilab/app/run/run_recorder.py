"""Records the last motion: for the plots during the motion, as a run once the arm stands still."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rcilab.app.run.recording import Recording
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import message
from rcilab.recording.live_recording import LiveRecording, RunFacts
from rcilab.recording.run import Run
from rcilab.recording.run_file import ENDING, RunFile
from rcilab.recording.run_setup import Setup

if TYPE_CHECKING:
    from rcilab.app.app_state import AppState
    from rcilab.app.planning import Plan
    from rcilab.app.state_store import StateStore
    from rcilab.motion.speed_scaling import SpeedScaledMotion


class RunRecorder:
    """Owned by the thread that changes the state.

    Args:
        store: Shows the recording.
    """

    def __init__(self, store: StateStore[AppState]) -> None:
        self._store = store
        self._live: LiveRecording | None = None
        self._file = ""

    def begin(self, plan: Plan) -> None:
        """Starts a recording; with "record every cycle" also in a file."""
        state = self._store.state
        plant = state.plant if state.target == "virtual" else ""
        setup = Setup(target=state.target, plant=plant, mode=state.drive.mode, started_ns=time.time_ns())
        facts = RunFacts(plan=plan.motion, model=state.model, setup=setup, cell=plan.cell)
        self._live = LiveRecording(facts, self._open(state, plan, setup))

    def add(self, rows: NDArray[np.void], scaled_motion: SpeedScaledMotion | None = None) -> None:
        """Adds cycles and shows them; `scaled_motion`: how the plan is run, if its speed override was changed."""
        if self._live is None:
            return
        before = self._live.cycles
        try:
            self._live.add(rows)
        except InvalidValueError as error:
            self._complain(error)
        cycles = self._live.cycles
        if cycles is not None and (before is None or len(cycles) > len(before)):
            self._store.update(recording=as_recording(cycles, self._live.delay, scaled_motion))

    def finish(
        self,
        stopped: str | None,
        scaled_motion: SpeedScaledMotion | None = None,
        *,
        is_operator_absent: bool = False,
        finding: str = "",
        run: Run | None = None,
    ) -> None:
        """Ends the recording; from then on it can be exported.

        Args:
            stopped: Why the motion did not reach its end; None: it did.
            scaled_motion: How the plan was run, if its speed override was changed.
            is_operator_absent: Whether the motion was stopped because no page answered.
            finding: Joint, value and bound of the fault that ended it, from its last cycles.
            run: The run as recorded by the robot itself; None: it is built from the added cycles.
        """
        if self._live is None:
            return
        live, self._live = self._live, None
        plan = None if scaled_motion is None else scaled_motion.as_motion()
        try:
            run = run or live.finish(stopped, plan)
        except InvalidValueError as error:
            self._complain(error)
            run = live.finish(stopped, plan)  # If its file failed, the run in memory is complete.
        if run is not None:
            recording = whole_recording(run, self._file, scaled_motion, finding)
            recording = replace(recording, is_operator_absent=is_operator_absent)
            self._store.update(recording=recording, last_run=recording)

    def _open(self, state: AppState, plan: Plan, setup: Setup) -> RunFile | None:
        self._file = ""
        if state.runs is None or not state.record:
            return None
        stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime(setup.started_ns * 1e-9))
        path = state.runs / f"{stamp}-{setup.started_ns // 1_000_000 % 1000:03d}-{state.model.name}{ENDING}"
        try:
            file = RunFile(
                path,
                cycle_dtype(state.model.n),
                plan=plan.motion,
                model=state.model,
                setup=setup,
                report=plan.report,
                cell=plan.cell,
            )
        except InvalidValueError as error:
            self._complain(error)
            return None
        self._file = str(path)
        return file

    def _complain(self, error: InvalidValueError) -> None:
        self._file = ""
        self._store.notify(
            "warn",
            message(
                "record.unwritable",
                file=str(error.value),
                why=describe_error(error) if error.code else error.requirement,
            ),
        )


def as_recording(cycles: NDArray[np.void], delay: int, scaled_motion: SpeedScaledMotion | None = None) -> Recording:
    """Returns the part of a run in progress that the plots need."""
    return Recording(
        t=cycles["t"],
        q=cycles["q"],
        q_c=cycles["q_c"],
        dq=cycles["dq"],
        tau=cycles["tau"],
        delay=delay,
        scaled_motion=scaled_motion,
    )


def whole_recording(
    run: Run, file: str = "", scaled_motion: SpeedScaledMotion | None = None, finding: str = ""
) -> Recording:
    """Returns a finished run for plots, table and export."""
    faulty = np.flatnonzero(run.cycles["faults"])
    return Recording(
        t=run.t,
        q=run.q,
        q_c=run.q_c,
        dq=run.dq,
        tau=run.tau,
        delay=run.delay,
        mode=run.setup.mode,
        run=run,
        scaled_motion=scaled_motion,
        tracking=run.tracking,
        file=file,
        finding=finding,
        moment=float(run.t[faulty[0]]) if len(faulty) else None,
    )
