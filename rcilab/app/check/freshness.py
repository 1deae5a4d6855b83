"""Whether a new plan would equal the current one, and if not, what has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.app.planning import moved_frames
from rcilab.app.setup.configuration_state import name_parts
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.app.store import UiState


def beside_program(state: UiState) -> Message | None:
    """Returns the notice that the plan is not that of the program, which could not be planned; None if it is."""
    plan, program = state.plan, state.program
    fails = program.planned is None and program.tone == "bad" and program.answer is not None
    if plan is None or plan.program is not None or not fails:
        return None
    return message("plan.not_program")


def outdated(state: UiState) -> Message | None:
    """Returns why the plan is out of date, or None: program, frames, tool, load, limits, safety box or cell changed."""
    plan, program = state.plan, state.program
    if plan is None or (state.watched and plan.is_recorded):  # What a client commanded stays what it is.
        return None
    stale = plan.stale_parts(state.model, state.setup.wanted.box)
    if not stale and plan.complete and not plan.is_recorded and plan.cell is not state.cell_for(plan.model):
        stale = ("cell",)
    if plan.program is not None and program.planned is not program.draft:
        if program.planned is None and program.tone == "bad" and program.answer is not None:
            return message("ready.program_fails")
        if program.planned is not None or not stale:  # Without a plan of its own it may be the program of this plan.
            return message("ready.program")
    if plan.program is not None and not program.draft.is_for(state.model):
        return message("ready.program_tool")
    moved = moved_frames(plan, state.cell.cell)
    if moved:
        return message("ready.frames", names=", ".join(moved))
    return message("ready.stale", what=name_parts(stale)) if stale else None
