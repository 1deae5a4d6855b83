"""The plot of a fault on show: the bounds, the curve, and the sample with the fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_NEAR = 0.5  # Share of the lower bound from which on it is shown: a far one would press the curve flat. A choice.


def plot_contents(t: Any, values: Any, lower: float, upper: float) -> tuple[Any, Any, Any]:
    """Returns data, series and bands: bounds, what is beyond them, the curve, the sample with the fault."""
    seen = np.where(np.isfinite(values), values, np.nan)
    least = float(np.nanmin(seen))
    floor = lower if math.isfinite(lower) and least < _NEAR * lower else math.nan
    top = 1.25 * max(abs(upper), float(np.nanmax(np.abs(seen))), 1e-9)

    def level(value: float) -> Any:
        return np.full(len(t), value)

    mark = np.full(len(t), np.nan)
    mark[-1] = seen[-1]
    hidden: Any = {"width": 0, "points": {"show": False}}
    edge: Any = {"stroke": "#d1392b", "width": 1.2, "dash": (5, 4), "points": {"show": False}}
    curve: Any = {"stroke": "#0b6fc2", "width": 2, "points": {"show": False}}
    fault: Any = {"stroke": "#d1392b", "width": 0, "points": {"show": True, "size": 11, "fill": "#d1392b"}}
    data = (
        t,
        level(top if upper >= 0.0 else 0.0),
        level(upper),
        level(floor),
        level(-top if floor < 0 else math.nan),
        seen,
        mark,
    )
    series = ({}, hidden, edge, edge, hidden, curve, fault)
    tint = "rgba(209,57,43,0.10)"
    return data, series, ({"series": (1, 2), "fill": tint}, {"series": (3, 4), "fill": tint})


def plot_axes() -> tuple[Any, ...]:
    """Returns the axes, time below."""
    font = "11px system-ui, sans-serif"
    x: Any = {"font": font, "size": 22, "gap": 2, "ticks": {"size": 3}}
    return x, {"font": font, "size": 52, "gap": 3, "space": 26, "ticks": {"size": 3}}
