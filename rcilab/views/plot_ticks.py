"""Which numbers stand beside a plot: as many as its height has room for, and some at every height."""

from __future__ import annotations

import math

_ROOMY, _CLOSE = 26.0, 13.0  # [px] From number to number: where there is room, and at least. Numbers are 11 px high.
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_SHORT = 6  # Characters that a number has at most for a limit to be written beside the plot.


def axis_ticks(low: float, high: float, height: float, limits: tuple[float, ...] = ()) -> tuple[float, ...]:
    """Returns round numbers between the ends of an axis, zero and both sides among them, and its limits.

    Args:
        low: Lower end; `high` is -low, or low is 0.
        high: Upper end, more than `low`.
        height: Of the axis, [px].
        limits: Bounds within the axis; the short ones are written, and nothing close to them.
    """
    per_pixel = (high - low) / height
    step = round_step(_ROOMY * per_pixel)
    if step > high:  # Nothing but zero would be written.
        step = round_step(_CLOSE * per_pixel)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    written = [limit for limit in limits if low <= limit <= high]
    if any(len(_written(limit)) > _SHORT for limit in written):
        written = []
    rounds = (count * step for count in range(first, last + 1))
    return tuple(sorted((*written, *(at for at in rounds if _is_clear(at, written, _CLOSE * per_pixel)))))


def round_step(least: float) -> float:
    """Returns the smallest of 1, 2, 2.5, 5 times a power of ten that is not below a positive number."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(share * power for share in _STEPS if share * power >= least * (1.0 - 1e-9))


def _written(value: float) -> str:
    """Returns a number as a page writes it."""
    return f"{value:,.3f}".rstrip("0").rstrip(".")


def _is_clear(at: float, written: list[float], distance: float) -> bool:
    return all(abs(at - limit) >= distance for limit in written)
