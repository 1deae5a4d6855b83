"""Tracking errors as table rows and notes, the same on the page and in its exports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.conformance.free_elbow import leaves_elbow_free

if TYPE_CHECKING:
    from rcilab.i18n.translator import Text
    from rcilab.recording.run import Run
    from rcilab.recording.tracking import Tracking

_EXACT = 1e-6  # [rad] Smaller errors are rounding.


def error_rows(run: Run, tracking: Tracking, text: Text) -> list[list[str]]:
    """Returns the rows of the error table: joint or tool, RMS and largest error."""
    units = text.units
    pairs = zip(tracking.joint_rms, tracking.joint_max, strict=True)
    rows = [[f"J{j}", *(units.format_angle(value, 4) for value in pair)] for j, pair in enumerate(pairs, start=1)]
    if run.model is not None:
        away = [units.format_length(value, 3) for value in (tracking.position_rms, tracking.position_max)]
        turn = [units.format_angle(value, 4) for value in (tracking.rotation_rms, tracking.rotation_max)]
        rows += [[text("tracking.tool"), *away], [text("tracking.turn"), *turn]]
    return rows


def tracking_notes(run: Run, tracking: Tracking, text: Text) -> list[str]:
    """Returns the notes to the error table: what is compared, until when, and why the errors may be zero."""
    notes = []
    if run.plan is not None and run.model is not None and leaves_elbow_free(run.model, run.setup.mode):
        notes.append(text("tracking.followed"))
    if run.plan is not None and run.stop_time is not None:
        notes.append(text("tracking.until", time=f"{run.stop_time:.3f}"))
    if run.has_speed_override:
        notes.append(text("tracking.speed_override"))
    if run.setup.plant == "ideal" and tracking.joint_max.max(initial=0.0) < _EXACT:
        notes.append(text("tracking.ideal"))
    return notes
