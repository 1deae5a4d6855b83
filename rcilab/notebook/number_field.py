"""A typed number: accepted when Enter is pressed or the field is left, or refused with one sentence below."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ipywidgets

from rcilab.i18n.number_parsing import format_short, parse_number
from rcilab.i18n.rounding import format_fixed
from rcilab.i18n.translator import Text
from rcilab.notebook.style import block, problem, write
from rcilab.notebook.widget_sharing import shared_style_widget

_LABELLED, _BARE = ("9.5em", "4em", "2.6em"), ("5.2em", "", "2.6em")


class NumberField:
    """A field with its unit; its text is accepted once it is a finite number in its range.

    Args:
        text: The catalogue.
        label: Full name of the number.
        unit: Its unit, such as "deg".
        low: Smallest valid number, in that unit.
        high: Largest one.
        take: Called with a valid number.
        digits: Digits after the point; None: as many as needed.
        of: Name of the number for the tooltip, if the field has no label.
        value: Initial number.
        widths: Widths of the field with its label, of the label, and of the unit.
    """

    def __init__(
        self,
        text: Text,
        label: str,
        unit: str,
        low: float,
        high: float,
        take: Callable[[float], None],
        *,
        digits: int | None = 1,
        of: str = "",
        value: float | None = None,
        widths: tuple[str, str, str] | None = None,
    ) -> None:
        self._text, self._unit, self._low, self._high, self._take = text, unit, low, high, take
        self._digits = digits
        self._shown = self._write(value)
        hint = text("field.hint", low=format_short(low), high=format_short(high), unit=unit)
        box, before, behind = widths or (_LABELLED if label else _BARE)
        self.box: Any = shared_style_widget(
            ipywidgets.Text, value=self._shown, description=label, tooltip=f"{of}: {hint}" if of else hint,
            continuous_update=False, layout={"width": box}, style={"description_width": before},
        )  # fmt: skip
        self.unit: Any = shared_style_widget(ipywidgets.Label, unit, layout={"width": behind})
        self.message_box: Any = block()
        self.box.observe(self._on_typed, names="value")

    @property
    def cells(self) -> list[Any]:
        """The field and its unit, for one row."""
        return [self.box, self.unit]

    @property
    def problem(self) -> bool:
        """Whether the text of the field was refused."""
        return bool(self.message_box.value)

    def show(self, value: float) -> None:
        """Shows a number in place of the text."""
        self._shown = self._write(value)
        write(self.message_box, "")
        if self.box.value != self._shown:
            self.box.value = self._shown

    def _write(self, value: float | None) -> str:
        if value is None:
            return ""
        return f"{value:g}" if self._digits is None else format_fixed(value, self._digits)

    def _on_typed(self, change: Any) -> None:
        if change["new"] == self._shown:
            return
        parsed = parse_number(change["new"], self._low, self._high, self._unit)
        if parsed.value is None:
            assert parsed.problem is not None
            write(self.message_box, problem(self._text.render(parsed.problem)))
            return
        write(self.message_box, "")
        self._shown = change["new"]  # The field shows the typed text until `show` replaces it by the rounded number.
        self._take(parsed.value)
