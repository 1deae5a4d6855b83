"""A scene without a display, which stores the drawn nodes, for headless use and tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, as_vector, readonly_copy
from rcilab.views.scene import NO_TURN, ORIGIN, Color, line_points, segment_ends, unknown_node


@dataclass(slots=True)
class DrawnNode:
    """Current state of one node; owned by its scene."""

    kind: Literal["frame", "mesh", "polyline", "segments"]
    wxyz: Sequence[float] = NO_TURN
    position: Sequence[float] = ORIGIN
    visible: bool = True
    color: Color = (0, 0, 0)
    opacity: float = 1.0
    points: Array | None = None
    """Vertices of a mesh or points of lines, shape (N, 3), [m]."""
    triangles: int = 0


class NullScene:
    """Stores nodes by name and counts moves and batches."""

    def __init__(self) -> None:
        self.nodes: dict[str, DrawnNode] = {}
        self.moves = 0
        """Number of `set_transform` calls so far."""
        self.batches = 0
        """Number of batches so far."""

    def add_frame(
        self,
        name: str,
        *,
        wxyz: Sequence[float] = NO_TURN,
        position: Sequence[float] = ORIGIN,
        axes_length: float = 0.0,
        visible: bool = True,
    ) -> None:
        """Adds a coordinate frame; see `Scene`."""
        self.nodes[name] = DrawnNode("frame", tuple(wxyz), tuple(position), visible)

    def add_mesh(self, name: str, vertices: ArrayLike, faces: ArrayLike, *, color: Color, opacity: float = 1.0) -> None:
        """Adds a mesh; see `Scene`."""
        count = len(np.asarray(faces))
        self.nodes[name] = DrawnNode(
            "mesh", color=color, opacity=opacity, points=readonly_copy(vertices), triangles=count
        )

    def add_polyline(self, name: str, points: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds a line; see `Scene`."""
        path, shades = line_points(points, color)
        red, green, blue = (int(value) for value in shades[0])
        self.nodes[name] = DrawnNode("polyline", color=(red, green, blue), points=readonly_copy(path))

    def add_segments(self, name: str, segments: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds lines; see `Scene`."""
        ends, shades = segment_ends(segments, color)
        red, green, blue = (int(value) for value in shades[0, 0])
        self.nodes[name] = DrawnNode("segments", color=(red, green, blue), points=readonly_copy(ends.reshape(-1, 3)))

    def set_transform(
        self, name: str, *, wxyz: Sequence[float] | None = None, position: Sequence[float] | None = None
    ) -> None:
        """Moves a node; see `Scene`."""
        node = self._node(name)
        self.moves += 1
        if wxyz is not None:
            node.wxyz = as_vector(wxyz, 4, "wxyz").tolist()
        if position is not None:
            node.position = as_vector(position, 3, "position", "m").tolist()

    def set_visible(self, name: str, visible: bool) -> None:
        """Shows or hides a node; see `Scene`."""
        self._node(name).visible = visible

    def set_style(self, name: str, *, color: Color | None = None, opacity: float | None = None) -> None:
        """Changes the style of a mesh; see `Scene`."""
        node = self._node(name)
        node.color = node.color if color is None else color
        node.opacity = node.opacity if opacity is None else opacity

    def remove(self, name: str) -> None:
        """Removes a node and everything below it; see `Scene`."""
        self._node(name)
        below = name.rstrip("/") + "/"
        self.nodes = {k: v for k, v in self.nodes.items() if k != name and not k.startswith(below)}

    @contextmanager
    def batch(self) -> Iterator[None]:
        """Counts the batches; see `Scene`."""
        self.batches += 1
        yield

    def is_shown(self, name: str) -> bool:
        """Returns whether a node and everything above it is visible."""
        self._node(name)
        parts = name.strip("/").split("/")
        above = ("/" + "/".join(parts[:depth]) for depth in range(1, len(parts) + 1))
        return all(self.nodes[path].visible for path in above if path in self.nodes)

    def _node(self, name: str) -> DrawnNode:
        try:
            return self.nodes[name]
        except KeyError:
            raise unknown_node(name) from None
