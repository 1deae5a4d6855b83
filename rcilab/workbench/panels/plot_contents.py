"""The contents of one plot for uPlot: data, styles of the curves, bands of limits and violations, axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.text import Text
from rcilab.workbench.widgets import esc

if TYPE_CHECKING:
    from rcilab.app.store import Theme
    from rcilab.views.plots import Frame

COLORS = ("#0b6fc2", "#e07b00", "#1a9850", "#c2357a", "#7b52c7", "#8a6d3b", "#008b9a")
"""One colour per joint, distinct on white with common colour blindness; the number is in the legend."""
_DARK_COLORS = ("#5aaef2", "#ffab40", "#5fd38d", "#ff7eb6", "#b79bff", "#d9bd82", "#3fd0e0")
_BROKEN = 4  # Joints from here on, from 0, are dashed: seven colours are hard to distinguish.
_GAPS = (9, 3)
_NUMBERS = 58  # [px] Width of the labels: a jerk in degrees has six digits.
_INK = {"light": "#111827", "dark": "#f3f6fa"}
_AXIS = {"light": ("#51607a", "#e6ebf2"), "dark": ("#a9b6c8", "#3a4452")}
_EDGE = {"light": "#d1392b", "dark": "#ff7b70"}


def joint_color(joint: int, theme: Theme) -> str:
    """Returns the colour of a joint, from 0."""
    colors = COLORS if theme == "light" else _DARK_COLORS
    return colors[joint % len(colors)]


def plot_contents(
    frame: Frame, joint: int, n: int, theme: Theme = "light", *, is_tool: bool = False
) -> tuple[tuple[np.ndarray, ...], tuple[Any, ...], tuple[Any, ...]]:
    """Returns data, series and bands of one plot: limits as tinted bands, violations as columns, then curves.

    The number of series never changes: viser sends data and series one after the other, and uPlot fails if they do not
    match in between. Unused curves contain NaN.

    Args:
        frame: The quantity.
        joint: Its joint, from 1; 0 for all.
        n: Number of joints.
        theme: Theme of the page.
        is_tool: Whether the only curve does not belong to a joint.
    """
    t, nothing = frame.t, np.full(len(frame.t), np.nan)

    def level(value: float) -> np.ndarray:
        return np.full(len(t), value)

    hidden: Any = {"width": 0, "points": {"show": False}}
    edge: Any = {"stroke": _EDGE[theme], "width": 1, "dash": (5, 4), "points": {"show": False}}
    data = [
        t,
        level(frame.bound),
        frame.upper,
        frame.lower,
        level(-frame.bound),
        np.where(frame.violated, frame.bound, -frame.bound),
    ]
    series: list[Any] = [{}, hidden, edge, edge, hidden, hidden]
    pale, strong = "rgba(209,57,43,0.10)", "rgba(209,57,43,0.40)"
    bands = tuple({"series": pair, "fill": fill} for pair, fill in (((1, 2), pale), ((3, 4), pale), ((5, 4), strong)))
    for curves, is_actual in ((frame.plan, False), (frame.actual, True)):
        for index in range(n):
            shown = joint - 1 if joint else index
            plain = is_tool or (joint and is_actual)
            look: Any = {"width": 2, "dash": (2, 5)} if is_actual else {"width": 1.5}
            if not is_actual and not is_tool and shown >= _BROKEN:
                look = {"width": 1.5, "dash": _GAPS}
            data.append(curves[index] if index < len(curves) else nothing)
            color = _INK[theme] if plain else joint_color(shown, theme)
            series.append({"stroke": color, "points": {"show": False}, "pxAlign": 0, **look})
    return tuple(data), tuple(series), bands


def plot_axes(theme: Theme, *, last: bool, ticks: tuple[float, ...] | None = None) -> tuple[Any, ...]:
    """Returns the axes of a plot.

    Args:
        theme: Theme of the page.
        last: Whether it shows the time: only the last one of a column does.
        ticks: Its labels; None leaves them to uPlot.
    """
    ink, grid = _AXIS[theme]
    look = {"font": "11px system-ui, sans-serif", "stroke": ink, "grid": {"stroke": grid, "width": 1}}
    marks = {"size": 3, "stroke": grid, "width": 1}
    x: Any = {**look, "size": 22, "gap": 2, "ticks": marks} if last else {"show": False}
    # uPlot leaves out an axis whose own steps have less room than `space`, whatever the ticks.
    chosen: Any = {"space": 26} if ticks is None else {"space": 1, "splits": ticks}
    return x, {**look, "size": _NUMBERS, "gap": 3, "ticks": marks, **chosen}


def legend_html(joint: int, n: int, text: Text, theme: Theme, *, has_actual: bool, is_scaled: bool = False) -> str:
    """Returns the colour and dash of each joint, the meaning of dots, dashes and areas, and the speed of the plan."""
    joints = [joint - 1] if joint else range(n)
    swatches = "".join(
        f'<span><i class="rl-swatch{" rl-broken" if i >= _BROKEN else ""}" style="color:{joint_color(i, theme)}"></i>'
        f"J{i + 1}</span>"
        for i in joints
    )
    signs = ("actual", "limit", "violation") if has_actual else ("limit", "violation")
    rest = "".join(f'<span class="rl-sign-{sign}">{esc(text("legend." + sign))}</span>' for sign in signs)
    note = f"<span>{esc(text('legend.speed_override'))}</span>" if is_scaled else ""
    return f'<div class="rl-legend">{swatches}{rest}{note}</div>'
