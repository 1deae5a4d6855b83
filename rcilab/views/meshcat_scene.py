"""The scene of a notebook: meshcat, inline in a cell or in a browser tab."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.spatial import Pose
from rcilab.views.meshcat_server import MeshcatServer, import_meshcat
from rcilab.views.scene import NO_TURN, ORIGIN, Color, line_points, segment_ends, unknown_node

_CAMERA = [1.25, 0.75, 1.15]  # [m] axes of three.js: x, up, -y; the page's camera always looks at the origin


@dataclass(slots=True)
class _Node:
    wxyz: Sequence[float] = NO_TURN
    position: Sequence[float] = ORIGIN
    geometry: Any = None
    """Geometry of a mesh, for changes of its material."""
    color: Color = (0, 0, 0)
    opacity: float = 1.0


class MeshcatScene:
    """Draws into its own meshcat page, which only this machine can open."""

    def __init__(self) -> None:
        self._server = MeshcatServer()
        self._nodes: dict[str, _Node] = {}
        self.visualizer = import_meshcat().Visualizer(window=self._server)
        """meshcat's handle, for features beyond `Scene`, such as animations."""
        self.visualizer["/Background"].set_property("top_color", [0.78, 0.82, 0.86])
        self.visualizer["/Background"].set_property("bottom_color", [0.98, 0.985, 0.99])
        self.visualizer["/Cameras/default/rotated/<object>"].set_property("position", _CAMERA)

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._server.web_url

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
        g = import_meshcat().geometry

        self._nodes[name] = _Node(wxyz, position)
        if axes_length > 0.0:
            self._at(name).set_object(g.triad(axes_length))
        self._send_transform(name)
        if not visible:
            self.set_visible(name, False)

    def add_mesh(self, name: str, vertices: ArrayLike, faces: ArrayLike, *, color: Color, opacity: float = 1.0) -> None:
        """Adds a triangle mesh; see `Scene`."""
        g = import_meshcat().geometry

        geometry = g.TriangularMeshGeometry(np.asarray(vertices, dtype=np.float32), np.asarray(faces, dtype=np.uint32))
        self._nodes[name] = _Node(geometry=geometry, color=color, opacity=opacity)
        self._send_mesh(name)

    def add_polyline(self, name: str, points: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds a line through points; see `Scene`. WebGL draws it one pixel wide, whatever the thickness."""
        g = import_meshcat().geometry

        path, shades = line_points(points, color)
        geometry = g.PointsGeometry(path.T.astype(np.float32), (shades.T / 255.0).astype(np.float32))
        self._nodes[name] = _Node()
        self._at(name).set_object(g.Line(geometry, g.LineBasicMaterial(vertexColors=True)))

    def add_segments(self, name: str, segments: ArrayLike, *, color: ArrayLike, thickness: float = 0.004) -> None:
        """Adds or moves lines; see `Scene`. WebGL draws them one pixel wide, whatever the thickness."""
        g = import_meshcat().geometry

        ends, shades = segment_ends(segments, color)
        points, colors = ends.reshape(-1, 3).T.astype(np.float32), (shades.reshape(-1, 3).T / 255.0).astype(np.float32)
        self._nodes[name] = _Node()
        material = g.LineBasicMaterial(vertexColors=True)
        self._at(name).set_object(g.LineSegments(g.PointsGeometry(points, colors), material))

    def set_transform(
        self, name: str, *, wxyz: Sequence[float] | None = None, position: Sequence[float] | None = None
    ) -> None:
        """Moves a node; see `Scene`."""
        node = self._node(name)
        node.wxyz = node.wxyz if wxyz is None else wxyz
        node.position = node.position if position is None else position
        self._send_transform(name)

    def set_visible(self, name: str, visible: bool) -> None:
        """Shows or hides a node; see `Scene`."""
        self._node(name)
        self._at(name).set_property("visible", visible)

    def set_style(self, name: str, *, color: Color | None = None, opacity: float | None = None) -> None:
        """Changes the style of a mesh by sending it again; see `Scene`."""
        node = self._node(name)
        node.color = node.color if color is None else color
        node.opacity = node.opacity if opacity is None else opacity
        self._send_mesh(name)

    def remove(self, name: str) -> None:
        """Removes a node and everything below it; see `Scene`."""
        self._node(name)
        self._at(name).delete()
        below = name.rstrip("/") + "/"
        self._nodes = {k: v for k, v in self._nodes.items() if k != name and not k.startswith(below)}

    @contextmanager
    def batch(self) -> Iterator[None]:
        """Does nothing: meshcat has no batches and sends changes at once."""
        yield

    def flush(self) -> None:
        """Waits until all changes have been sent to every open page."""
        self._server.flush()

    def as_html(self) -> str:
        """Returns the scene as one page that needs neither server nor network."""
        return self._server.get_scene()

    def close(self) -> None:
        """Stops the server."""
        self._server.close()

    def _at(self, name: str) -> Any:
        return self.visualizer[name.strip("/")]

    def _node(self, name: str) -> _Node:
        try:
            return self._nodes[name]
        except KeyError:
            raise unknown_node(name) from None

    def _send_transform(self, name: str) -> None:
        node = self._nodes[name]
        self._at(name).set_transform(Pose(node.position, node.wxyz).matrix)

    def _send_mesh(self, name: str) -> None:
        g = import_meshcat().geometry

        node = self._nodes[name]
        red, green, blue = node.color
        solid = node.opacity >= 1.0
        material = g.MeshLambertMaterial(
            color=(red << 16) | (green << 8) | blue, opacity=node.opacity, transparent=not solid
        )
        self._at(name).set_object(node.geometry, material)
