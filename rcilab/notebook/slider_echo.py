"""Distinguishes drags of a browser's slider from its reports after it was set to numbers between its steps.

The browser rounds such numbers and reports the result like a drag. Taken for a drag, it would change the value by up to
half a step, and a late report, after other numbers were set, would restore an old value.
"""

from __future__ import annotations

from typing import Any

_ROUNDING = 1e-6
_MAX_REMEMBERED = 20  # More numbers than are set while a cell runs before a browser draws.


class SliderEcho:
    """Distinguishes the reports of a slider: drags, or echoes of numbers that were set.

    Args:
        slider: A slider of ipywidgets.
    """

    def __init__(self, slider: Any) -> None:
        self._half_step = 0.5 * slider.step + _ROUNDING
        self._registered: list[float] = [slider.value]

    def register(self, number: float) -> None:
        """Registers a number; call it before the slider is set."""
        self._registered = [*self._registered[1 - _MAX_REMEMBERED :], number]

    def is_drag(self, number: float) -> bool:
        """Returns whether a report is a drag: no number that was set since the last report rounds to it.

        The slider shows the newest number; earlier ones are forgotten after its echo or a drag.
        """
        if abs(number - self._registered[-1]) <= self._half_step:
            self._registered = self._registered[-1:]
            return False
        if any(abs(number - registered) <= self._half_step for registered in self._registered):
            return False
        self._registered = [number]
        return True
