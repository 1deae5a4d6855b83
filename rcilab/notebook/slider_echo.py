"""What a browser's slider reports when it is given numbers between its steps.

It rounds them and reports the result like a hand's; taken for one it would move what the slider shows by up to half a
step, and when the report comes late, after other numbers were given, back to where it was.
"""

from __future__ import annotations

from typing import Any

_ROUNDING = 1e-6
_LONGEST = 20  # Numbers that are remembered: more than are given while a cell runs before a browser draws.


class SliderEcho:
    """Distinguishes what a slider reports: a hand, or numbers that it was given.

    Args:
        slider: Of ipywidgets.
    """

    def __init__(self, slider: Any) -> None:
        self._half_step = 0.5 * slider.step + _ROUNDING
        self._given: list[float] = [slider.value]

    def give(self, number: float) -> None:
        """Notes what the slider is given; to be called before it is."""
        self._given = [*self._given[1 - _LONGEST :], number]

    def is_hand(self, number: float) -> bool:
        """Returns whether a report is from a hand: nothing that the slider was given since the last one rounds to it.

        The newest number is what it shows; those before it are forgotten once it is reported back, or a hand came.
        """
        if abs(number - self._given[-1]) <= self._half_step:
            self._given = self._given[-1:]
            return False
        if any(abs(number - given) <= self._half_step for given in self._given):
            return False
        self._given = [number]
        return True
