"""Requests that change the view only. Owned by the dispatcher's thread."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Literal

from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.request import Handlers, Request
from rcilab.app.store import Store
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.translator import message
from rcilab.i18n.units import ANGLES, LENGTHS

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

QUALITIES = ("full", "light")
THEMES = ("light", "dark")
RATES = (0.1, 0.25, 0.5, 1.0, 2.0)
PLOTS = ("q", "dq", "ddq", "jerk", "tau", "speed", "acceleration", "psi", "error", "tool")
"""In the order in which they are shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommitField(Request):
    """Enter was pressed in a field, or the field was left: the typed text is complete."""

    needs_control: ClassVar[bool] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DropProblem(Request):
    """The field of a problem does not show the rejected text any more."""

    needs_control: ClassVar[bool] = False
    field: str
    """As in `TypeField`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawInSoftware(Request):
    """The browser has no graphics card."""

    is_silent: ClassVar[bool] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Seek(Request):
    """Go to a position in the planned motion."""

    playhead: float
    """0 to 1."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return f"Seek.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Play(Request):
    """Start or pause the preview."""

    playing: bool | None = None
    """None toggles it."""
    restart: bool = False
    """Whether it starts from the beginning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SetView(Request):
    """Settings of the page."""

    name: Literal["language", "angle", "length", "theme", "quality", "plot_joint", "rate", "height", "loop"]
    value: str | float | int


@dataclass(frozen=True, slots=True, kw_only=True)
class ShowPlot(Request):
    """Show or hide one of the plots."""

    name: str
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SetRecording(Request):
    """Whether every cycle of a motion is written to a file."""

    on: bool


class ViewActions:
    """Timeline and settings."""

    def __init__(self, store: Store) -> None:
        self._store = store

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            CommitField: self.enter,
            DropProblem: lambda request: self._store.clear_problems(request.field),
            DrawInSoftware: self.draw_in_software,
            Seek: self.seek,
            Play: self.play,
            SetView: self.set_view,
            ShowPlot: self.show_plot,
            SetRecording: self.set_recording,
        }

    def seek(self, request: Seek) -> None:
        """Moves the preview to a position of the plan and pauses it."""
        if math.isfinite(request.playhead):
            self._store.update(playhead=min(max(request.playhead, 0.0), 1.0), playing=False)

    def play(self, request: Play) -> None:
        """Starts the preview, from the beginning if it is at the end, or pauses it."""
        state = displayed_state(self._store.state)
        playing = not state.playing if request.playing is None else request.playing
        if state.plan is None:
            self._store.notify("warn", message("ready.no_plan"))
        elif playing:
            playhead = 0.0 if request.restart or state.playhead >= 1.0 else state.playhead
            self._store.update(playing=True, playhead=playhead)
        else:
            self._store.update(playing=False)

    def advance(self, elapsed: float) -> None:
        """Advances a playing preview by `elapsed`, [s]."""
        state = displayed_state(self._store.state)
        if not state.playing or state.plan is None:
            return
        playhead = state.playhead + elapsed * state.rate / max(state.plan.motion.duration, 1e-3)
        if state.loop and playhead >= 1.0:
            playhead = 0.0
        self._store.update(playhead=min(playhead, 1.0), playing=playhead < 1.0)

    def enter(self, request: CommitField) -> None:
        """Takes the typed text of a page at once."""
        entered = {**self._store.state.entered, request.page: time.monotonic()}
        self._store.update(entered=MappingProxyType(entered))

    def set_view(self, request: SetView) -> None:
        """Changes a setting; invalid values are ignored."""
        value = request.value
        known = {
            "language": value in LANGUAGES,
            "quality": value in QUALITIES,
            "theme": value in THEMES,
            "rate": value in RATES,
            "height": isinstance(value, float),
            "loop": isinstance(value, bool),
            "plot_joint": isinstance(value, int) and 0 <= value <= self._store.state.model.n,
        }
        if request.name == "angle" and value in ANGLES:
            self._store.update(units=replace(self._store.state.units, angle=value))
        elif request.name == "length" and value in LENGTHS:
            self._store.update(units=replace(self._store.state.units, length=value))
        elif known.get(request.name, False):
            self._store.update(**{request.name: value})
            if request.name == "quality":
                self._store.update(is_quality_chosen=True)

    def draw_in_software(self, request: DrawInSoftware) -> None:
        """Chooses light graphics for a browser without a graphics card, unless the operator chose otherwise."""
        if not self._store.state.is_quality_chosen:
            self._store.update(quality="light")

    def show_plot(self, request: ShowPlot) -> None:
        """Shows or hides a plot."""
        plots = self._store.state.plots
        if request.name in PLOTS:
            self._store.update(plots=plots | {request.name} if request.on else plots - {request.name})

    def set_recording(self, request: SetRecording) -> None:
        """Turns recording of the next motions to files on or off."""
        self._store.update(record=request.on)


def has_plot(model: RobotModel, name: str) -> bool:
    """Returns whether an arm has a quantity to plot: only an arm with redundancy has an arm angle."""
    return name != "psi" or bool(model.redundancy)
