"""Arm angle: a slider over the elbow circle of a 7-axis arm as a bar, with free and forbidden arcs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.goal.elbow import DEXTERITY_SAMPLES, Elbow, ElbowArc, say_why
from rcilab.app.goal.goal_actions import SetArmAngle
from rcilab.app.text import Text
from rcilab.model.kinematics.solvers.solver import Redundancy
from rcilab.views.elbow_view import ARC_COLORS, free_colors, free_goodness
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

_NARROW = math.radians(5.0)  # [rad] A tuning value: a narrower range hardly lets the elbow move.
_HEIGHT = {"free": 10, "other": 4}  # Of 14; forbidden arcs have the height of their hatching.


class ElbowPanel:
    """Absent for 6-axis arms, which have no arm angle."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[Elbow | None, bool] | None = None

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._psi: BoundControl | None = None
        if not state.model.redundancy:
            return
        with gui.add_folder(text("target.psi_title")):
            gui.add_html('<i class="rl-rows rl-elbow"></i>')
            factor, _ = text.units.from_si("rad")
            step = 1.0 if text.units.angle == "deg" else 0.01
            lowest, highest = (step * int(factor * end / step) for end in _ends(state.model))
            slider = gui.add_slider("ψ", lowest, highest, step, 0.0, hint=text("target.psi_hint"))
            self._psi = BoundControl(slider, ask, lambda v, p: SetArmAngle(page=p, psi=v / factor))
            self._field = NumberField(gui.add_text("", ""), ask, "psi", text.unit("deg"))
            self._ring = Html(gui)
        self._sentence = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the goal."""
        if self._psi is None:
            return
        goal, elbow = state.goal, state.scene.elbow
        if goal.psi is not None:
            is_deg = self._text.units.angle == "deg"
            self._psi.show(float(round(math.degrees(goal.psi))) if is_deg else round(goal.psi, 2))
            self._field.show(shown(math.degrees(goal.psi)), state.problems.get("psi"), state.entered)
        is_nearest = goal.reach.tone == "bad"
        if (elbow, is_nearest) != self._drawn or elbow is None:
            self._drawn = elbow, is_nearest
            self._ring.show(no_ring_html(state.model.redundancy, self._text) if elbow is None
                            else ring_html(elbow, self._text, is_nearest=is_nearest))  # fmt: skip
        sentence = problems_html(state, self._text, [("psi", "ψ")])
        if goal.snapped is not None and not sentence:
            sentence = (
                f'<p class="rl-verdict rl-warn" role="status"><b>▲</b> {esc(self._text.render(goal.snapped))}</p>'
            )
        self._sentence.show(sentence)


def _ends(model: RobotModel) -> tuple[float, float]:
    """Returns the smallest and the largest arm angle, [rad]."""
    joint, limits = model.redundancy.joint, model.limits.joint
    return (-math.pi, math.pi) if joint is None else (float(limits.lower[joint - 1]), float(limits.upper[joint - 1]))


def no_ring_html(redundancy: Redundancy, text: Text) -> str:
    """Returns why there is no circle: the pose has none, or the arm has none."""
    joint = redundancy.joint
    sentence = text("elbow.none") if joint is None else text("elbow.no_circle", joint=joint)
    return f'<p class="rl-note rl-across">{esc(sentence)}</p>'


def ring_html(elbow: Elbow, text: Text, *, is_nearest: bool = False) -> str:
    """Returns the circle from -180 to 180 degrees as a bar, its legend, and the free ranges as text.

    Args:
        elbow: The elbow circle.
        text: The catalogue.
        is_nearest: Whether it belongs to the reachable pose nearest to the target, which is out of reach.
    """
    parts: list[str] = []
    kinds: list[str] = []
    for arc in elbow.arcs:
        title = esc(_title(arc.kind, arc.joints, text))
        kinds += [arc.kind] if arc.kind != "free" else []
        for start, end in _unrolled(arc.start, arc.end):
            left, width = math.degrees(start) + 180.0, math.degrees(end - start)
            if arc.kind == "free":
                shaded, shades = _shaded(start, end, elbow, text)
                parts += shaded
                kinds += shades
            else:
                height = _HEIGHT.get(arc.kind, 10)
                fill = f"url(#rl-arc-{arc.kind})" if arc.kind != "other" else _css(ARC_COLORS["other"])
                parts.append(
                    f'<rect x="{left:.2f}" y="{7 - height / 2:g}" width="{width:.2f}" height="{height}" fill="{fill}">'
                    f"<title>{title}</title></rect>"
                )
    here = math.degrees(elbow.psi) + 180.0
    legend = "".join(
        f'<span class="rl-arc-{kind}">{esc(text(f"elbow.kind.{kind}"))}</span>' for kind in dict.fromkeys(kinds)
    )
    words = _words(elbow, text, is_nearest)
    return (
        f'<div class="rl-ring"><svg viewBox="0 0 360 14" preserveAspectRatio="none" role="img" '
        f'aria-label="{esc(words)}">{_PATTERNS}{"".join(parts)}</svg><i style="left:{here / 3.6:.2f}%"></i></div>'
        f'<div class="rl-arcs">{legend}</div><p class="rl-note rl-dim">{esc(words)}</p>'
    )


def _words(elbow: Elbow, text: Text, is_nearest: bool) -> str:
    """Returns the free ranges; narrow ones are left out, except for the one that contains the arm angle."""
    free = [arc for arc in elbow.arcs if arc.kind == "free"]
    if not any(_is_wide(arc) for arc in free):
        return text("elbow.stretched" if free else "elbow.nowhere")
    listed = [arc for arc in free if _is_wide(arc) or (elbow.psi - arc.start) % math.tau < arc.end - arc.start]
    key = "elbow.free_nearest" if is_nearest else "elbow.free"
    return text(key, ranges=", ".join(_ranges(listed, text)))


def _is_wide(arc: ElbowArc) -> bool:
    return arc.end - arc.start > _NARROW


def _shaded(start: float, end: float, elbow: Elbow, text: Text) -> tuple[list[str], list[str]]:
    """Returns a free arc in pieces, from amber near a singularity to blue-green, and their names in the legend."""
    pieces = max(1, math.ceil((end - start) / math.tau * DEXTERITY_SAMPLES))
    marks = np.linspace(start, end, pieces + 1)
    middles = 0.5 * (marks[:-1] + marks[1:])
    colors = free_colors(middles, elbow.dexterity)
    shades = np.where(free_goodness(middles, elbow.dexterity) < 0.5, "near", "free").tolist()
    width = math.degrees(end - start) / pieces
    drawn = [
        f'<rect x="{math.degrees(mark) + 180.0:.2f}" y="2" width="{width + 0.3:.2f}" height="10" fill="{_css(color)}">'
        f"<title>{esc(text(f'elbow.kind.{shade}'))}</title></rect>"
        for mark, color, shade in zip(marks[:-1].tolist(), colors.tolist(), shades, strict=True)
    ]
    return drawn, shades


def _unrolled(start: float, end: float) -> list[tuple[float, float]]:
    """Returns an arc as ranges within -pi to pi."""
    turn = math.tau * math.floor((start + math.pi) / math.tau)
    start, end = start - turn, end - turn
    return [(start, end)] if end <= math.pi else [(start, math.pi), (-math.pi, end - math.tau)]


def _ranges(arcs: list[ElbowArc], text: Text) -> list[str]:
    """Returns arcs as ranges in the order of the bar: one across the half turn is at both ends."""
    whole = any(arc.end - arc.start > math.tau - 1e-9 for arc in arcs)
    ranges = [(-math.pi, math.pi)] if whole else sorted(r for arc in arcs for r in _unrolled(arc.start, arc.end))
    return [" … ".join(text.units.format_angle(angle, 0) for angle in ends) for ends in ranges]


def _title(kind: str, joints: tuple[int, ...], text: Text) -> str:
    return text.render(say_why(joints)) if joints else text(f"elbow.kind.{kind}")


def _css(color: Any) -> str:
    red, green, blue = (round(value) for value in color)
    return f"rgb({red},{green},{blue})"


def _pattern(kind: str, step: float, shape: str) -> str:
    color = _css(ARC_COLORS[kind])
    return (
        f'<pattern id="rl-arc-{kind}" width="{step:g}" height="10" patternUnits="userSpaceOnUse">'
        f'<rect width="{step:g}" height="10" fill="{color}" opacity="0.16"/>{shape.format(color=color)}</pattern>'
    )


_PATTERNS = "".join(
    (
        _pattern("limits", 5, '<path d="M-1 11L6 -1" stroke="{color}" stroke-width="1.6"/>'),
        _pattern("singular", 4, '<circle cx="2" cy="3" r="1.1" fill="{color}"/>'
                 '<circle cx="2" cy="8" r="1.1" fill="{color}"/>'),
        _pattern("box", 4, '<path d="M2 0V10" stroke="{color}" stroke-width="1.6"/>'),
        _pattern("reach", 6, '<path d="M0 5H3" stroke="{color}" stroke-width="1.2"/>'),
    )
)  # fmt: skip
