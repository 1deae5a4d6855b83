"""The circle of a 7-axis arm's elbow in a scene: a ring of arcs, free or forbidden by pattern and colour.

Nodes: ROOT/free, a thick band, blue-green where the tool moves well and amber towards a singularity; ROOT/other, a
thin line where only another way of standing is free; ROOT/limits, ROOT/singular, ROOT/box, ROOT/reach, forbidden, each
with dashes of its own length; ROOT/spoke from the elbow to its handle.
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
"""How far outside the elbow's circle the ring is drawn, [m]: clear of the housings."""
ARC_COLORS: dict[str, Color] = {
    "free": (18, 150, 132),
    "other": (120, 175, 205),
    "limits": (214, 48, 38),
    "singular": (126, 64, 190),
    "box": (24, 118, 210),
    "reach": (120, 130, 145),
}
"""By kind of arc; each has a pattern of its own as well."""

_PIECES = 120  # Three degrees each.
_THICK = {"free": 0.016, "other": 0.006}  # [m]
_FORBIDDEN_THICK = 0.009  # [m]
_DASHES = {"limits": (4.0, 3.0), "singular": (1.2, 2.4), "box": (7.0, 2.5), "reach": (2.0, 5.0)}  # [deg] on, off
_POOR, _GOOD = 0.03, 0.14  # Smallest singular value that is drawn amber, and from which on it is blue-green.
_AMBER = (240, 150, 20)
_SPOKE = (70, 84, 102)


class DrawableArc(Protocol):
    """What is drawn of an arc."""

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
        scene: Where to draw.
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
            circle: Where the elbow goes round.
            psi: Where it is, [rad].
            arcs: All the way round.
            dexterity: Smallest singular values at equally spaced arm angles from -pi on, shape (N,).
        """
        by_kind: dict[str, list[tuple[float, float]]] = {kind: [] for kind in ARC_COLORS}
        for arc in arcs:
            by_kind[arc.kind] += _strokes(arc.kind, arc.start, arc.end)
        with self._scene.batch():
            for kind, strokes in by_kind.items():
                self._see(kind, bool(strokes))
                if not strokes and kind in self._drawn:
                    continue  # A page would draw lines without length like any others.
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
        """Shows or hides it."""
        if visible != self._shown:
            self._shown = visible
            self._scene.set_visible(self.root, visible)

    def remove(self) -> None:
        """Takes it out of the scene."""
        self._scene.remove(self.root)

    def _see(self, kind: str, visible: bool) -> None:
        if kind in self._drawn and visible == (kind in self._hidden):
            self._hidden ^= {kind}
            self._scene.set_visible(f"{self.root}/{kind}", visible)


def free_colors(psi: Array, dexterity: Array) -> Array:
    """Returns colours from amber (next to a singularity) to blue-green (the tool moves well), shape (*psi.shape, 3).

    Args:
        psi: Arm angles, [rad].
        dexterity: Smallest singular values at equally spaced arm angles from -pi on, shape (N,).
    """
    good = free_goodness(psi, dexterity)[..., None]
    return good * np.array(ARC_COLORS["free"], dtype=float) + (1.0 - good) * np.array(_AMBER, dtype=float)


def free_goodness(psi: Array, dexterity: Array) -> Array:
    """Returns how well the tool moves, from 0 (drawn amber) to 1 (blue-green), for arguments as of `free_colors`."""
    known = np.nan_to_num(dexterity)
    place = (psi + math.pi) / math.tau * len(known)
    low = np.floor(place).astype(np.intp)
    share = place - low
    value = (1.0 - share) * known[low % len(known)] + share * known[(low + 1) % len(known)]
    return np.clip((value - _POOR) / (_GOOD - _POOR), 0.0, 1.0)


def _strokes(kind: str, start: float, end: float) -> list[tuple[float, float]]:
    """Returns the pieces that an arc is drawn in, [rad]; all round, a kind has at most `_PIECES` of them."""
    if kind not in _DASHES:
        pieces = max(1, math.ceil((end - start) / math.tau * (_PIECES - 20)))
        marks = np.linspace(start, end, pieces + 1).tolist()
        return list(itertools.pairwise(marks))
    on, off = (math.radians(angle) for angle in _DASHES[kind])
    marks = np.arange(start, end, on + off).tolist()
    return [(mark, min(mark + on, end)) for mark in marks]


def _fill(strokes: list[tuple[float, float]]) -> Array:
    """Returns always as many strokes, shape (_PIECES, 2): the rest have no length. A page then only moves points."""
    some = strokes[:_PIECES] or [(0.0, 0.0)]
    last = some[-1][1]
    return np.array(some + [(last, last)] * (_PIECES - len(some)))
