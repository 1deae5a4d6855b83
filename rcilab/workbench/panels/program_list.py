"""The waypoints as a list: HTML that rows.js makes selectable by mouse and keyboard."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from rcilab.app.program.program_draft import Draft, Note, describe_step, target_in_base
from rcilab.app.program.waypoint_fields import arm_angle_of
from rcilab.app.text import Text
from rcilab.core.errors import RcilabError
from rcilab.i18n.error_messages import describe_note
from rcilab.motion.waypoint import Waypoint
from rcilab.workbench.widgets import esc

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.model.robot_model import RobotModel

LONGEST_WINDOW = 120
"""Rows that the page gets of a longer program; tuning value: some screens of them, so that scrolling seldom waits."""
_MARGIN = 30  # Rows around the wanted one that are there, too.
_LISTED_NOTES = 100  # Further ones are at their rows.
_NOTED = "*"
_HEADS = ("number", "type", "place", "speed", "blend", "psi", "dwell")


def window_around(window: range, count: int, wanted: int | None) -> range:
    """Returns the rows that the page gets: those of before, as long as the wanted one is well inside.

    Args:
        window: Rows that the page has, from 0.
        count: Number of steps.
        wanted: The row to see, from 0; None: any.
    """
    size = min(count, LONGEST_WINDOW)
    first = min(window.start, count - size)
    if wanted is not None and not first + _MARGIN <= wanted < first + size - _MARGIN:
        first = min(max(wanted - size // 2, 0), count - size)
    return range(first, first + size)


def list_html(state: UiState, draft: Draft, running: int | None, text: Text, window: range | None = None) -> str:
    """Returns the list.

    Args:
        state: State of the page.
        draft: The program, placed in base.
        running: Number of the waypoint that the preview moves to, 0 during the approach to the start.
        text: The catalogue.
        window: The steps to list, from 0; None: all. The others are an empty room of their height.
    """
    if not draft.steps or draft.start is None:
        return f'<div class="rl-steps-none"><b>{esc(text("program.none"))}</b>{esc(text("program.none_long"))}</div>'
    arm = draft.arm(state.model)
    heads = "".join(
        f'<span title="{esc(text(f"program.head.{name}_long"))}">{_head(text(f"program.head.{name}"))}</span>'
        for name in _HEADS
    )
    notes = state.program.notes
    noted = {note.key: sentence for note, sentence in zip(notes, _sentences(notes, text), strict=True)}
    count = len(draft.steps)
    window = range(count) if window is None else window
    rows, depths = [_start_row(draft, arm, running == 0, text), _room(window.start)], draft.depths
    for number in range(window.start + 1, window.stop + 1):
        step = draft.steps[number - 1]
        chosen, failed = step.key == state.program.selected, step.key == state.program.failed
        marked = step.key in state.program.marked
        look = (
            (" rl-marked" if marked else "")
            + (" rl-failed" if failed else "")
            + (" rl-running" if number == running else "")
        )
        sign = f'<em title="{esc(text("program.failed"))}">!</em>' if failed else ""
        if step.waypoint.frame is not None:
            sign = f'<em title="{esc(text("program.frame_missing", frame=step.waypoint.frame))}">!</em>'
        if step.key in noted:
            sign += f'<i title="{noted[step.key]}">{_NOTED}</i>'
        cells = (f"{number}{sign}", *_cells(step.waypoint, arm, text, depths[number - 1]))
        look += " rl-instruction" if step.waypoint.is_instruction else ""
        rows.append(
            f'<div class="rl-step{look}" role="option" id="rl-step-{step.key}" data-key="{step.key}" '
            f'data-index="{number - 1}" aria-selected="{"true" if chosen or marked else "false"}" draggable="true" '
            f'aria-posinset="{number}" aria-setsize="{count}">'
            + "".join(f"<span>{cell}</span>" for cell in cells)
            + "</div>"
        )
    rows.append(_room(count - window.stop))
    return (
        f'<div class="rl-steps-head" aria-hidden="true">{heads}</div>'
        '<div class="rl-steps" role="listbox" aria-multiselectable="true" tabindex="0" '
        f'aria-label="{esc(text("program.list"))}" aria-activedescendant="rl-step-{state.program.selected}" '
        f'data-first="{draft.steps[0].key}" data-last="{draft.steps[-1].key}" '
        f'data-selected="{state.program.selected or 0}">'
        + "".join(rows)
        + f'</div><p class="rl-note rl-keys">{esc(text("program.keys"))}</p>'
    )


def notes_html(notes: tuple[Note, ...], text: Text) -> str:
    """Returns the planner's remarks as one line that can be opened; "" without any."""
    if not notes:
        return ""
    if len(notes) == 1:
        return f'<p class="rl-note">{_NOTED} {_sentences(notes, text)[0]}</p>'
    codes = {note.code for note in notes}
    code = "program.shortened" if codes == {"blend"} else "program.noted"
    listed = "".join(f"<li>{sentence}</li>" for sentence in _sentences(notes, text)[:_LISTED_NOTES])
    listed += "<li>…</li>" if len(notes) > _LISTED_NOTES else ""
    return (
        f'<details class="rl-noted"><summary>{_NOTED} {esc(text(code, count=len(notes)))}</summary>'
        f"<ul>{listed}</ul></details>"
    )


@lru_cache(maxsize=4)
def _sentences(notes: tuple[Note, ...], text: Text) -> tuple[str, ...]:
    """Returns remarks as HTML, cached: a program may have a thousand, and its rows are redrawn at every step."""
    return tuple(esc(text.render(describe_note(note.remark))) for note in notes)


def _room(count: int) -> str:
    """Returns the room of rows that are not there."""
    return f'<div class="rl-steps-room" role="presentation" style="--rows:{count}"></div>' if count else ""


def _start_row(draft: Draft, arm: RobotModel, running: bool, text: Text) -> str:
    assert draft.start is not None
    look, name = " rl-running" if running else "", esc(text("program.start"))
    position = _lengths(tuple(arm.forward(draft.start).position.tolist()), text)
    return (
        f'<div class="rl-step rl-start{look}" role="presentation"><span>0</span><span>{name}</span>'
        f"<span>{position}</span></div>"
    )


def _head(label: str) -> str:
    """Returns the label of a column as HTML; x, y and z stand above their numbers."""
    parts = label.split(" ", 2)
    return "".join(f"<b>{esc(part)}</b>" for part in parts) if len(parts) == 3 else esc(label)


def _cells(waypoint: Waypoint, arm: RobotModel, text: Text, depth: int) -> tuple[str, ...]:
    inset = f' style="margin-left:{0.6 * depth:.1f}em"' if depth else ""
    kind = f'<i class="rl-kind rl-kind-{waypoint.type}"{inset}>{esc(text(f"program.type.{waypoint.type}"))}</i>'
    if waypoint.is_instruction:
        said = text.render(describe_step(waypoint))
        return kind, f'<span title="{esc(said)}">{esc(said)}</span>'
    psi = arm_angle_of(waypoint, arm)
    return (
        kind,
        _where(waypoint, arm, text),
        f"{100.0 * waypoint.speed:.3g}",
        "–" if waypoint.blend == 0.0 else text.units.format(waypoint.blend, "m.3g#"),
        "–" if psi is None else text.units.format_angle(psi, 0).removesuffix(" rad"),
        "–" if waypoint.dwell == 0.0 else f"{waypoint.dwell:.3g}",
    )


def _where(waypoint: Waypoint, arm: RobotModel, text: Text) -> str:
    if waypoint.frame is not None:
        return "?"
    try:
        target = target_in_base(waypoint, arm)
    except RcilabError:
        return "?"
    if target is not None:
        return _lengths(tuple(target.position.tolist()), text)
    if waypoint.type == "retreat":
        return text.units.format(-(waypoint.distance or 0.0), "m.0f")
    if waypoint.type == "circle":
        return text.units.format_angle(math.tau if waypoint.angle is None else waypoint.angle, 0)
    return "ψ"


def _lengths(position: tuple[float, ...], text: Text) -> str:
    sentence = (text.units.format(number, "m.0f#") for number in position)
    return " ".join(f"<b>{number}</b>" for number in sentence)
