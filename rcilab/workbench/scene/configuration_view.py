"""The configuration in the scene: its parts, their handles, and the part of the path outside the safety box."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.cell.cell_state import selected_entry
from rcilab.app.setup.configuration_state import ON_FLANGE
from rcilab.app.setup.setup_actions import MoveSetup, ResizeBox
from rcilab.app.text import Text
from rcilab.core.arrays import Array
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.maker import capabilities_of
from rcilab.robots.mesh import revolve
from rcilab.views.arm_view import ArmView
from rcilab.views.configuration_view import BOX_COLOR, ConfigurationView, outside_runs
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.widgets import FAINT, HAND_AWAY, Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState

_OUTSIDE_COLOR = (190, 0, 10)  # Lines appear paler than their colour.
_SCALES = {"box": 0.24, "tool": 0.17, "load": 0.17, "force": 0.17}  # [m]
_HANDLE = 0.026  # [m]
_SIGNS = np.array([(-1, 0, 0), (0, -1, 0), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)


class ConfigurationSceneView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Drawing of the arm.
        arm: The live arm, with its tool and load.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, arm: ArmView, ask: Ask) -> None:
        self._server, self._drawing, self._ask = server, drawing, ask
        self._flange = arm.tool_node.rpartition("/")[0]
        self._view = ConfigurationView(drawing, self._flange)
        self._gizmo: Any = None
        self._edited = ""
        self._handled: SafetyBox | None = None
        self._touched = float("-inf")
        self._outside: tuple[object, object] = (None, None)
        self._label: Any = server.scene.add_label(
            "/safety_box_label", "", anchor="bottom-center", depth_test=False, font_screen_scale=1.0, visible=False
        )
        self._name: Any = None  # The part with handles.
        self._crossing: Any = server.scene.add_label(
            "/outside_label", "", anchor="top-left", depth_test=False, font_screen_scale=1.0, visible=False
        )
        self._lines = 0

    @property
    def handles(self) -> tuple[str, ...]:
        """The nodes that can be dragged now."""
        if self._gizmo is None:
            return ()
        faces = tuple(f"/safety_box/handle{face}" for face in range(6)) if self._edited == "box" else ()
        return (self._gizmo.name, *faces)

    def show(self, state: UiState, text: Text) -> None:
        """Draws the chosen parts, and the handles of the edited one."""
        setup = state.setup
        wanted, seen = setup.wanted, setup.seen
        box = wanted.box
        if box is not None and not ("box" in seen and (box.active or setup.edited == "box")):
            box = None  # A box that is off is drawn only while it is edited.
        self._view.show_box(box)
        self._view.show_tool(wanted.tool if "tool" in seen else None)
        self._view.show_load(wanted.load if "load" in seen else None)
        force = wanted.force
        self._view.show_force(None if force is None or "force" not in seen else force.T_flange_force)
        edited = setup.edited if setup.edited in seen else ""
        if edited != self._edited:
            self._exchange_handles(edited, state)
        self._follow(state)
        self._name_handles(state, text)
        self._name_box(box, text)
        self._show_outside(state, text)

    def remove(self) -> None:
        """Removes box, labels and handles; parts on the flange are removed with the arm."""
        if self._gizmo is not None:
            self._gizmo.remove()
            self._name.remove()
        self._label.remove()
        self._crossing.remove()
        self._draw_outside([])
        self._view.remove_box()

    def _exchange_handles(self, part: str, state: UiState) -> None:
        if self._gizmo is not None:
            self._gizmo.remove()
            self._name.remove()
            self._gizmo = self._name = None
        if self._edited == "box":
            for face in range(6):
                self._drawing.remove(f"/safety_box/handle{face}")
        self._edited = part
        if not part:
            return
        pose = _pose_of(state, part)
        is_straight = part == "load" or (part == "box" and not capabilities_of(state.model).turns_box)
        name = "/setup_box" if part == "box" else f"{self._flange}/handles_{part}"
        self._gizmo = self._server.scene.add_transform_controls(
            name, scale=_SCALES[part], line_width=3.0, depth_test=False, opacity=FAINT, disable_rotations=is_straight,
            wxyz=pose.wxyz, position=pose.position,
        )  # fmt: skip

        self._name = self._server.scene.add_label(
            f"{name}_name", "", anchor="top-center", depth_test=False, font_screen_scale=1.0
        )

        @self._gizmo.on_update
        async def _(event: Any) -> None:
            self._touched = time.monotonic()
            self._ask(
                MoveSetup(
                    page=event.client_id,
                    part=part,  # type: ignore[arg-type]  # One of the four.
                    position=tuple(map(float, event.target.position)),
                    wxyz=tuple(map(float, event.target.wxyz)),
                    ended=event.phase == "end",
                )
            )

        if part == "box":
            self._handled = None
            ball = revolve([(0.0, -_HANDLE), (0.8 * _HANDLE, 0.0), (0.0, _HANDLE)], segments=12)
            for face in range(6):
                handle = f"/safety_box/handle{face}"
                self._drawing.add_mesh(handle, ball.vertices, ball.faces, color=BOX_COLOR)
                self._drawing.on_drag(handle, self._drag_handler(face))

    def _follow(self, state: UiState) -> None:
        """Moves the handles to the part, unless they are being dragged."""
        box = state.setup.wanted.box
        if self._edited == "box" and box is not None and box is not self._handled:
            self._handled = box
            for face, place in enumerate(_SIGNS * 0.5 * np.array(box.size)):
                self._drawing.set_transform(f"/safety_box/handle{face}", position=place.tolist())
        if self._gizmo is None or time.monotonic() - self._touched < HAND_AWAY:
            return
        pose = _pose_of(state, self._edited)
        if np.abs(np.asarray(self._gizmo.position) - pose.position).max() > 1e-7:
            self._gizmo.position = pose.position
        if 1.0 - abs(float(np.asarray(self._gizmo.wxyz) @ pose.wxyz)) > 1e-12:
            self._gizmo.wxyz = pose.wxyz

    def _name_handles(self, state: UiState, text: Text) -> None:
        """Shows the name of the part next to its handles."""
        if self._name is None:
            return
        sentence = text("setup.handles", part=text(f"setup.part.{self._edited}"))
        if sentence != self._name.text:
            self._name.text = sentence
        away = 1.2 * _SCALES[self._edited] * (-1.0 if self._edited == "box" else 1.0)  # Down, as the flange looks.
        place = _pose_of(state, self._edited).position + (0.0, 0.0, away)
        if np.abs(np.asarray(self._name.position) - place).max() > 1e-6:
            self._name.position = place

    def _name_box(self, box: SafetyBox | None, text: Text) -> None:
        if self._label.visible != (box is not None):
            self._label.visible = box is not None
        if box is None:
            return
        sentence = text("setup.label_on" if box.active else "setup.label_off")
        if sentence != self._label.text:
            self._label.text = sentence
        corners = box.corners()
        self._label.position = corners[int(corners[:, 2].argmax())]

    def _show_outside(self, state: UiState, text: Text) -> None:
        """Draws the part of the planned path outside the box in red, with a label."""
        sentence = text("setup.outside")
        if sentence != self._crossing.text:
            self._crossing.text = sentence
        path = None if state.plan is None else state.plan.path
        wanted = (path, state.setup.wanted.box)
        if wanted[0] is self._outside[0] and wanted[1] is self._outside[1]:
            return
        self._outside = wanted
        runs = [] if path is None else outside_runs(path, state.setup.wanted.box)
        self._draw_outside(runs)
        self._crossing.visible = bool(runs)
        if runs:
            self._crossing.position = runs[0][len(runs[0]) // 2]

    def _draw_outside(self, runs: list[Array]) -> None:
        for number in range(len(runs), self._lines):
            self._drawing.remove(f"/outside{number}")
        for number, run in enumerate(runs):
            self._drawing.add_polyline(f"/outside{number}", run, color=_OUTSIDE_COLOR, thickness=0.02)
        self._lines = len(runs)

    def _drag_handler(self, face: int) -> Any:
        async def act(event: Any) -> None:
            hand = tuple(map(float, event.end_position))
            self._ask(ResizeBox(page=event.client_id, face=face, hand=hand, ended=event.phase == "end"))

        return act


def hides_target(state: UiState) -> bool:
    """Returns whether the target's gizmo is hidden: other handles have its place, or the operator's attention."""
    return selected_entry(state.cell) is not None or (
        state.setup.edited in ON_FLANGE and state.setup.edited in state.setup.seen
    )


def _pose_of(state: UiState, part: str) -> Pose:
    wanted = state.setup.wanted
    assert wanted.box is not None
    assert wanted.tool is not None
    assert wanted.load is not None
    assert wanted.force is not None
    if part == "load":
        return Pose(wanted.load.center_of_mass)
    return {"box": wanted.box.T_base_box, "tool": wanted.tool, "force": wanted.force.T_flange_force}[part]
