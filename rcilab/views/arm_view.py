"""An arm in a scene: the live arm, the plan or a candidate of the inverse kinematics, which differ in style only.

Node names, used by the page and the browser tests, for an arm with the name NAME:

    /NAME                              the base frame; /NAME/base_shell, /NAME/base_cap, ... its meshes
    /NAME/joint1                       frame of link 1 (`robots/upright.py`); /NAME/joint1/shell, ... its meshes
    /NAME/joint1/joint2/.../jointN     each link below its parent link
    .../jointN/flange                  the flange;  .../jointN/flange/tool  the tool

When the arm moves, only the orientations of the joint frames change: one quaternion per joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector
from rcilab.core.errors import UsageError
from rcilab.core.spatial import Pose
from rcilab.robots.description import RobotDescription
from rcilab.robots.mesh import Mesh, shrink
from rcilab.robots.shapes import ROLE_COLORS, ColorRole, LinkShape, build_shapes
from rcilab.robots.upright import upright_flange, upright_joints
from rcilab.views.scene import Color, Scene

ArmStyle = Literal["live", "commanded", "plan", "candidate", "refused"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    tint: Color | None
    """Colour of the housings; None keeps the arm's own colours."""
    opacity: float
    inset: float
    """Inset of the surface, [m]: of two coinciding arms one is hidden in the other instead of flickering."""


_LOOKS: dict[ArmStyle, _Look] = {
    "live": _Look(tint=None, opacity=1.0, inset=0.0),
    "commanded": _Look(tint=(255, 170, 20), opacity=0.5, inset=0.0012),
    "plan": _Look(tint=(70, 140, 255), opacity=0.42, inset=0.0020),
    "candidate": _Look(tint=(70, 190, 130), opacity=0.42, inset=0.0028),
    "refused": _Look(tint=(230, 80, 70), opacity=0.35, inset=0.0036),
}
_TINTED_ROLE_SHADE: dict[ColorRole, float] = {"shell": 1.0, "cap": 0.75, "dark": 0.45}


class DrawableModel(Protocol):
    """The part of `RobotModel` that a view needs."""

    @property
    def description(self) -> RobotDescription:
        """Description of the arm."""
        ...

    @property
    def T_flange_tool(self) -> Pose:
        """Pose of the tool in the flange frame."""
        ...


class ArmView:
    """An arm drawn in a scene; owned by the thread that draws.

    Args:
        scene: The scene.
        name: Name of the arm's root node, without slashes.
        model: The arm.
        style: Appearance. A translucent arm is drawn without a base, at the place of the live arm.
        quality: "fine" or "coarse" meshes; by default coarse for translucent arms.
        axes_length: Length of the axes drawn at the tool, [m]; 0 draws none.
    """

    def __init__(
        self,
        scene: Scene,
        name: str,
        model: DrawableModel,
        style: ArmStyle = "live",
        *,
        quality: Literal["fine", "coarse"] | None = None,
        axes_length: float = 0.0,
    ) -> None:
        look = _LOOKS[style]
        self._scene = scene
        self._root = "/" + name.strip("/")
        self._tint, self._opacity = look.tint, look.opacity
        self._inset = look.inset
        self._meshes: list[tuple[str, ColorRole]] = []
        self._frames: list[str] = []
        self._carried = ""  # Name of the mesh of what it carries.
        joints = upright_joints(model.description)
        self._axes = tuple(tuple(joint.axis.tolist()) for joint in joints)
        self._shown = [0.0] * len(joints)
        self._removed = False
        shape = build_shapes(model.description, quality or ("fine" if self._opacity >= 1.0 else "coarse"))
        with scene.batch():
            scene.add_frame(self._root)
            if self._opacity >= 1.0:
                self._add_link(self._root + "/base_", shape.base)
            path = self._root
            for number, (joint, link) in enumerate(zip(joints, shape.links, strict=True), start=1):
                path += f"/joint{number}"
                scene.add_frame(path, position=joint.origin.tolist())
                self._frames.append(path)
                self._add_link(path + "/", link)
            scene.add_frame(path + "/flange", wxyz=upright_flange(model.description).wxyz.tolist())
            self.tool_node = path + "/flange/tool"
            tool = model.T_flange_tool
            scene.add_frame(
                self.tool_node, wxyz=tool.wxyz.tolist(), position=tool.position.tolist(), axes_length=axes_length
            )

    @property
    def root(self) -> str:
        """Name of the arm's base node."""
        return self._root

    @property
    def joint_nodes(self) -> tuple[str, ...]:
        """Names of the joint frames, base to flange."""
        return tuple(self._frames)

    @property
    def link_meshes(self) -> dict[str, int]:
        """Names of the meshes of the moving links, each with the number of its link, from 1."""
        below = {name: name.count("/joint") for name, _ in self._meshes}
        return {name: link for name, link in below.items() if link > 0}

    def show(self, q: ArrayLike | Sequence[float]) -> None:
        """Puts the arm into a pose.

        Args:
            q: Joint angles, shape (n,), [rad].

        Raises:
            InvalidValueError: Not n finite numbers; the arm is not changed.
        """
        angles = as_vector(q, len(self._axes), "q", "rad").tolist()
        changed = [i for i, angle in enumerate(angles) if angle != self._shown[i]]
        if not changed:
            return
        self._require_present()
        with self._scene.batch():
            for i in changed:
                half = 0.5 * angles[i]
                s = math.sin(half)
                x, y, z = self._axes[i]
                self._scene.set_transform(self._frames[i], wxyz=(math.cos(half), s * x, s * y, s * z))
                self._shown[i] = angles[i]

    def show_tool(self, T_flange_tool: Pose) -> None:
        """Moves the tool frame on the flange."""
        self._require_present()
        self._scene.set_transform(
            self.tool_node, wxyz=T_flange_tool.wxyz.tolist(), position=T_flange_tool.position.tolist()
        )

    def show_carried(self, mesh: Mesh | None) -> None:
        """Draws what the arm carries, in the flange frame; None removes it."""
        self._require_present()
        node = self.tool_node.rpartition("/")[0] + "/carried"
        with self._scene.batch():
            if self._carried:
                self._scene.remove(node)
            self._carried = node if mesh is not None else ""
            if mesh is not None:
                self._scene.add_mesh(node, mesh.vertices, mesh.faces, color=self._color("dark"), opacity=self._opacity)

    def set_visible(self, visible: bool) -> None:
        """Shows or hides the whole arm."""
        self._require_present()
        self._scene.set_visible(self._root, visible)

    def set_look(self, *, color: Color | None = None, opacity: float | None = None) -> None:
        """Changes tint or opacity; None leaves them unchanged."""
        self._require_present()
        self._tint = self._tint if color is None else color
        self._opacity = self._opacity if opacity is None else opacity
        with self._scene.batch():
            for name, role in self._meshes:
                self._scene.set_style(name, color=self._color(role), opacity=self._opacity)
            if self._carried:
                self._scene.set_style(self._carried, color=self._color("dark"), opacity=self._opacity)

    def remove(self) -> None:
        """Removes the arm from the scene; calling it again does nothing."""
        if not self._removed:
            self._removed = True
            self._scene.remove(self._root)

    def _add_link(self, prefix: str, shape: LinkShape) -> None:
        for part in shape.parts:
            name = prefix + part.role
            mesh = shrink(part.mesh, self._inset) if self._inset else part.mesh
            self._scene.add_mesh(
                name,
                mesh.vertices,
                mesh.faces,
                color=self._color(part.role),
                opacity=self._opacity,
            )
            self._meshes.append((name, part.role))

    def _color(self, role: ColorRole) -> Color:
        if self._tint is None:
            return ROLE_COLORS[role]
        shade = _TINTED_ROLE_SHADE[role]
        red, green, blue = self._tint
        return round(red * shade), round(green * shade), round(blue * shade)

    def _require_present(self) -> None:
        if self._removed:
            raise UsageError(f"the arm {self._root} was removed from the scene; make a new ArmView")
