"""The interface of a 3D scene, independent of the library that displays it.

A scene is a tree of named nodes. A name is a path, "/live/joint1/joint2", and a node moves with the nodes above it.
Three implementations: `ViserScene` (the page), `MeshcatScene` (notebooks), `NullScene` (headless, stores the nodes). A
scene belongs to the thread that draws; its methods must not be called from two threads at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.errors import UsageError

Color: TypeAlias = tuple[int, int, int]
"""Red, green, blue, 0-255."""

NO_TURN = (1.0, 0.0, 0.0, 0.0)
ORIGIN = (0.0, 0.0, 0.0)


@runtime_checkable
class Scene(Protocol):
    """A tree of frames, meshes and lines that can be moved, hidden, tinted and removed by name."""

    def add_frame(
        self,
        name: str,
        *,
        wxyz: Sequence[float] = NO_TURN,
        position: Sequence[float] = ORIGIN,
        axes_length: float = 0.0,
        visible: bool = True,
    ) -> None:
        """Adds a coordinate frame, or replaces the node of that name.

        Args:
            name: Path of the node.
            wxyz: Orientation in the node above, unit quaternion.
            position: Origin in the node above, [m].
            axes_length: Length of the drawn axes, [m]; 0 draws none.
            visible: Whether the node and everything below it is shown.
        """
        ...

    def add_mesh(self, name: str, vertices: ArrayLike, faces: ArrayLike, *, color: Color, opacity: float = 1.0) -> None:
        """Adds a triangle mesh, or replaces the node of that name.

        Args:
            name: Path of the node.
            vertices: Shape (V, 3), in the node above, [m].
            faces: Indices into `vertices`, counter-clockwise seen from outside, shape (F, 3).
            color: Colour of the whole mesh.
            opacity: From 0, invisible, to 1, solid.
        """
        ...

    def add_polyline(self, name: str, points: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds a line through points, or replaces the node of that name.

        Args:
            name: Path of the node.
            points: Shape (N, 3), N >= 2, in the node above, [m].
            color: One RGB colour, shape (3,), or one per point, shape (N, 3), 0-255.
            thickness: [m].
        """
        ...

    def add_segments(self, name: str, segments: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds separate lines, or moves those of that name, which is cheap if their number is unchanged.

        Args:
            name: Path of the node.
            segments: Start and end of each, shape (N, 2, 3), N >= 1, in the node above, [m].
            color: One RGB colour, shape (3,), or one per end, shape (N, 2, 3), 0-255.
            thickness: [m]; unchanged if lines of that name are moved.
        """
        ...

    def set_transform(
        self, name: str, *, wxyz: Sequence[float] | None = None, position: Sequence[float] | None = None
    ) -> None:
        """Sets the transform of a node in the node above it; None leaves a part unchanged."""
        ...

    def set_visible(self, name: str, visible: bool) -> None:
        """Shows or hides a node and everything below it."""
        ...

    def set_style(self, name: str, *, color: Color | None = None, opacity: float | None = None) -> None:
        """Changes the colour or the opacity of a mesh; None leaves it unchanged."""
        ...

    def remove(self, name: str) -> None:
        """Removes a node and everything below it."""
        ...

    def batch(self) -> AbstractContextManager[None]:
        """Returns a context manager whose changes are shown together, in one frame. Keep the block short."""
        ...


def line_points(points: ArrayLike, color: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Returns checked points, shape (N, 3), and one colour for each of them, shape (N, 3), for `add_polyline`.

    Raises:
        UsageError: Fewer than two points, or colours that fit neither one point nor all of them.
    """
    path = np.asarray(points, dtype=np.float64)
    if path.ndim != 2 or path.shape[0] < 2 or path.shape[1] != 3:
        raise UsageError(f"a polyline needs points of shape (N, 3) with N >= 2, got shape {path.shape}")
    shades = np.asarray(color, dtype=np.float64)
    if shades.shape not in ((3,), path.shape):
        raise UsageError(f"colours of shape {shades.shape} fit neither one line, (3,), nor its points, {path.shape}")
    return path, np.broadcast_to(shades, path.shape).astype(np.uint8)


def segment_ends(segments: ArrayLike, color: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Returns checked ends, shape (N, 2, 3), and one colour for each of them, of the same shape, for `add_segments`.

    Raises:
        UsageError: No segment, or colours that fit neither all of them nor each end.
    """
    ends = np.asarray(segments, dtype=np.float64)
    if ends.ndim != 3 or not len(ends) or ends.shape[1:] != (2, 3):
        raise UsageError(f"segments need shape (N, 2, 3) with N >= 1, got shape {ends.shape}")
    shades = np.asarray(color, dtype=np.float64)
    if shades.shape not in ((3,), ends.shape):
        raise UsageError(
            f"colours of shape {shades.shape} fit neither all segments, (3,), nor their ends, {ends.shape}"
        )
    return ends, np.broadcast_to(shades, ends.shape).astype(np.uint8)


def unknown_node(name: str) -> UsageError:
    """Returns the error for a node that was never added or was removed."""
    return UsageError(f"the scene has no node {name!r}; add it first, and do not use it after remove()")
