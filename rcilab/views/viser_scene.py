"""The scene of the page: the scene tree of a viser server."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.views.scene import NO_TURN, ORIGIN, Color, line_points, segment_ends, unknown_node
from rcilab.views.viser_ext.orientation import set_orientation

if TYPE_CHECKING:
    import viser


class ViserScene:
    """Draws into a viser server, or into the private scene of one client.

    Meshes are added by `add_mesh_simple`: coloured trimesh nodes are nearly black without an environment map.

    Args:
        server: A `viser.ViserServer` or `viser.ClientHandle`.
        shadows: Whether meshes cast and receive shadows; False is faster with software rendering.
    """

    def __init__(self, server: viser.ViserServer | viser.ClientHandle, *, shadows: bool = True) -> None:
        self._server = server
        self._shadows = shadows
        self._handles: dict[str, Any] = {}

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
        self._handles[name] = self._server.scene.add_frame(
            name,
            show_axes=axes_length > 0.0,
            axes_length=axes_length,
            axes_radius=0.025 * axes_length,
            origin_radius=0.05 * axes_length,
            wxyz=np.asarray(wxyz),
            position=np.asarray(position),
            visible=visible,
        )
        # A page retains the pose of a removed node of the same name, and viser does not send a pose that equals the
        # default. Setting another pose first makes viser send it.
        handle = self._handles[name]
        handle.wxyz, handle.position = (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, -1.0)
        handle.wxyz, handle.position = np.asarray(wxyz), np.asarray(position)

    def add_mesh(self, name: str, vertices: ArrayLike, faces: ArrayLike, *, color: Color, opacity: float = 1.0) -> None:
        """Adds a triangle mesh; see `Scene`. A translucent mesh casts no shadow."""
        self._handles[name] = self._server.scene.add_mesh_simple(
            name,
            np.asarray(vertices, dtype=np.float32),
            np.asarray(faces, dtype=np.uint32),
            color=color,
            opacity=_viser_opacity(opacity),
            cast_shadow=self._shadows and opacity >= 1.0,
            receive_shadow=self._shadows and opacity >= 1.0,
        )

    def add_polyline(self, name: str, points: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds a line through points; see `Scene`."""
        path, shades = line_points(points, color)
        self._handles[name] = self._server.scene.add_line_segments(
            name,
            np.stack([path[:-1], path[1:]], axis=1).astype(np.float32),
            np.stack([shades[:-1], shades[1:]], axis=1),
            thickness=thickness,
        )

    def add_segments(self, name: str, segments: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds or moves lines; see `Scene`. Unchanged arrays are not sent."""
        ends, shades = segment_ends(segments, color)
        points, shades = ends.astype(np.float32), _line_colors(shades)
        handle = self._handles.get(name)
        if handle is None or handle.points.shape != points.shape:
            self._handles[name] = self._server.scene.add_line_segments(name, points, shades, thickness=thickness)
            return
        if not np.array_equal(handle.points, points):
            handle.points = points
        if not np.array_equal(handle.colors, shades):
            handle.colors = shades

    def set_transform(
        self, name: str, *, wxyz: Sequence[float] | None = None, position: Sequence[float] | None = None
    ) -> None:
        """Moves a node; see `Scene`."""
        handle = self._handle(name)
        if wxyz is not None:
            set_orientation(handle, wxyz)
        if position is not None:
            handle.position = position

    def set_visible(self, name: str, visible: bool) -> None:
        """Shows or hides a node; see `Scene`."""
        self._handle(name).visible = visible

    def set_style(self, name: str, *, color: Color | None = None, opacity: float | None = None) -> None:
        """Changes the style of a mesh; see `Scene`."""
        handle = self._handle(name)
        if color is not None:
            handle.color = color
        if opacity is not None:
            handle.opacity = _viser_opacity(opacity)

    def on_drag(self, name: str, callback: Callable[[Any], Coroutine[Any, Any, None]]) -> None:
        """Registers a callback for a mesh that is dragged with the mouse; such a drag does not move the camera.

        Args:
            name: Name of the mesh.
            callback: Called with viser's `SceneNodeDragEvent`, on the server's event loop.
        """
        self._handle(name).on_drag(callback)

    def on_click(self, name: str, callback: Callable[[Any], Coroutine[Any, Any, None]]) -> None:
        """Registers a callback for a mesh that is clicked.

        Args:
            name: Name of the mesh.
            callback: Called with viser's `SceneNodePointerEvent`, on the server's event loop.
        """
        self._handle(name).on_click(callback)

    def ignore_drag(self, name: str) -> None:
        """Removes the drag callback of a mesh; a drag on it moves the camera again."""
        self._handle(name).remove_drag_callback()

    def remove(self, name: str) -> None:
        """Removes a node and everything below it; see `Scene`."""
        self._handle(name).remove()
        below = name.rstrip("/") + "/"
        self._handles = {k: v for k, v in self._handles.items() if k != name and not k.startswith(below)}

    @contextmanager
    def batch(self) -> Iterator[None]:
        """Sends the changes together. viser counts batches globally: a thread in a batch delays those of all others."""
        with self._server.atomic():
            yield

    def _handle(self, name: str) -> Any:
        try:
            return self._handles[name]
        except KeyError:
            raise unknown_node(name) from None


def _line_colors(colors: np.ndarray) -> np.ndarray:
    """Returns line colours converted to linear light, as which viser's page interprets them."""
    return np.round(255.0 * (colors / 255.0) ** 2.2).astype(np.uint8)


def _viser_opacity(opacity: float) -> float | None:
    """Returns the opacity for viser: None for a solid mesh, which is then not drawn in the transparent pass."""
    return None if opacity >= 1.0 else max(0.0, float(opacity))
