"""The optional parts of the scene: frames of the joints, manipulability, workspace, swept volume."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.scene.scene_extras import SHARE, Ellipsoid
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
        self._cloud: Any = None
        self._drawn: dict[str, object] = {"cloud": None, "ellipsoid": None, "swept": None}

    def show(self, state: UiState) -> None:
        """Draws what is switched on and was computed."""
        seen = state.scene
        if ("frames" in seen.extras) != bool(self._frames):
            self._exchange_frames(state.model if "frames" in seen.extras else None)
        if self._is_new("ellipsoid", seen.ellipsoid):
            self._draw_ellipsoid(seen.ellipsoid)
        if self._is_new("cloud", seen.cloud):
            self._draw_cloud(seen.cloud)
        if self._is_new("swept", seen.swept):
            self._draw_swept(seen.swept)

    def remove(self) -> None:
        """Removes everything; the frames are removed with the arm."""
        self._exchange_frames(None)
        self._draw_cloud(None)
        for name in ("ellipsoid", "swept"):
            if self._drawn[name] is not None:
                self._drawing.remove(f"/{name}")

    def _is_new(self, name: str, value: object) -> bool:
        before, self._drawn[name] = self._drawn[name], value
        if before is not None and value is None and name != "cloud":
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

    def _draw_cloud(self, cloud: Workspace | None) -> None:
        if self._cloud is not None:
            self._cloud.remove()
            self._cloud = None
        if cloud is None:
            return
        good = np.clip(cloud.dexterity.smallest / _GOOD, 0.0, 1.0)[:, None]
        colors = good * _GOOD_COLOR + (1.0 - good) * _POOR_COLOR
        self._cloud = self._scene.add_point_cloud(
            "/cloud", cloud.position.astype(np.float32), colors.astype(np.uint8), point_size=0.005, point_shape="circle"
        )

    def _draw_swept(self, mesh: Mesh | None) -> None:
        if mesh is not None:
            self._drawing.add_mesh("/swept", mesh.vertices, mesh.faces, color=_SWEPT_COLOR, opacity=0.12)


def link_frames(model: RobotModel) -> list[Pose]:
    """Returns the Denavit-Hartenberg frame after each joint in the frame of its link's drawing."""
    heights = np.cumsum([joint.origin for joint in upright_joints(model.description)], axis=0)
    return [Pose(-height) @ frame for height, frame in zip(heights, model.joint_frames(np.zeros(model.n)), strict=True)]
