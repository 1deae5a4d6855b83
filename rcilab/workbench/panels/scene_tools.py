"""What the page's scripts need for the tools of the scene: texts in the page's language, names and units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.text import Text

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_TOOLS = ("measure", "picture", "film", "spacemouse")
"""In the order of the toolbar."""
_DIGITS = {"mm": 1, "m": 4, "°": 1, "rad": 3}
"""Decimals of a measured value, by unit."""


def scene_tools(state: UiState, status: SupervisorStatus, text: Text) -> dict[str, Any]:
    """Returns the values of measuring, picture, film and SpaceMouse, for `LiveChannel.publish`."""
    return {
        "tools": [{"name": tool, "label": text(f"tool.{tool}")} for tool in _TOOLS],
        "measure": _measure(state, text),
        "film": {name: text(f"film.{name}") for name in ("recording", "cancel", "none")},
        "spacemouse": {name: text(f"spacemouse.{name}") for name in ("ready", "closed")},
        "preview": None
        if state.plan is None or is_moving(status)
        else {"share": round(state.playhead, 3), "playing": state.playing},
    }


def _measure(state: UiState, text: Text) -> dict[str, Any]:
    cell = state.cell.cell
    return {
        **{name: text(f"measure.{name}") for name in ("first", "second", "base", "tool", "floor")},
        "link": text("measure.link", number="#"),  # The script puts in the number.
        "angle": text("measure.angle", angle="#"),
        "obstacles": [] if cell is None else [obstacle.name for obstacle in cell.obstacles],
        "length": _unit(text, "m"),
        "angles": _unit(text, "rad"),
    }


def _unit(text: Text, unit: str) -> dict[str, Any]:
    factor, name = text.units.from_si(unit)
    return {"factor": factor, "unit": name if name == "°" else f" {name}", "digits": _DIGITS[name]}
