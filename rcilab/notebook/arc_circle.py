"""The circle of arm angles at one pose: the free ones, and what forbids the others."""

from __future__ import annotations

import math

from rcilab.i18n.translator import Text
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.notebook.style import esc

_SIZE, _RADIUS, _WIDTH = 190.0, 62.0, 13.0
_GOOD, _BAD, _GREY = "#1f9d57", "#d1392b", "#8a94a3"
_INK = "var(--jp-ui-font-color1, var(--vscode-editor-foreground, #1d2a3c))"
_FULL_TURN = 2.0 * math.pi - 1e-6
_OVERLAP = 0.01  # [rad] Overlap of neighbouring arcs, against hairlines between two of a colour.


def draw_circle(arcs: FeasibleArcs, psi: float | None, text: Text) -> str:
    """Returns the circle as SVG: green free, red beyond a joint limit, grey at a singularity.

    Args:
        arcs: From `model.feasible_arcs`.
        psi: The current arm angle, [rad]; None draws no hand.
        text: The catalogue.
    """
    parts = [
        f'<svg viewBox="0 0 {_SIZE:g} {_SIZE:g}" width="{_SIZE:g}" height="{_SIZE:g}" role="img" '
        f'aria-label="{esc(text("target.circle"))}" font-size="11">'
    ]
    for arc in arcs.arcs:
        color = _GOOD if arc.ok else _BAD if "joint limits" in arc.reasons else _GREY
        why = text("circle.free") if arc.ok else ", ".join(text(f"circle.{reason}") for reason in arc.reasons)
        joints = "".join(f" J{joint}" for joint in arc.joints)
        ends = f"{math.degrees(arc.start):.1f}° … {math.degrees(arc.end):.1f}°"
        parts.append(_arc(arc.start, arc.end, color, f"{ends}: {why}{joints}"))
    for degrees in (0, 90, 180, -90):
        x, y = _at(math.radians(degrees), _RADIUS + 19.0)
        label = "±180°" if degrees == 180 else f"{degrees}°"
        parts.append(f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle" fill="{_INK}">{label}</text>')
    if psi is not None:
        x, y = _at(psi, _RADIUS + 0.5 * _WIDTH + 2.0)
        middle = _SIZE / 2.0
        parts.append(
            f'<path d="M{middle:g},{middle:g}L{x:.1f},{y:.1f}" stroke="{_INK}" stroke-width="2"/>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{_INK}"/>'
        )
    return "".join(parts) + "</svg>"


def _arc(start: float, end: float, color: str, title: str) -> str:
    style = f'fill="none" stroke="{color}" stroke-width="{_WIDTH:g}"'
    if end - start > _FULL_TURN:
        shape = f'<circle cx="{_SIZE / 2:g}" cy="{_SIZE / 2:g}" r="{_RADIUS:g}" {style}>'
        return f"{shape}<title>{esc(title)}</title></circle>"
    (x0, y0), (x1, y1) = _at(start, _RADIUS), _at(end + _OVERLAP, _RADIUS)
    large = int(end - start > math.pi)
    d = f"M{x0:.2f},{y0:.2f}A{_RADIUS:g},{_RADIUS:g} 0 {large} 1 {x1:.2f},{y1:.2f}"
    return f'<path d="{d}" {style}><title>{esc(title)}</title></path>'


def _at(angle: float, radius: float) -> tuple[float, float]:
    """Returns the point of an angle on the picture: 0 is at the top, positive angles go clockwise."""
    return _SIZE / 2.0 + radius * math.sin(angle), _SIZE / 2.0 - radius * math.cos(angle)
