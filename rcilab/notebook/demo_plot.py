"""The curve that violated its bound, as SVG: the bound, the area beyond it, and the sample with the fault."""

from __future__ import annotations

import math

import numpy as np

from rcilab.app.fault_lab.demo_view import AFTER_FAULT, MARGIN, seen_lower
from rcilab.app.fault_lab.signals import FaultSignal
from rcilab.core.arrays import Array
from rcilab.notebook.style import esc
from rcilab.notebook.svg_plot import BAD, LINE, SOFT, number, ticks

_WIDTH, _HEIGHT = 420.0, 150.0  # Units; the browser scales them.
_LEFT, _RIGHT, _TOP, _BOTTOM = 46.0, 8.0, 6.0, 20.0
_NAME = 60.0  # Width of the time axis' name.
_CURVE = "#0072B2"


def draw_signal(signal: FaultSignal, t: Array, title: str, time: str, factor: float = 1.0) -> str:
    """Returns the picture.

    Args:
        signal: The quantity.
        t: Time of its values, shape (N,), [s].
        title: Name of the curve.
        time: Name of the time axis.
        factor: From SI to the displayed unit.
    """
    values = factor * signal.values
    lower, upper = seen_lower(values, factor * signal.lower), factor * signal.upper
    known = np.isfinite(values)
    seen = [float(values[known].min()), float(values[known].max())]
    seen += [float(edge) for bound in (lower, upper) for edge in (bound.min(), bound.max()) if math.isfinite(edge)]
    margin = MARGIN * (max(seen) - min(seen) or 1.0)
    low, high, end = min(seen) - margin, max(seen) + margin, float(t[-1]) * (1.0 + AFTER_FAULT)
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM

    def x(at: float) -> float:
        return _LEFT + (right - _LEFT) * at / end

    def y(value: float) -> float:
        return _TOP + (bottom - _TOP) * (high - value) / (high - low)

    out = [
        f'<svg class="rl-demo-plot" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{esc(title)}" '
        'font-size="10.5">'
    ]
    for tick in ticks(low, high, 4):
        out.append(
            f'<path d="M{_LEFT:g},{y(tick):.1f}H{right:g}" stroke="{LINE}" stroke-width=".7"/>'
            f'<text x="{_LEFT - 4:g}" y="{y(tick) + 3.5:.1f}" text-anchor="end" fill="{SOFT}">{number(tick)}</text>'
        )
    for tick in (tick for tick in ticks(0.0, end, 5) if x(tick) < right - _NAME):
        out.append(f'<text x="{x(tick):.1f}" y="{bottom + 13:g}" text-anchor="middle" fill="{SOFT}">{tick:g}</text>')
    out.append(f'<text x="{right:g}" y="{bottom + 13:g}" text-anchor="end" fill="{SOFT}">{esc(time)}</text>')
    for bound, side in ((upper, _TOP), (lower, bottom)):
        if np.isfinite(bound).all():
            edge = [(x(a), y(b)) for a, b in zip((*t.tolist(), end), (*bound.tolist(), bound[-1]), strict=True)]
            out.append(_beyond(edge, side))
    points = " ".join(f"{x(a):.1f},{y(b):.1f}" for a, b in zip(t[known].tolist(), values[known].tolist(), strict=True))
    out.append(f'<polyline points="{points}" fill="none" stroke="{_CURVE}" stroke-width="2"/>')
    if known[-1]:
        out.append(f'<circle cx="{x(float(t[-1])):.1f}" cy="{y(factor * signal.value):.1f}" r="5" fill="{BAD}"/>')
    frame = f'<rect x="{_LEFT:g}" y="{_TOP:g}" width="{right - _LEFT:g}" height="{bottom - _TOP:g}" fill="none" '
    return "".join(out) + f'{frame}stroke="{LINE}"/></svg>'


def _beyond(edge: list[tuple[float, float]], side: float) -> str:
    """Returns a bound, and the tinted area from it to a side of the plot."""
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in edge)
    return (
        f'<polygon points="{line} {edge[-1][0]:.1f},{side:.1f} {edge[0][0]:.1f},{side:.1f}" fill="{BAD}" '
        'opacity=".1"/>'
        f'<polyline points="{line}" fill="none" stroke="{BAD}" stroke-width="1.2" stroke-dasharray="5 4"/>'
    )
