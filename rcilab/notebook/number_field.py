"""A number that is typed: taken when Enter is pressed or the field is left, refused with one kind sentence below."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ipywidgets

from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.rounding import format_fixed
from rcilab.i18n.translator import Text
from rcilab.notebook.style import block, problem, write
from rcilab.notebook.widget_sharing import lean

_LABELLED, _BARE = ("9.5em", "4em", "2.6em"), ("5.2em", "", "2.6em")


class NumberField:
    """A field with its unit behind it; what stands in it is a proposal until it is a finite number in its range.

    Args:
        text: Words.
        label: What the number is, in full.
        unit: Its unit, such as "deg".
        low: Smallest number that is taken, in that unit.
        high: Largest one.
        take: Called with a number that is taken.
        digits: Digits after the point that are shown; None: as many as it takes.
        of: What the number is, where it stands beside the field instead of before it.
        value: What stands in it at first.
        widths: Of the field with its label, of the label, and of the unit.
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
        hint = text("field.hint", low=_short(low), high=_short(high), unit=unit)
        box, before, behind = widths or (_LABELLED if label else _BARE)
        self.box: Any = lean(
            ipywidgets.Text, value=self._shown, description=label, tooltip=f"{of}: {hint}" if of else hint,
            continuous_update=False, layout={"width": box}, style={"description_width": before},
        )  # fmt: skip
        self.unit: Any = lean(ipywidgets.Label, unit, layout={"width": behind})
        self.said: Any = block()
        self.box.observe(self._on_typed, names="value")

    @property
    def cells(self) -> list[Any]:
        """The field and its unit, to stand in a row."""
        return [self.box, self.unit]

    @property
    def problem(self) -> bool:
        """Whether what stands in the field was refused."""
        return bool(self.said.value)

    def show(self, value: float) -> None:
        """Shows a number, whatever was typed."""
        self._shown = self._write(value)
        write(self.said, "")
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
            write(self.said, problem(self._text.render(parsed.problem)))
            return
        write(self.said, "")
        self._shown = change["new"]  # It is what was meant: a rounded number may follow.
        self._take(parsed.value)


def _short(number: float) -> str:
    return f"{number:.3f}".rstrip("0").rstrip(".")
