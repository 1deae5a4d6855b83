"""Controls of panels: they send requests, and follow the state without disturbing the operator's input."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from rcilab.app.control_lock import ControlLock
from rcilab.app.request import Request, TypeField
from rcilab.app.text import Text
from rcilab.app.view_actions import DropProblem
from rcilab.core.spatial import Pose
from rcilab.i18n.rounding import format_fixed
from rcilab.i18n.translator import Message
from rcilab.i18n.units import Unit

Ask: TypeAlias = Callable[[Request], None]

FAINT = 0.45
"""Opacity of handles unless they are pointed at: the arm behind them stays visible."""
HAND_AWAY = 0.6  # [s] A control that was used within this time is not written to.
_TYPING_PAUSE = 0.7  # [s] A typed number is taken after this time without a key.
_ANSWER = 0.2  # [s] After this time the state contains the result of a typed number.
_STANDS = 3.0  # [s] For this time an accepted number stays as typed, in order not to disturb the operator.
_ENTERED = 0.5  # [s] The same for a number that was entered.
_NOBODY: Mapping[int | None, float] = MappingProxyType({})


def on_press(button: Any, ask: Ask, make: Callable[[int | None], Request]) -> None:
    """Sends a request when a button is pressed.

    Callbacks are async on purpose: viser then runs them on its event loop, in the order of the events. They only put a
    value into a queue.
    """

    @button.on_click
    async def _(event: Any) -> None:
        ask(make(event.client_id))


def why_html(text: Text, why: Message | None) -> str:
    """Returns why a control is disabled; empty for None."""
    return "" if why is None else f'<p class="rl-note rl-why">{esc(text.render(why))}</p>'


class BoundControl:
    """A slider, dropdown or checkbox that sends requests and otherwise follows the state.

    Args:
        handle: The viser control.
        ask: Takes requests.
        make: Creates the request from the control's value and the page's client id.
    """

    def __init__(self, handle: Any, ask: Ask, make: Callable[[Any, int | None], Request | None]) -> None:
        self.handle = handle
        self._touched, self._seen = float("-inf"), handle.value

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client_id is None:  # Set by this process.
                return
            self._touched = time.monotonic()
            request = make(event.target.value, event.client_id)
            if request is not None:
                ask(request)

    def show(self, value: Any) -> None:
        """Writes the state's value, unless the control is in use."""
        before, self._seen = self._seen, self.handle.value
        if value != self._seen == before and time.monotonic() - self._touched > HAND_AWAY:
            self.handle.value = self._seen = value  # An unknown value is the operator's, whose request is on its way.

    def exchange(self, options: tuple[str, ...], value: str) -> None:
        """Gives a dropdown other options with one of them as value; viser alone would show the first one meanwhile."""
        self.handle.options = options
        self.handle.value = self._seen = value


class NumberField:
    """A text box for a number: sent once it is entered or the typing has paused.

    Args:
        handle: From `gui.add_text`.
        ask: Takes requests.
        field: Name of the field in `TypeField`. It may be replaced; text typed before is sent at once.
        unit: Unit in which the number is shown and typed, from `Text.unit`; None for a number with one unit only.
    """

    def __init__(self, handle: Any, ask: Ask, field: str, unit: Unit | None = None) -> None:
        self._handle, self._ask, self.field = handle, ask, field
        self._unit = unit or Unit("", 1.0)
        self._typed: tuple[float, str, int | None, str] | None = None
        self._committed, self._stands_for = float("-inf"), _STANDS
        self._answer: str | None = None  # The state's number for it.
        self._is_typed = False  # Whether the text is as it was typed.
        self._shown: str | None = None  # The field that it was last shown for.
        self._problem: Message | None = None
        self._beside: str | None = None  # The state's number when the problem came; None: it came elsewhere.

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client_id is not None:
                self._typed = (time.monotonic(), event.target.value, event.client_id, self.field)

    def disable(self, is_off: bool) -> None:
        """Disables or enables it."""
        self._handle.disabled = is_off

    def show(self, text: str, problem: Message | None, entered: Mapping[int | None, float] = _NOBODY) -> None:
        """Sends the typed text, or writes the state's number; called at the display's rate.

        Args:
            text: The state's number as text, in degrees or millimetres if it has a unit of the page.
            problem: The problem of the typed number; the text then stays, until the state's number changes.
            entered: When a page last reported that its text is complete, `UiState.entered`.
        """
        typed = self._typed
        if typed is not None:
            is_shown, is_entered = typed[3] == self.field, entered.get(typed[2], float("-inf")) >= typed[0]
            if is_shown and not is_entered and time.monotonic() - typed[0] < _TYPING_PAUSE:
                return
            self._stands_for = _ENTERED if is_entered else _STANDS
            self._committed = time.monotonic() if is_shown else float("-inf")
            self._typed, self._answer = None, None
            if is_shown:
                self._is_typed, self._shown = True, self.field
            self._ask(TypeField(page=typed[2], field=typed[3], text=self._unit.complete(typed[1])))
            return
        sentence = self._unit.convert(text)
        if problem is not None and not self._is_about(problem, sentence):
            self._ask(DropProblem(field=self.field))
        elif self._is_typed and (problem is not None or self._stands(sentence)):
            return
        self._is_typed, self._shown = False, self.field
        if problem is None:
            self._problem = None
        if self._handle.value != sentence:
            self._handle.value = sentence

    def _is_about(self, problem: Message, sentence: str) -> bool:
        """Returns whether a problem came while the field showed this number, or the text typed in its place."""
        if problem != self._problem:
            self._problem, self._beside = problem, sentence if self._shown == self.field else None
        return self._shown == self.field and sentence == self._beside

    def _stands(self, sentence: str) -> bool:
        """Returns whether the typed text stays: its answer is on its way, or has not changed since."""
        past = time.monotonic() - self._committed
        if past < _ANSWER:
            return True
        if self._answer is None:
            self._answer = sentence
        return past < self._stands_for and sentence == self._answer


class PageText:
    """A text box whose text belongs to the page that typed it, as long as that page has the controls.

    Args:
        handle: From `gui.add_text`.
    """

    def __init__(self, handle: Any) -> None:
        self.handle = handle
        self._page: int | None = None

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client_id is not None:
                self._page = event.client_id

    def of(self, page: int | None) -> str:
        """Returns the text of this page, or the one set by this process; "" if another page typed it."""
        return self.handle.value if page is None or self._page in (None, page) else ""

    def show(self, lock: ControlLock, text: str) -> bool:
        """Replaces the text of a page without the controls by the state's own; returns whether it did."""
        is_over = self._page is not None and lock.holder not in (None, self._page)
        if is_over:
            self._page, self.handle.value = None, text
        return is_over


class Html:
    """A piece of HTML that is sent only when it changes."""

    def __init__(self, gui: Any) -> None:
        self._handle = gui.add_html("")
        self._shown = ""

    def show(self, content: str) -> None:
        """Shows this HTML."""
        if content != self._shown:
            self._shown = content
            self._handle.content = content


def esc(text: object) -> str:
    """Returns text escaped for HTML."""
    return html.escape(str(text))


def esc_names(text: object) -> str:
    """Returns `text` for HTML; the long names of faults in it may break after each underscore."""
    return esc(text).replace("_", "_<wbr>")


def shown(number: float) -> str:
    """Returns a number for a field: two decimals, and never "-0.00"."""
    return format_fixed(float(number), 2)


def shown_pose(pose: Pose) -> tuple[str, ...]:
    """Returns x, y, z [mm] and roll, pitch, yaw [deg] for fields; a half turn is 180, regardless of rounding."""
    turns = [shown(degrees) for degrees in np.degrees(pose.rpy)]
    return (*(shown(1000.0 * place) for place in pose.position), *("180.00" if t == "-180.00" else t for t in turns))
