"""Curves as one SVG: drawn once by the kernel and only scrolled over by the browser; colours follow the notebook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.arrays import Array
from rcilab.notebook.look import esc
from rcilab.notebook.plot import JOINT_COLORS
from rcilab.views.plots import Frame

WIDTH, LEFT, RIGHT = 960.0, 62.0, 12.0  # Units of the picture; the cursor lies over it in shares of the width.
_PANEL, _GAP, _TOP, _BOTTOM = 118.0, 12.0, 8.0, 34.0
_INK = "var(--jp-ui-font-color1, var(--vscode-editor-foreground, #1d2a3c))"
_SOFT = "var(--jp-ui-font-color2, var(--vscode-descriptionForeground, #51607a))"
_LINE = "var(--jp-border-color2, var(--vscode-panel-border, #d5dbe4))"
_BAD = "#d1392b"
_BLACK = 6  # The last colour of the palette is black: in a dark notebook it takes the colour of the text.


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One row of the picture."""

    title: str
    unit: str
    frame: Frame


def draw(panels: Sequence[Panel], joints: Sequence[int], time: str, limit: str | None) -> str:
    """Returns the picture.

    Args:
        panels: From top to bottom; all have the same time axis.
        joints: Which joint each curve is, from 0: its colour and its name in the legend.
        time: What the time axis is called.
        limit: What a limit is called; None where there are none.
    """
    height = _TOP + len(panels) * (_PANEL + _GAP) + _BOTTOM
    end = panels[0].frame.end
    parts = [
        f'<svg viewBox="0 0 {WIDTH:g} {height:g}" role="img" aria-label="{esc(", ".join(p.title for p in panels))}" '
        f'font-size="11.5" font-family="inherit">'
    ]
    for row, panel in enumerate(panels):
        parts.append(_panel(panel, _TOP + row * (_PANEL + _GAP), joints, limit if row == 0 else None))
    bottom = _TOP + len(panels) * (_PANEL + _GAP) - _GAP
    for tick in _ticks(0.0, end, 8):
        x = x_of(tick, end)
        parts.append(f'<text x="{x:.1f}" y="{bottom + 14:.1f}" text-anchor="middle" fill="{_SOFT}">{tick:g}</text>')
    parts.append(
        f'<text x="{WIDTH - RIGHT:g}" y="{bottom + 29:.1f}" text-anchor="end" fill="{_SOFT}">{esc(time)}</text>'
    )
    parts.append(_legend(joints, bottom + 29.0) + "</svg>")
    return "".join(parts)


def x_of(t: float, end: float) -> float:
    """Returns where a time is, in units of the picture."""
    return LEFT + (WIDTH - LEFT - RIGHT) * t / end


def _panel(panel: Panel, top: float, joints: Sequence[int], limit: str | None) -> str:
    frame = panel.frame
    middle, half = top + _PANEL / 2.0, _PANEL / 2.0

    def y(values: Array | float) -> Array:
        return middle - half * np.asarray(values) / frame.bound

    x = LEFT + (WIDTH - LEFT - RIGHT) * frame.t / frame.end
    clip = f"c{int(top)}"
    out = [
        f'<clipPath id="{clip}"><rect x="{LEFT:g}" y="{top:g}" width="{WIDTH - LEFT - RIGHT:g}" height="{_PANEL:g}"/>'
        "</clipPath>"
    ]
    for tick in _ticks(-frame.bound, frame.bound, 4):
        out.append(
            f'<path d="M{LEFT:g},{y(tick):.1f}H{WIDTH - RIGHT:g}" stroke="{_LINE}" stroke-width=".7"/>'
            f'<text x="{LEFT - 5:g}" y="{y(tick) + 4:.1f}" text-anchor="end" fill="{_SOFT}">{_number(tick)}</text>'
        )
    out.append(f'<g clip-path="url(#{clip})">' + _beyond(frame, y, top))
    out += [_span(x[a], x[b], top) for a, b in _spans(frame.violated)]
    for curve, joint in zip(frame.actual, joints, strict=False):
        out.append(_curve(x, y(curve), _color(joint), 'stroke-width="4" opacity=".38"'))
    dash = ' stroke-dasharray="6 3"' if frame.actual else ""
    for curve, joint in zip(frame.plan, joints, strict=False):
        out.append(_curve(x, y(curve), _color(joint), f'stroke-width="1.5"{dash}'))
    out.append("</g>")
    out.append(
        f'<rect x="{LEFT:g}" y="{top:g}" width="{WIDTH - LEFT - RIGHT:g}" height="{_PANEL:g}" fill="none" '
        f'stroke="{_LINE}"/>'
        f'<text transform="translate(13 {middle:.1f}) rotate(-90)" text-anchor="middle" fill="{_INK}">'
        f'{esc(panel.title)} <tspan fill="{_SOFT}">[{esc(panel.unit)}]</tspan></text>'
    )
    if limit is not None and math.isfinite(frame.upper):
        out.append(
            f'<text x="{WIDTH - RIGHT - 6:g}" y="{max(float(y(frame.upper)) - 3.0, top + 10.0):.1f}" '
            f'text-anchor="end" fill="{_SOFT}" font-size="10.5">{esc(limit)}</text>'
        )
    return "".join(out)


def _beyond(frame: Frame, y, top: float) -> str:  # type: ignore[no-untyped-def]
    """Returns grey beyond both limits."""
    if not math.isfinite(frame.upper):
        return ""
    upper, lower, width = float(y(frame.upper)), float(y(frame.lower)), WIDTH - LEFT - RIGHT
    out = ""
    for a, b in ((top, upper), (lower, top + _PANEL)):
        size = f'width="{width:g}" height="{max(b - a, 0.0):.1f}"'
        out += f'<rect x="{LEFT:g}" y="{a:.1f}" {size} fill="{_SOFT}" opacity=".14"/>'
    for edge in (upper, lower):
        out += f'<path d="M{LEFT:g},{edge:.1f}h{width:g}" stroke="{_SOFT}" stroke-dasharray="2 3"/>'
    return out


def _span(left: float, right: float, top: float) -> str:
    return (
        f'<rect class="rl-violation" x="{left:.1f}" y="{top:g}" width="{max(right - left, 2.0):.1f}" '
        f'height="{_PANEL:g}" fill="{_BAD}" opacity=".22"/>'
    )


def _spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _curve(x: Array, y: Array, color: str, style: str) -> str:
    known = np.isfinite(y)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[known].tolist(), y[known].tolist(), strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-linejoin="round" {style}/>'


def _legend(joints: Sequence[int], y: float) -> str:
    return "".join(
        f'<path d="M{LEFT + 62 * i:g},{y - 4:.1f}h16" stroke="{_color(joint)}" stroke-width="3"/>'
        f'<text x="{LEFT + 62 * i + 21:g}" y="{y:.1f}" fill="{_SOFT}">J{joint + 1}</text>'
        for i, joint in enumerate(joints)
    )


def _color(joint: int) -> str:
    place = joint % len(JOINT_COLORS)
    return _INK if place == _BLACK else JOINT_COLORS[place]


def _ticks(low: float, high: float, count: int) -> list[float]:
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * m for m in (1.0, 2.0, 2.5, 5.0, 10.0) if power * m >= rough)
    return [round(k * step, 9) + 0.0 for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:g}"
