"""A cell in a scene: its obstacles, and its frames.

Node names: /cell/obstacle0 with /cell/obstacle0/mesh, /cell/frame0 and so on. Tool and part are drawn on the flange of
an arm, see `ArmView`.
"""

from __future__ import annotations

from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shape_mesh import carried_solids, shape_mesh, solid_mesh
from rcilab.cell.shapes import Plane
from rcilab.core.spatial import Pose
from rcilab.robots.mesh import Mesh, merge_meshes
from rcilab.views.scene import Color, Scene

OBSTACLE_COLOR: Color = (148, 158, 172)
WORKPIECE_COLOR: Color = (96, 150, 190)
TOUCHED_COLOR: Color = (214, 48, 38)

_AXES = 0.1  # [m] Length of the drawn axes of a frame.
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
        self._frames: list[Pose] = []
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
        frames = [] if cell is None else [cell.T_base(frame.name) for frame in cell.frames]
        with self._scene.batch():
            self._show_obstacles(obstacles)
            self._show_frames(frames)

    def obstacle_node(self, index: int) -> str:
        """Returns the name of the mesh of an obstacle."""
        return f"{self._root}/obstacle{index}/mesh"

    def remove(self) -> None:
        """Removes the cell from the scene."""
        self._scene.remove(self._root)

    def _show_obstacles(self, wanted: list[tuple[Obstacle, Pose, Color]]) -> None:
        for index in range(len(wanted), len(self._obstacles)):
            self._scene.remove(f"{self._root}/obstacle{index}")
        for index, (obstacle, pose, color) in enumerate(wanted):
            before = self._obstacles[index] if index < len(self._obstacles) else None
            self._place(f"{self._root}/obstacle{index}", None if before is None else before[1], pose)
            node = self.obstacle_node(index)
            if before is None or before[0].shape != obstacle.shape:
                mesh = shape_mesh(obstacle.shape)
                opacity = _WALL_OPACITY if isinstance(obstacle.shape, Plane) else 1.0
                self._scene.add_mesh(node, mesh.vertices, mesh.faces, color=color, opacity=opacity)
            elif before[2] != color:
                self._scene.set_style(node, color=color)
        self._obstacles = wanted

    def _show_frames(self, wanted: list[Pose]) -> None:
        for index in range(len(wanted), len(self._frames)):
            self._scene.remove(f"{self._root}/frame{index}")
        for index, pose in enumerate(wanted):
            before = self._frames[index] if index < len(self._frames) else None
            self._place(f"{self._root}/frame{index}", before, pose, _AXES)
        self._frames = wanted

    def _place(self, node: str, before: Pose | None, pose: Pose, axes_length: float = 0.0) -> None:
        """Moves a frame, or adds one that was not there before."""
        wxyz, position = pose.wxyz.tolist(), pose.position.tolist()
        if before is None:
            self._scene.add_frame(node, wxyz=wxyz, position=position, axes_length=axes_length)
        elif not before.is_close(pose, 0.0):
            self._scene.set_transform(node, wxyz=wxyz, position=position)


def carried_mesh(cell: Cell | None, T_flange_tool: Pose) -> Mesh | None:
    """Returns tool and held part of a cell as one mesh in the flange frame; None if the arm carries neither."""
    solids = (
        [] if cell is None else [solid for group in carried_solids(cell, T_flange_tool).values() for solid in group]
    )
    return merge_meshes([solid_mesh(solid) for solid in solids]) if solids else None


def _color(cell: Cell, obstacle: Obstacle, touched: str) -> Color:
    if obstacle.name == touched:
        return TOUCHED_COLOR
    return WORKPIECE_COLOR if obstacle.name == cell.workpiece else OBSTACLE_COLOR
