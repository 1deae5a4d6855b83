"""The plot of a provoked fault: the bounds, the curve, and the sample with the fault."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.fault_lab.demo_view import seen_lower
from rcilab.core.arrays import Array
from rcilab.workbench.panels.plot_contents import joint_color

if TYPE_CHECKING:
    from rcilab.app.store import Theme

_RED = {"light": "#d1392b", "dark": "#ff7b70"}


def demo_contents(t: Array, values: Array, lower: float, upper: float, theme: Theme) -> tuple[Any, Any, Any]:
    """Returns data, series and bands: bounds, the area beyond them, the curve, the sample with the fault."""
    red = _RED[theme]
    seen = np.where(np.isfinite(values), values, np.nan)
    floor = seen_lower(values, lower)
    top = 1.25 * max(abs(upper), float(np.nanmax(np.abs(seen))), 1e-9)

    def level(value: float) -> Any:
        return np.full(len(t), value)

    mark = np.full(len(t), np.nan)
    mark[-1] = seen[-1]
    hidden: Any = {"width": 0, "points": {"show": False}}
    edge: Any = {"stroke": red, "width": 1.2, "dash": (5, 4), "points": {"show": False}}
    curve: Any = {"stroke": joint_color(0, theme), "width": 2, "points": {"show": False}}
    fault: Any = {"stroke": red, "width": 0, "points": {"show": True, "size": 11, "fill": red}}
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
