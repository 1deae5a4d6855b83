"""The time of each place of the plan: a motion may have run at another speed override than planned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.clock import CYCLE_TIME

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.core.arrays import Array, JointPath
    from rcilab.motion.speed_scaling import SpeedScaledMotion


def scaled_motion_of(state: UiState) -> SpeedScaledMotion | None:
    """Returns how the plan on the page was or is run; None: as planned, or not at all."""
    scaled_motion = None if state.recording is None else state.recording.scaled_motion
    return (
        scaled_motion
        if scaled_motion is not None and state.plan is not None and scaled_motion.motion is state.plan.motion
        else None
    )


def streamed_rows(state: UiState) -> JointPath | None:
    """Returns the streamed rows of the plan on the page, shape (N, n), [rad], if its speed was changed; else None."""
    scaled_motion, run = scaled_motion_of(state), None if state.recording is None else state.recording.run
    if scaled_motion is not None:
        return scaled_motion.q
    is_it = run is not None and run.has_speed_override and state.plan is not None and run.plan is state.plan.motion
    return state.plan.motion.q if is_it and state.plan is not None else None  # Read from a file.


def played_path(state: UiState) -> tuple[Array, JointPath] | None:
    """Returns the rows of the plan, shape (N, n), [rad], and their times in the run, shape (N,), [s]; or None."""
    scaled_motion = scaled_motion_of(state)
    if scaled_motion is not None:
        return np.linspace(0.0, scaled_motion.duration, len(scaled_motion.q)), scaled_motion.q
    return None if state.plan is None else (state.plan.motion.times, state.plan.motion.q)


def played_at(state: UiState, moment: float) -> float:
    """Returns the time in the run of a time of the plan, [s] since the first command."""
    scaled_motion = scaled_motion_of(state)
    return moment if scaled_motion is None else scaled_motion.time_at(moment)


def moment_played(state: UiState, t: float) -> float:
    """Returns the time of the plan of a time in the run, [s]."""
    scaled_motion = scaled_motion_of(state)
    return t if scaled_motion is None else scaled_motion.plan_time_at(round(t / CYCLE_TIME))
