"""The elbow circle of a 7-axis arm in a scene: a ring of free and forbidden arcs with their own patterns and colours.

Nodes: ROOT/free, a thick band from blue-green to amber near a singularity; ROOT/other, a thin line where only another
branch is free; ROOT/limits, ROOT/singular, ROOT/box, ROOT/reach, forbidden, each with its own dashes; ROOT/spoke from
the elbow to its handle.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from typing import Protocol

import numpy as np

from rcilab.core.arrays import Array
from rcilab.model.kinematics.elbow_circle import ElbowCircle
from rcilab.views.scene import Color, Scene

OUTWARD = 0.105
"""Distance of the drawn ring from the elbow's circle, [m], clear of the housings."""
ARC_COLORS: dict[str, Color] = {
    "free": (18, 150, 132),
    "other": (120, 175, 205),
    "limits": (214, 48, 38),
    "singular": (126, 64, 190),
    "box": (24, 118, 210),
    "reach": (120, 130, 145),
}
"""By kind of arc; each kind also has its own pattern."""

_PIECES = 120  # Three degrees each.
_THICK = {"free": 0.016, "other": 0.006}  # [m]
_FORBIDDEN_THICK = 0.009  # [m]
_DASHES = {"limits": (4.0, 3.0), "singular": (1.2, 2.4), "box": (7.0, 2.5), "reach": (2.0, 5.0)}  # [deg] on, off
_POOR, _GOOD = 0.03, 0.14  # Smallest singular values of the Jacobian that are drawn amber, and blue-green.
_AMBER = (240, 150, 20)
_SPOKE = (70, 84, 102)


class DrawableArc(Protocol):
    """The part of an arc that is drawn."""

    @property
    def start(self) -> float:
        """[rad]."""
        ...

    @property
    def end(self) -> float:
        """[rad]."""
        ...

    @property
    def kind(self) -> str:
        """A key of `ARC_COLORS`."""
        ...


class ElbowView:
    """Draws one ring. Owned by the thread that draws.

    Args:
        scene: The scene.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.root = scene, "/elbow"
        self._shown = False
        self._drawn: set[str] = set()
        self._hidden: set[str] = set()
        scene.add_frame(self.root, visible=False)

    def show(self, circle: ElbowCircle, psi: float, arcs: Iterable[DrawableArc], dexterity: Array) -> None:
        """Draws the ring.

        Args:
            circle: The circle of the elbow.
            psi: Arm angle, [rad].
            arcs: Arcs that cover the whole circle.
            dexterity: Smallest singular values at equally spaced arm angles from -pi on, shape (N,).
        """
        by_kind: dict[str, list[tuple[float, float]]] = {kind: [] for kind in ARC_COLORS}
        for arc in arcs:
            by_kind[arc.kind] += _strokes(arc.kind, arc.start, arc.end)
        with self._scene.batch():
            for kind, strokes in by_kind.items():
                self._show_kind(kind, bool(strokes))
                if not strokes and kind in self._drawn:
                    continue  # A page would draw dots for lines without length.
                self._drawn.add(kind)
                ends = _fill(strokes)
                points = circle.points(ends.ravel(), OUTWARD).reshape(-1, 2, 3)
                colors = np.broadcast_to(np.array(ARC_COLORS[kind], dtype=float), points.shape)
                if kind == "free":
                    colors = free_colors(ends, dexterity)
                thickness = _THICK.get(kind, _FORBIDDEN_THICK)
                self._scene.add_segments(f"{self.root}/{kind}", points, color=colors, thickness=thickness)
            spoke = np.concatenate((circle.points(psi), circle.points(psi, OUTWARD)))
            self._scene.add_segments(f"{self.root}/spoke", spoke[None], color=_SPOKE, thickness=0.005)
            self.set_visible(True)

    def set_visible(self, visible: bool) -> None:
        """Shows or hides the ring."""
        if visible != self._shown:
            self._shown = visible
            self._scene.set_visible(self.root, visible)

    def remove(self) -> None:
        """Removes the ring from the scene."""
        self._scene.remove(self.root)

    def _show_kind(self, kind: str, visible: bool) -> None:
        if kind in self._drawn and visible == (kind in self._hidden):
            self._hidden ^= {kind}
            self._scene.set_visible(f"{self.root}/{kind}", visible)


def free_colors(psi: Array, dexterity: Array) -> Array:
    """Returns colours from amber (near a singularity) to blue-green, shape (*psi.shape, 3).

    Args:
        psi: Arm angles, [rad].
        dexterity: Smallest singular values at equally spaced arm angles from -pi on, shape (N,).
    """
    good = free_goodness(psi, dexterity)[..., None]
    return good * np.array(ARC_COLORS["free"], dtype=float) + (1.0 - good) * np.array(_AMBER, dtype=float)


def free_goodness(psi: Array, dexterity: Array) -> Array:
    """Returns the distance from singularities, from 0 (amber) to 1 (blue-green); arguments as for `free_colors`."""
    known = np.nan_to_num(dexterity)
    position = (psi + math.pi) / math.tau * len(known)
    low = np.floor(position).astype(np.intp)
    share = position - low
    value = (1.0 - share) * known[low % len(known)] + share * known[(low + 1) % len(known)]
    return np.clip((value - _POOR) / (_GOOD - _POOR), 0.0, 1.0)


def _strokes(kind: str, start: float, end: float) -> list[tuple[float, float]]:
    """Returns the strokes of an arc, [rad]; for the whole circle, at most `_PIECES`."""
    if kind not in _DASHES:
        pieces = max(1, math.ceil((end - start) / math.tau * (_PIECES - 20)))
        marks = np.linspace(start, end, pieces + 1).tolist()
        return list(itertools.pairwise(marks))
    on, off = (math.radians(angle) for angle in _DASHES[kind])
    marks = np.arange(start, end, on + off).tolist()
    return [(mark, min(mark + on, end)) for mark in marks]


def _fill(strokes: list[tuple[float, float]]) -> Array:
    """Pads strokes to shape (_PIECES, 2) with ones of length 0, so that a page only has to move points."""
    some = strokes[:_PIECES] or [(0.0, 0.0)]
    last = some[-1][1]
    return np.array(some + [(last, last)] * (_PIECES - len(some)))
