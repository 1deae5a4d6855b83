"""What panels are made of: controls that ask, and show the state without fighting the hand that moves them."""

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

HAND_AWAY = 0.6  # [s] A control touched less long ago is not written to.
_TYPING_PAUSE = 0.7  # [s] A typed number counts when no key came for so long.
_ANSWER = 0.2  # [s] What a typed number came to stands in the state after that.
_STANDS = 3.0  # [s] So long a number that was taken stands as it was typed; to write is to disturb the hand.
_ENTERED = 0.5  # [s] The same of a number that was entered: the hand is done with it.
_NOBODY: Mapping[int | None, float] = MappingProxyType({})


def on_press(button: Any, ask: Ask, make: Callable[[int | None], Request]) -> None:
    """Asks for something when a button is pressed.

    Callbacks are async on purpose: viser then runs them on its event loop, in the order of the events. They only put
    a value into a queue.
    """

    @button.on_click
    async def _(event: Any) -> None:
        ask(make(event.client_id))


def why_html(text: Text, why: Message | None) -> str:
    """Returns why something is off, beside it; empty for None."""
    return "" if why is None else f'<p class="rl-note rl-why">{esc(text.render(why))}</p>'


class BoundControl:
    """A slider, dropdown or checkbox that asks when a person moves it and follows the state otherwise.

    Args:
        handle: The viser control.
        ask: Takes requests.
        make: Builds the request from the control's value and the page's client id.
    """

    def __init__(self, handle: Any, ask: Ask, make: Callable[[Any, int | None], Request | None]) -> None:
        self.handle = handle
        self._touched, self._seen = float("-inf"), handle.value

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client_id is None:  # We set it ourselves.
                return
            self._touched = time.monotonic()
            request = make(event.target.value, event.client_id)
            if request is not None:
                ask(request)

    def show(self, value: Any) -> None:
        """Writes the state's value, unless a person is moving the control."""
        before, self._seen = self._seen, self.handle.value
        if value != self._seen == before and time.monotonic() - self._touched > HAND_AWAY:
            self.handle.value = self._seen = value  # What was not there before is a hand's, whose word is on its way.

    def exchange(self, options: tuple[str, ...], value: str) -> None:
        """Gives a dropdown other options and one of them as value; viser alone would show the first one meanwhile."""
        self.handle.options = options
        self.handle.value = self._seen = value


class NumberField:
    """A text box for a number: a proposal while it is typed, asked for once it is entered or the typing has paused.

    Args:
        handle: From `gui.add_text`.
        ask: Takes requests.
        field: Name of the field in `TypeField`. It may be exchanged; what was typed before is asked for at once.
        unit: What the number is shown and typed in, from `Text.unit`; None for a number that has one unit only.
    """

    def __init__(self, handle: Any, ask: Ask, field: str, unit: Unit | None = None) -> None:
        self._handle, self._ask, self.field = handle, ask, field
        self._unit = unit or Unit("", 1.0)
        self._typed: tuple[float, str, int | None, str] | None = None
        self._committed, self._stands_for = float("-inf"), _STANDS
        self._answer: str | None = None  # What the state made of it.
        self._is_typed = False  # Whether what stands here is as it was typed.
        self._shown: str | None = None  # The field that it was shown for last.
        self._problem: Message | None = None
        self._beside: str | None = None  # The state's number when the problem came; None: it came elsewhere.

        @handle.on_update
        async def _(event: Any) -> None:
            if event.client_id is not None:
                self._typed = (time.monotonic(), event.target.value, event.client_id, self.field)

    def disable(self, is_off: bool) -> None:
        """Greys it, or makes it usable again."""
        self._handle.disabled = is_off

    def show(self, text: str, problem: Message | None, entered: Mapping[int | None, float] = _NOBODY) -> None:
        """Commits what was typed, or writes the state's number; called at the display's rate.

        Args:
            text: The state's number as it is to be shown, in degrees or millimetres where it has a unit of the page.
            problem: What is wrong with the typed number; it is then left as it is, until the state's number changes.
            entered: When a page last said that what is typed in it is complete, `UiState.entered`.
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
        said = self._unit.convert(text)
        if problem is not None and not self._is_about(problem, said):
            self._ask(DropProblem(field=self.field))
        elif self._is_typed and (problem is not None or self._stands(said)):
            return
        self._is_typed, self._shown = False, self.field
        if problem is None:
            self._problem = None
        if self._handle.value != said:
            self._handle.value = said

    def _is_about(self, problem: Message, said: str) -> bool:
        """Returns whether a problem came while the field showed this number, or what was typed in its place."""
        if problem != self._problem:
            self._problem, self._beside = problem, said if self._shown == self.field else None
        return self._shown == self.field and said == self._beside

    def _stands(self, said: str) -> bool:
        """Returns whether what was typed is left as it is: the answer is on its way, or has not changed since."""
        past = time.monotonic() - self._committed
        if past < _ANSWER:
            return True
        if self._answer is None:
            self._answer = said
        return past < self._stands_for and said == self._answer


class PageText:
    """A text box whose words lead somewhere: they are those of the page that typed them, and gone with its controls.

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
        """Returns what this page has typed, or what stands there of our own doing; "" when another page typed it."""
        return self.handle.value if page is None or self._page in (None, page) else ""

    def show(self, lease: ControlLock, text: str) -> bool:
        """Writes the state's own words in place of those of a page without the controls; returns whether it did."""
        is_over = self._page is not None and lease.holder not in (None, self._page)
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
    """Returns text that HTML shows as it is."""
    return html.escape(str(text))


def shown(number: float) -> str:
    """Returns a number for a field: two decimals, and never "-0.00"."""
    return format_fixed(float(number), 2)


def shown_pose(pose: Pose) -> tuple[str, ...]:
    """Returns x, y, z [mm] and roll, pitch, yaw [deg] for fields; a half turn is 180, whichever way rounding led."""
    turns = [shown(degrees) for degrees in np.degrees(pose.rpy)]
    return (*(shown(1000.0 * place) for place in pose.position), *("180.00" if t == "-180.00" else t for t in turns))
