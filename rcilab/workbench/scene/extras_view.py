"""The optional parts of the scene: frames of the joints, manipulability, workspace, swept volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.app.scene.scene_extras import CUT_AXES, SHARE, Ellipsoid, WorkspaceCut
from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel
from rcilab.robots.upright import upright_joints
from rcilab.views.arm_view import ArmView
from rcilab.views.configuration_view import unit_ball
from rcilab.views.viser_scene import ViserScene

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.model.kinematics.workspace import Workspace
    from rcilab.robots.mesh import Mesh

_AXES = 0.13  # [m]
_BESIDE = ("bottom-right", "bottom-left")
"""Positions of names in turn: the frames of two joints often have the same origin."""
_ELLIPSOID_COLOR, _SWEPT_COLOR = (126, 87, 194), (70, 140, 255)
_POOR_COLOR, _GOOD_COLOR = np.array([240.0, 150.0, 20.0]), np.array([30.0, 140.0, 200.0])
_CUT_COLOR = (214, 66, 160)
_GOOD = 0.25  # Smallest singular value from which on a point of the cloud is blue.


class ExtrasView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Drawing of the arm.
        arm: The live arm, with the frames.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, arm: ArmView) -> None:
        self._scene, self._drawing, self._arm = server.scene, drawing, arm
        self._frames: list[Any] = []
        self._has_plane = False
        self._cloud: Any = None
        self._drawn: dict[str, object] = {"cloud": None, "cut": None, "ellipsoid": None, "swept": None}

    def show(self, state: UiState) -> None:
        """Draws what is switched on and was computed."""
        seen = state.scene
        if ("frames" in seen.extras) != bool(self._frames):
            self._exchange_frames(state.model if "frames" in seen.extras else None)
        if self._is_new("ellipsoid", seen.ellipsoid):
            self._draw_ellipsoid(seen.ellipsoid)
        if self._is_new("cloud", seen.cloud) | self._is_new("cut", seen.cut):
            self._draw_cloud(seen.cloud, seen.cut)
        if self._is_new("swept", seen.swept):
            self._draw_swept(seen.swept)

    def remove(self) -> None:
        """Removes everything; the frames are removed with the arm."""
        self._exchange_frames(None)
        self._draw_cloud(None, None)
        for name in ("ellipsoid", "swept"):
            if self._drawn[name] is not None:
                self._drawing.remove(f"/{name}")

    def _is_new(self, name: str, value: object) -> bool:
        before, self._drawn[name] = self._drawn[name], value
        if before is not None and value is None and name in ("ellipsoid", "swept"):
            self._drawing.remove(f"/{name}")
        return before is not value

    def _exchange_frames(self, model: RobotModel | None) -> None:
        for handle in self._frames:
            handle.remove()
        self._frames = []
        if model is None:
            return
        for number, (node, pose) in enumerate(zip(self._arm.joint_nodes, link_frames(model), strict=True), start=1):
            self._add_frame(f"{node}/axes", pose, f"J{number}")
        self._add_frame(f"{self._arm.tool_node}/axes", Pose(), "TCP")

    def _add_frame(self, name: str, pose: Pose, sentence: str) -> None:
        scene, at = self._scene, {"wxyz": pose.wxyz, "position": pose.position}
        self._frames.append(
            scene.add_frame(name, axes_length=_AXES, axes_radius=0.004, origin_radius=0.008, **at)  # type: ignore[arg-type]
        )
        self._frames.append(
            scene.add_label(
                f"{name}_name",
                sentence,
                position=pose.position,
                anchor=_BESIDE[len(self._frames) // 2 % 2],
                depth_test=False,
            )
        )

    def _draw_ellipsoid(self, ellipsoid: Ellipsoid | None) -> None:
        if ellipsoid is None:
            return
        ball = unit_ball()
        body = ball.vertices * np.maximum(SHARE * ellipsoid.radii, 0.002) @ ellipsoid.axes.T + ellipsoid.position
        self._drawing.add_mesh("/ellipsoid", body, ball.faces, color=_ELLIPSOID_COLOR, opacity=0.35)

    def _draw_cloud(self, cloud: Workspace | None, cut: WorkspaceCut | None) -> None:
        if self._cloud is not None:
            self._cloud.remove()
            self._cloud = None
        if self._has_plane:
            self._drawing.remove("/cut")
        self._has_plane = cloud is not None and cut is not None
        if cloud is None:
            return
        position, colors = cloud.position, cloud_colors(cloud.dexterity.smallest / _GOOD)
        if cut is not None:
            kept = cut.keeps(position)
            self._drawing.add_polyline("/cut", _outline(cut, position), color=_CUT_COLOR, thickness=0.006)
            position, colors = position[kept], colors[kept]
        if len(position):
            self._cloud = self._scene.add_point_cloud(
                "/cloud", position.astype(np.float32), colors, point_size=0.005, point_shape="circle"
            )

    def _draw_swept(self, mesh: Mesh | None) -> None:
        if mesh is not None:
            self._drawing.add_mesh("/swept", mesh.vertices, mesh.faces, color=_SWEPT_COLOR, opacity=0.12)


def cloud_colors(goodness: Array) -> NDArray[np.uint8]:
    """Returns the colours of points of the workspace, shape (N, 3), uint8.

    Args:
        goodness: From 0, at a singularity, to 1, shape (N,); values above 1 count as 1.
    """
    good = np.clip(goodness, 0.0, 1.0)[:, None]
    return (good * _GOOD_COLOR + (1.0 - good) * _POOR_COLOR).astype(np.uint8)


def _outline(cut: WorkspaceCut, position: Array) -> Array:
    """Returns the part of a plane that crosses all positions, as a closed line, shape (5, 3), [m]."""
    axis = CUT_AXES.index(cut.axis)
    low, high = position.min(axis=0), position.max(axis=0)
    low[axis] = high[axis] = cut.at
    first, second = (k for k in range(3) if k != axis)
    corners = np.tile(low, (5, 1))
    corners[1:3, first] = high[first]
    corners[2:4, second] = high[second]
    return corners


def link_frames(model: RobotModel) -> list[Pose]:
    """Returns the Denavit-Hartenberg frame after each joint in the frame of its link's drawing."""
    heights = np.cumsum([joint.origin for joint in upright_joints(model.description)], axis=0)
    return [Pose(-height) @ frame for height, frame in zip(heights, model.joint_frames(np.zeros(model.n)), strict=True)]
