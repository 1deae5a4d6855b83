"""The status line of the bar, which is always visible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.control_lock import PATIENCE, ControlLock
from rcilab.app.run.drive_state import destination
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.played_motion import played_at
from rcilab.app.run.readiness import time_shown
from rcilab.app.scene.scene_extras import extras_of
from rcilab.app.status_text import describe_status, phase_code
from rcilab.app.text import Text
from rcilab.core.fault import name_faults
from rcilab.views.viser_stage import VIEWS
from rcilab.workbench.panels.scene_legends import scene_legends
from rcilab.workbench.panels.scene_tools import scene_tools

if TYPE_CHECKING:
    from rcilab.app.link.page_link import LinkQuestion
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_TONES = {
    "idle": "good",
    "moving": "good",
    "moving.held": "warn",
    "starting": "warn",
    "connecting": "warn",
    "stopping": "warn",
    "closed": "warn",
    "fault.released": "warn",
    "lost.rebooted": "warn",
}

_KEYS = (
    "stop", "home", "joint", "joint_back", "held", "pad", "sticks", "cross", "space", "cap", "undo", "palette",
    "help",
)  # fmt: skip
"""Keys, and buttons of a gamepad and a SpaceMouse, in the order of their list."""


def status_values(
    state: UiState, status: SupervisorStatus, text: Text, cursor_end: float, live: UiState | None = None
) -> dict[str, Any]:
    """Returns the contents of the page's bar, for `LiveChannel.publish`.

    Args:
        state: What scene and timeline show.
        status: That of the robot.
        text: The catalogue.
        cursor_end: End of the plots' time axis, [s].
        live: The robot's state, if they show something else.
    """
    values: dict[str, Any] = {
        "language": state.language,
        "stop": text("stop.label"),
        "stopHint": text("watch.stop" if state.watched else "stop.note"),
        "home": text("bar.home"),
        "homeHint": text("bar.home_hint"),
        "views": [{"view": view, "label": text(f"view.{view}")} for view in VIEWS],
        "extras": [
            {"name": extra, "label": text(f"extra.{extra}"), "on": extra in state.scene.extras}
            for extra in extras_of(state.model)
        ],
        "legends": scene_legends(state, text),
        **scene_tools(state, status, text),
        "keys": [[text(f"key.{key}"), text(f"key.{key}_does")] for key in _KEYS],
        "palette": {name: text(f"palette.{name}") for name in ("title", "find", "none", "tab", "scene")},
        "history": {
            "undo": text("bar.undo"),
            "redo": text("bar.redo"),
            "can": dict(zip(("undo", "redo"), state.turns, strict=True)),
        },
        "lost": text("bar.lost"),
        "quality": state.quality,
        "software": text("bar.software") if state.quality == "full" else "",
        "chips": _chips(live or state, status, text),
        "cursor": _cursor(state, status, cursor_end),
        "theme": state.theme,
        "viser": text("bar.viser"),
        "holder": state.control_lock.holder,
        "take": _take_label(state, text),
        "question": _question(state, text),
    }
    values["notices"] = [
        {"serial": notice.serial, "tone": notice.tone, "text": text.render(notice.text), "page": notice.page}
        for notice in state.notices
    ]
    return values


def _take_label(state: UiState, text: Text) -> str:
    """Returns the label of the button for the controls; "" hides it: to watch alone there is nothing to take."""
    if state.watched and len(state.control_lock.pages) < 2:
        return ""
    return text("control_lock.take" if state.control_lock.holder is None else "control_lock.ask")


def _target_chip(state: UiState, status: SupervisorStatus, text: Text) -> dict[str, Any]:
    """Returns the destination; of an address host and port only, with all of it in the hint."""
    where = destination(state, status)
    if where == "address":
        host = state.target.partition("://")[2].partition("?")[0]
        return _chip(text, "where", host, hint=f"{text('bar.where')}: {state.target}")
    return _chip(text, "where", text("destination.preview" if where == "preview" else f"where.{where}"))


def _chips(state: UiState, status: SupervisorStatus, text: Text) -> list[dict[str, Any]]:
    phase = text(phase_code(status))
    doing = text.render(state.busy) if state.busy is not None else phase
    mode = "—" if status.robot_mode is None else text(f"robot_mode.{status.robot_mode.name}")
    faults = text("bar.none") if not status.faults else name_faults(status.faults)
    connected = status.rate_hz > 0.0
    lock = state.control_lock
    return [  # The last ones are left out where the bar is too short.
        _chip(
            text,
            "phase",
            doing,
            "warn" if status.is_pressed else _TONES.get(status.code, _TONES.get(status.phase, "bad")),
            hint=text.render(describe_status(status)),
        ),
        _chip(text, "faults", faults, "bad" if status.faults else ""),
        _chip(text, "model", state.model.name),
        _target_chip(state, status, text),
        _chip(text, "controls", text("bar.its_client"))
        if state.watched
        else {**_chip(text, "controls", _holder(lock, text)), "of": _seen_by_pages(lock, text)},
        _chip(text, "mode", mode),
        _chip(text, "rate", f"{status.rate_hz:.0f} Hz" if connected else "—"),
        _chip(text, "success", f"{100.0 * status.success_rate:.0f} %" if is_moving(status) else "—"),
    ]


def _holder(lock: ControlLock, text: Text) -> str:
    if lock.holder is None:
        return text("bar.free", pages=len(lock.pages))
    return text("bar.holder", holder=lock.number(lock.holder), pages=len(lock.pages))


def _seen_by_pages(lock: ControlLock, text: Text) -> dict[int, str]:
    """Returns the text about the controls for each page, by client id."""
    if lock.holder is None:
        return {}
    holder, count = lock.number(lock.holder), len(lock.pages)
    if count == 1:
        return {lock.holder: text("bar.alone")}
    return {
        page: text("bar.mine", mine=lock.number(page), pages=count)
        if page == lock.holder
        else text("bar.theirs", holder=holder, mine=lock.number(page))
        for page in lock.pages
    }


def _question(state: UiState, text: Text) -> dict[str, Any] | None:
    """Returns the question to a page, or None; `kind` is that of its answer."""
    lock, link = state.control_lock, state.link
    if lock.asking is None or lock.holder is None:
        return None if link is None else _link_question(link, state, text)
    asked = text("control_lock.question", page=lock.number(lock.asking), seconds=f"{PATIENCE:.0f}")
    yes, no = text("control_lock.yes"), text("control_lock.no")
    return {"page": lock.holder, "text": asked, "yes": yes, "no": no, "kind": "answer"}


def _link_question(question: LinkQuestion, state: UiState, text: Text) -> dict[str, Any]:
    link = question.link
    parts = [text("link.ask", model=link.model)]
    if link.model != state.model.name:
        parts.append(text("link.ask_arm", ours=state.model.name))
    if link.program is not None:
        parts.append(text("link.ask_program", count=len(link.program.waypoints)))
    if link.cell is not None:
        parts.append(text("link.ask_cell", count=len(link.cell.obstacles)))
    return {
        "page": question.page, "text": " ".join(parts), "yes": text("link.yes"), "no": text("link.no"),
        "kind": "answerlink",
    }  # fmt: skip


def _chip(text: Text, name: str, value: str, tone: str = "", *, hint: str = "") -> dict[str, Any]:
    chip: dict[str, Any] = {"id": name, "label": text(f"bar.{name}"), "value": value}
    if tone:
        chip["tone"] = tone
    if hint:
        chip["hint"] = hint
    return chip


def _cursor(state: UiState, status: SupervisorStatus, end: float) -> dict[str, float] | None:
    if state.plan is None or end <= 0.0:
        return None
    shown = state.playhead * state.plan.motion.duration if state.replay is not None else time_shown(state, status)
    t = played_at(state, shown)
    return {"share": round(min(max(t / end, 0.0), 1.0), 4)}
