"""What a browser's slider tells back when it is given a number between two of its steps."""

from __future__ import annotations

from typing import Any

_ROUNDING = 1e-6


def is_echo(change: Any, wanted: float) -> bool:
    """Returns whether a slider's news are nothing but the number it was given, rounded to its steps by the browser.

    Taken for a person's hand it would move what the slider shows by up to half a step. A hand moves it by a step.

    Args:
        change: What ipywidgets tells of the slider's value.
        wanted: The number that it stands for, in its unit.
    """
    return abs(change["new"] - wanted) <= 0.5 * change["owner"].step + _ROUNDING
