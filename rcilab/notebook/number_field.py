"""A number that is typed: taken when Enter is pressed or the field is left, refused with one kind sentence below."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ipywidgets

from rcilab.notebook.look import block, problem, write
from rcilab.words.number import parse_number
from rcilab.words.rounding import fixed
from rcilab.words.text import Text


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
    ) -> None:
        self._text, self._unit, self._low, self._high, self._take = text, unit, low, high, take
        self._digits = digits
        self._shown = ""
        hint = text("field.hint", low=_short(low), high=_short(high), unit=unit)
        self.box = ipywidgets.Text(
            description=label, tooltip=hint, continuous_update=False, layout=ipywidgets.Layout(width="5.2em")
        )
        if label:
            self.box.layout.width = "9.5em"
            self.box.style.description_width = "4em"
        self.unit = ipywidgets.Label(unit, layout=ipywidgets.Layout(width="2.6em"))
        self.said: Any = block()
        self.row = ipywidgets.HBox([self.box, self.unit])
        self.box.observe(self._on_typed, names="value")

    @property
    def problem(self) -> bool:
        """Whether what stands in the field was refused."""
        return bool(self.said.value)

    def show(self, value: float) -> None:
        """Shows a number, whatever was typed."""
        self._shown = f"{value:g}" if self._digits is None else fixed(value, self._digits)
        write(self.said, "")
        if self.box.value != self._shown:
            self.box.value = self._shown

    def _on_typed(self, change: Any) -> None:
        if change["new"] == self._shown:
            return
        parsed = parse_number(change["new"], self._low, self._high, self._unit)
        if parsed.value is None:
            assert parsed.problem is not None
            write(self.said, problem(self._text.say(parsed.problem)))
            return
        write(self.said, "")
        self._shown = change["new"]  # It is what was meant: a rounded number may follow.
        self._take(parsed.value)


def _short(number: float) -> str:
    return f"{number:.3f}".rstrip("0").rstrip(".")
