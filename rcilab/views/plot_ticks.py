"""Axis labels of a plot: as many as fit into its height, and at least some at every height."""

from __future__ import annotations

import math

_ROOMY, _CLOSE = 26.0, 13.0  # [px] Preferred and smallest distance of two labels; a label is 11 px high.
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_SHORT = 6  # Characters of the longest limit that is labelled.


def axis_ticks(low: float, high: float, height: float, limits: tuple[float, ...] = ()) -> tuple[float, ...]:
    """Returns the labels of an axis: round numbers, with zero and both signs, and its limits.

    Args:
        low: Lower end; `high` is -low, or low is 0.
        high: Upper end, more than `low`.
        height: Height of the axis, [px].
        limits: Limits within the axis; short ones are labelled, and no number close to them.
    """
    per_pixel = (high - low) / height
    step = round_step(_ROOMY * per_pixel)
    if step > high:  # Only zero would be labelled.
        step = min(round_step(_CLOSE * per_pixel), _round_step_below(high))
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


def _round_step_below(most: float) -> float:
    """Returns the largest of 1, 2, 2.5, 5 times a power of ten that is not above a positive number."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(share * power for share in _STEPS[:-1] if share * power <= most * (1.0 + 1e-9))


def _written(value: float) -> str:
    """Returns a number as the page formats it."""
    return f"{value:,.3f}".rstrip("0").rstrip(".")


def _is_clear(at: float, written: list[float], distance: float) -> bool:
    return all(abs(at - limit) >= distance for limit in written)
