"""A cell in a scene: its obstacles, and its frames.

Node names: /cell/obstacle0, /cell/frame0 and so on. Tool and part are drawn on the flange of an arm, see `ArmView`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Shape, Solid
from rcilab.core.spatial import Pose
from rcilab.robots.mesh import Mesh, merge_meshes, revolve
from rcilab.views.configuration_view import unit_ball
from rcilab.views.scene import Color, Scene

OBSTACLE_COLOR: Color = (148, 158, 172)
WORKPIECE_COLOR: Color = (96, 150, 190)
TOUCHED_COLOR: Color = (214, 48, 38)

_AXES = 0.1  # [m] Length of the drawn axes of a frame.
_WALL = 2.0  # [m] Half the edge of the drawn part of an infinite wall.
_WALL_OPACITY = 0.35


class CellView:
    """Draws one cell. Owned by the thread that draws.

    Args:
        scene: The scene.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._root = "/cell"
        self._obstacles: list[tuple[Obstacle, Pose, Color]] = []
        self._frames: list[tuple[str, Pose]] = []
        scene.add_frame(self._root)

    def show(self, cell: Cell | None, touched: str = "") -> None:
        """Draws the changes of a cell.

        Args:
            cell: The cell; None hides it.
            touched: Name of the obstacle that a motion touches.
        """
        obstacles = (
            [] if cell is None else [(o, cell.solid(o.name).pose, _color(cell, o, touched)) for o in cell.obstacles]
        )
        frames = [] if cell is None else [(frame.name, cell.T_base(frame.name)) for frame in cell.frames]
        with self._scene.batch():
            self._show_obstacles(obstacles)
            self._show_frames(frames)

    def obstacle_node(self, index: int) -> str:
        """Returns the name of the mesh of an obstacle."""
        return f"{self._root}/obstacle{index}"

    def remove(self) -> None:
        """Removes the cell from the scene."""
        self._scene.remove(self._root)

    def _show_obstacles(self, wanted: list[tuple[Obstacle, Pose, Color]]) -> None:
        for index in range(len(wanted), len(self._obstacles)):
            self._scene.remove(self.obstacle_node(index))
        drawn = self._obstacles[: len(wanted)]
        for index, (obstacle, pose, color) in enumerate(wanted):
            node = self.obstacle_node(index)
            before = drawn[index] if index < len(drawn) else None
            if before is None or before[0].shape != obstacle.shape:
                mesh = shape_mesh(obstacle.shape)
                opacity = _WALL_OPACITY if isinstance(obstacle.shape, Plane) else 1.0
                self._scene.add_mesh(node, mesh.vertices, mesh.faces, color=color, opacity=opacity)
                before = None
            elif before[2] != color:
                self._scene.set_style(node, color=color)
            if before is None or not before[1].is_close(pose, 0.0):
                self._scene.set_transform(node, wxyz=pose.wxyz.tolist(), position=pose.position.tolist())
        self._obstacles = wanted

    def _show_frames(self, wanted: list[tuple[str, Pose]]) -> None:
        for index in range(len(wanted), len(self._frames)):
            self._scene.remove(f"{self._root}/frame{index}")
        for index, (_, pose) in enumerate(wanted):
            node = f"{self._root}/frame{index}"
            if index >= len(self._frames):
                self._scene.add_frame(node, axes_length=_AXES)
            elif self._frames[index][1].is_close(pose, 0.0):
                continue
            self._scene.set_transform(node, wxyz=pose.wxyz.tolist(), position=pose.position.tolist())
        self._frames = wanted


def carried_mesh(cell: Cell | None, T_flange_tool: Pose) -> Mesh | None:
    """Returns tool and held part of a cell as one mesh in the flange frame; None if the arm carries neither."""
    if cell is None:
        return None
    solids = [] if cell.tool is None else list(cell.tool.solids_at())
    if cell.part is not None:
        solids += cell.part.at_flange(T_flange_tool)[1]
    return merge_meshes([solid_mesh(solid) for solid in solids]) if solids else None


def solid_mesh(solid: Solid) -> Mesh:
    """Returns a solid as a mesh, in the frame of what it belongs to."""
    mesh, pose = shape_mesh(solid.shape), solid.pose
    return Mesh(mesh.vertices @ pose.rotation.T + pose.position, mesh.faces)


@lru_cache(maxsize=256)
def shape_mesh(shape: Shape) -> Mesh:
    """Returns a shape as a mesh in its frame; of an infinite wall, a square."""
    if isinstance(shape, MeshShape):
        return Mesh(shape.vertices, shape.faces)
    if isinstance(shape, Box):
        return _box(shape.size)
    if isinstance(shape, Cylinder):
        half = 0.5 * shape.length
        return revolve([(0.0, -half), (shape.radius, -half), (shape.radius, half), (0.0, half)])
    if isinstance(shape, Plane):
        return _box((2.0 * _WALL, 2.0 * _WALL, 0.01)).moved((0.0, 0.0, -0.005))
    ball = unit_ball()
    return Mesh(ball.vertices * shape.radius, ball.faces)


def _box(size: tuple[float, ...]) -> Mesh:
    """Returns a box with sharp edges."""
    corners, faces = [], []
    for axis in range(3):
        for side in (-0.5, 0.5):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            square = np.zeros((4, 3))
            square[:, axis] = side
            square[:, u] = (-0.5, 0.5, 0.5, -0.5)
            square[:, v] = (-0.5, -0.5, 0.5, 0.5)
            start = 4 * len(faces)
            turn = (0, 1, 2, 3) if side > 0.0 else (0, 3, 2, 1)
            corners.append(square)
            faces.append(
                [
                    [start + turn[0], start + turn[1], start + turn[2]],
                    [start + turn[0], start + turn[2], start + turn[3]],
                ]
            )
    return Mesh(np.concatenate(corners) * size, np.concatenate(np.array(faces, dtype=np.int32)))


def _color(cell: Cell, obstacle: Obstacle, touched: str) -> Color:
    if obstacle.name == touched:
        return TOUCHED_COLOR
    return WORKPIECE_COLOR if obstacle.name == cell.workpiece else OBSTACLE_COLOR
