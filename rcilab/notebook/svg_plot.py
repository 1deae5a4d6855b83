"""Curves as SVG: drawn once by the kernel, arranged by the browser; colours follow the notebook.

Every panel has a cursor. One line of style places them all, so moving them needs no new picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.notebook.palette import JOINT_COLORS
from rcilab.notebook.style import esc
from rcilab.views.plots import Frame

_WIDTH, _HEIGHT = 420.0, 168.0  # Units of a panel; the browser scales it.
_LEFT, _RIGHT, _TOP, _BOTTOM = 40.0, 6.0, 20.0, 20.0
_PLOT_WIDTH, _PLOT_HEIGHT = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM
INK = "var(--jp-ui-font-color1, var(--vscode-editor-foreground, #1d2a3c))"
SOFT = "var(--jp-ui-font-color2, var(--vscode-descriptionForeground, #51607a))"
LINE = "var(--jp-border-color2, var(--vscode-panel-border, #d5dbe4))"
BAD = "#d1392b"
_BLACK = 6  # The last colour of the palette is black: in a dark notebook it takes the colour of the text.


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One picture: a signal over time."""

    title: str
    unit: str
    frame: Frame


def draw(panels: Sequence[Panel], joints: Sequence[int], time: str, limit: str) -> str:
    """Returns the pictures, as many in a row as fit, and the legend.

    Args:
        panels: Panels with the same time axis.
        joints: Joint of each curve, from 0: its colour and its name in the legend.
        time: Name of the time axis.
        limit: Name of a limit.
    """
    pictures = "".join(
        f'<div class="rl-panel">{_picture(panel, joints, time, limit)}<div class="rl-cursor"></div></div>'
        for panel in panels
    )
    names = "".join(
        f'<span><i style="background:{_color(joint)}"></i>J{joint + 1}</span>' for joint in joints
    )  # fmt: skip
    return f'<div class="rl-legend">{names}</div><div class="rl-panels">{pictures}</div>'


def share_of(t: float, end: float) -> float:
    """Returns the position of a time on a panel, 0 to 1."""
    return (_LEFT + _PLOT_WIDTH * t / end) / _WIDTH


def ticks(low: float, high: float, count: int) -> list[float]:
    """Returns about so many round numbers between two ends."""
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * m for m in (1.0, 2.0, 2.5, 5.0, 10.0) if power * m >= rough - 1e-12)
    return [round(k * step, 9) + 0.0 for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def number(value: float) -> str:
    """Returns the label of a tick."""
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:g}"


def _picture(panel: Panel, joints: Sequence[int], time: str, limit: str) -> str:
    frame = panel.frame
    middle, half, bottom, right = _TOP + _PLOT_HEIGHT / 2.0, _PLOT_HEIGHT / 2.0, _TOP + _PLOT_HEIGHT, _WIDTH - _RIGHT

    def y(values: Array | float) -> Array:
        return middle - half * np.asarray(values) / frame.bound

    x = _LEFT + _PLOT_WIDTH * frame.t / frame.end
    out = [
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{esc(panel.title)}" font-size="10.5">',
        f'<text x="{_LEFT:g}" y="13" fill="{INK}" font-weight="600">{esc(panel.title)} '
        f'<tspan fill="{SOFT}" font-weight="400">[{esc(panel.unit)}]</tspan></text>',
    ]
    for tick in ticks(-frame.bound, frame.bound, 4):
        out.append(
            f'<path d="M{_LEFT:g},{y(tick):.1f}H{right:g}" stroke="{LINE}" stroke-width=".7"/>'
            f'<text x="{_LEFT - 4:g}" y="{y(tick) + 3.5:.1f}" text-anchor="end" fill="{SOFT}">{number(tick)}</text>'
        )
    for tick in ticks(0.0, frame.end, 6):
        at = _LEFT + _PLOT_WIDTH * tick / frame.end
        side = "end" if at > right - 12.0 else "middle"
        name = f"{tick:g} {time}" if side == "end" else f"{tick:g}"
        out.append(f'<text x="{at:.1f}" y="{bottom + 13:g}" text-anchor="{side}" fill="{SOFT}">{esc(name)}</text>')
    out.append(_beyond(frame, x, y, limit))
    out += [_span(float(x[a]), float(x[b])) for a, b in _spans(frame.violated)]
    for curve, joint in zip(frame.actual, joints, strict=False):
        out.append(_curve(x, y(curve), _color(joint), 'stroke-width="4" opacity=".38"'))
    dash = ' stroke-dasharray="6 3"' if frame.actual else ""
    for curve, joint in zip(frame.plan, joints, strict=False):
        out.append(_curve(x, y(curve), _color(joint), f'stroke-width="1.5"{dash}'))
    frame_line = f'<rect x="{_LEFT:g}" y="{_TOP:g}" width="{_PLOT_WIDTH:g}" height="{_PLOT_HEIGHT:g}" fill="none" '
    out.append(f'{frame_line}stroke="{LINE}"/></svg>')
    return "".join(out)


def _beyond(frame: Frame, x: Array, y: Callable[[Array], Array], limit: str) -> str:
    """Returns the grey areas beyond both limits."""
    if not np.isfinite(frame.upper).any():
        return ""
    out = ""
    for edge, end in ((frame.upper, _TOP), (frame.lower, _TOP + _PLOT_HEIGHT)):
        rows = slice(None) if np.ptp(edge) else [0, -1]
        places = zip(x[rows].tolist(), y(edge[rows]).tolist(), strict=True)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        out += f'<polygon points="{_LEFT:g},{end:g} {points} {x[-1]:.1f},{end:g}" fill="{SOFT}" opacity=".14"/>'
        out += f'<polyline points="{points}" fill="none" stroke="{SOFT}" stroke-dasharray="2 3"/>'
    place = f'x="{_WIDTH - _RIGHT - 4:g}" y="{float(y(frame.upper[-1:])[0]) + 11.0:.1f}" text-anchor="end"'
    return out + f'<text {place} fill="{SOFT}" font-size="9.5">{esc(limit)}</text>'


def _span(left: float, right: float) -> str:
    return (
        f'<rect class="rl-violation" x="{left:.1f}" y="{_TOP:g}" width="{max(right - left, 2.0):.1f}" '
        f'height="{_PLOT_HEIGHT:g}" fill="{BAD}" opacity=".22"/>'
    )


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _curve(x: Array, y: Array, color: str, style: str) -> str:
    """Returns a line; outside the panel it follows the edge."""
    known = np.isfinite(y)
    inside = np.clip(y[known], _TOP, _TOP + _PLOT_HEIGHT)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[known].tolist(), inside.tolist(), strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-linejoin="round" {style}/>'


def _color(joint: int) -> str:
    index = joint % len(JOINT_COLORS)
    return INK if index == _BLACK else JOINT_COLORS[index]
