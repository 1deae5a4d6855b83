"""The configuration of an arm in a scene: safety box, tool, load, force-control frame.

Node names: /safety_box with its faces and edges, and below the flange of the arm setup_tool, setup_load, setup_force.
Each of the four is shown or hidden separately, and redrawn only after a change.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.robots.mesh import Mesh, revolve
from rcilab.views.scene import Color, Scene

BOX_COLOR: Color = (24, 118, 210)
BOX_OFF_COLOR: Color = (120, 130, 145)
TOOL_COLOR: Color = (246, 140, 30)
LOAD_COLOR: Color = (126, 87, 194)
FORCE_COLOR: Color = (0, 150, 136)

_AXES = 0.09  # [m] Length of the drawn axes.
_CONE = (0.018, 0.055)  # [m] Radius and height of the cone along the tool's axis.
_SPHERE = 0.014  # [m] Radius of the ball at the centre of mass.
_THINNEST, _WIDEST = 0.004, 0.4  # [m] Limits of the drawn half-axes of the inertia ellipsoid.
_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4)])
_FACES = np.array(
    [
        (3, 1, 0), (2, 3, 0), (7, 6, 4), (5, 7, 4), (5, 4, 0), (1, 5, 0),
        (7, 3, 2), (6, 7, 2), (6, 2, 0), (4, 6, 0), (7, 5, 1), (3, 7, 1),
    ]
)  # fmt: skip
"""Oriented inwards, so that only the far walls are drawn: a near one would hide translucent arms drawn after it."""


class ConfigurationView:
    """Draws one configuration. Owned by the thread that draws.

    Args:
        scene: The scene.
        flange: Name of the flange's node, see `ArmView`.
    """

    def __init__(self, scene: Scene, flange: str) -> None:
        self._scene = scene
        self._tool, self._load, self._force = (f"{flange}/setup_{part}" for part in ("tool", "load", "force"))
        self._box = "/safety_box"
        self._drawn: dict[str, object] = {}
        for name in (self._box, self._tool, self._load, self._force):
            scene.add_frame(name, visible=False)
        for name, color in ((self._tool, TOOL_COLOR), (self._force, FORCE_COLOR)):
            scene.add_frame(f"{name}/axes", axes_length=_AXES)
            if name == self._tool:
                cone = _cone(*_CONE)
                scene.add_mesh(f"{name}/cone", cone.vertices, cone.faces, color=color, opacity=0.9)
            scene.add_polyline(f"{name}/ring", _ring(0.035), color=color, thickness=0.004)

    def show_box(self, box: SafetyBox | None) -> None:
        """Shows the safety box, grey if it is not active; None hides it."""
        if self._is_drawn(self._box, box):
            return
        self._scene.set_visible(self._box, box is not None)
        if box is None:
            return
        color = BOX_COLOR if box.active else BOX_OFF_COLOR
        corners = _corners(box.size)
        with self._scene.batch():
            self._set_pose(self._box, box.T_base_box)
            faces = f"{self._box}/faces"
            self._scene.add_mesh(faces, corners, _FACES, color=color, opacity=0.10 if box.active else 0.0)
            for number, (a, b) in enumerate(_EDGES):
                edge = f"{self._box}/edge{number}"
                self._scene.add_polyline(edge, corners[[a, b]], color=color, thickness=0.006 if box.active else 0.003)

    def show_tool(self, T_flange_tool: Pose | None) -> None:
        """Shows the tool's frame, a cone along its z axis and a line to it from the flange; None hides it."""
        if self._is_drawn(self._tool, T_flange_tool):
            return
        self._scene.set_visible(self._tool, T_flange_tool is not None)
        if T_flange_tool is None:
            return
        with self._scene.batch():
            self._set_pose(self._tool, T_flange_tool)
            line = np.array((T_flange_tool.inverse().position, (0.0, 0.0, 0.0)))
            self._scene.add_polyline(f"{self._tool}/line", line, color=TOOL_COLOR, thickness=0.006)

    def show_load(self, load: Payload | None) -> None:
        """Shows the centre of mass as a ball and the inertia as an ellipsoid of uniform density; None hides them."""
        if self._is_drawn(self._load, load):
            return
        self._scene.set_visible(self._load, load is not None)
        if load is None:
            return
        axes, radii = inertia_ellipsoid(load)
        ball = unit_ball()
        with self._scene.batch():
            self._set_pose(self._load, Pose(load.center_of_mass))
            self._scene.add_mesh(f"{self._load}/center", ball.vertices * _SPHERE, ball.faces, color=LOAD_COLOR)
            body = ball.vertices * np.clip(radii, _THINNEST, _WIDEST) @ axes.T
            opacity = 0.35 if radii.max() > 0.0 else 0.0
            self._scene.add_mesh(f"{self._load}/inertia", body, ball.faces, color=LOAD_COLOR, opacity=opacity)

    def show_force(self, T_flange_force: Pose | None) -> None:
        """Shows the force-control frame; None hides it."""
        if self._is_drawn(self._force, T_flange_force):
            return
        self._scene.set_visible(self._force, T_flange_force is not None)
        if T_flange_force is not None:
            self._set_pose(self._force, T_flange_force)

    def remove_box(self) -> None:
        """Removes the box from the scene; the other three are removed with the arm."""
        self._scene.remove(self._box)

    def _set_pose(self, name: str, pose: Pose) -> None:
        self._scene.set_transform(name, wxyz=pose.wxyz.tolist(), position=pose.position.tolist())

    def _is_drawn(self, name: str, value: object) -> bool:
        if self._drawn.get(name) is value:
            return True
        self._drawn[name] = value
        return False


def inertia_ellipsoid(load: Payload) -> tuple[Array, Array]:
    """Returns the solid ellipsoid of uniform density with the inertia of a load.

    Returns:
        Its axes as columns, flange axes, shape (3, 3), a proper rotation, and its half-axes, shape (3,), [m]; zeros
        without mass or inertia.
    """
    moments, axes = np.linalg.eigh(load.inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    if load.mass <= 0.0:
        return axes, np.zeros(3)
    squares = 2.5 / load.mass * (moments.sum() - 2.0 * moments)  # I_x = m (b^2 + c^2) / 5
    return axes, np.sqrt(np.maximum(squares, 0.0))


def _corners(size: tuple[float, ...]) -> Array:
    return np.array(list(product((-0.5, 0.5), repeat=3))) * np.array(size)


def _ring(radius: float) -> Array:
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(33)], axis=1)


def _cone(radius: float, height: float) -> Mesh:
    return revolve([(0.0, -height), (radius, -height), (0.0, 0.0)], segments=32)


def unit_ball() -> Mesh:
    """Returns a sphere of radius 1, [m]."""
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17)
    profile = [(max(float(np.cos(a)), 0.0), float(np.sin(a))) for a in angles]
    return revolve(profile, segments=32)


def outside_runs(path: Array, box: SafetyBox | None) -> list[Array]:
    """Returns the parts of a path outside a box, each at least two points, shape (M, 3), [m].

    Args:
        path: Positions of the tool, shape (N, 3), [m].
        box: The safety box; None or an inactive one gives no parts.
    """
    if box is None or not box.active:
        return []
    beyond = np.flatnonzero(box.excess_path(path) >= 0.0)
    if not beyond.size:
        return []
    breaks = [0, *(np.flatnonzero(np.diff(beyond) > 1) + 1), len(beyond)]
    runs = [beyond[a:b] for a, b in pairwise(breaks)]
    return [path[max(run[0] - 1, 0) : max(run[-1] + 1, 2)] for run in runs]  # From the last point inside it.
