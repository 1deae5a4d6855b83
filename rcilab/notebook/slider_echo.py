"""The reports of a browser's slider after it was set to numbers between its steps.

The browser rounds such numbers and reports the result like a drag. Taken for a drag it would change the value by up to
half a step, and a late report, after other numbers were set, would restore an old value.
"""

from __future__ import annotations

from typing import Any

_ROUNDING = 1e-6
_LONGEST = 20  # Number of remembered numbers: more than are set while a cell runs before a browser draws.


class SliderEcho:
    """Distinguishes the reports of a slider: drags, or echoes of numbers that were set.

    Args:
        slider: A slider of ipywidgets.
    """

    def __init__(self, slider: Any) -> None:
        self._half_step = 0.5 * slider.step + _ROUNDING
        self._given: list[float] = [slider.value]

    def give(self, number: float) -> None:
        """Registers a number; to be called before the slider is set."""
        self._given = [*self._given[1 - _LONGEST :], number]

    def is_hand(self, number: float) -> bool:
        """Returns whether a report is a drag: no number that was set since the last report rounds to it.

        The slider shows the newest number; earlier ones are forgotten after its echo or a drag.
        """
        if abs(number - self._given[-1]) <= self._half_step:
            self._given = self._given[-1:]
            return False
        if any(abs(number - given) <= self._half_step for given in self._given):
            return False
        self._given = [number]
        return True
