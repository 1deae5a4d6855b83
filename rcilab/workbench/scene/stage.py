"""The 3D scene: ground, light, four arms, the target with its verdict, the tool's path. Owned by the presenter."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.posing.planning import PATH_POINTS
from rcilab.views.arm_view import ArmView
from rcilab.views.effort import effort_colors
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench import requests
from rcilab.workbench.run.readiness import is_moving
from rcilab.workbench.run.replay import replayed_pose
from rcilab.workbench.scene.grip import Grip
from rcilab.workbench.scene.setup_stage import SetupStage, hides_target
from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.posing.planning import Plan
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState

TONE_COLORS = {"good": (38, 166, 91), "warn": (240, 150, 20), "bad": (214, 48, 38)}
_CANDIDATE_COLORS = {"good": (90, 200, 150), "warn": (245, 190, 80), "bad": (230, 80, 70)}
_SAME_POSE = 2e-3  # [rad] A choice: ghosts closer than this to the arm would only flicker on its surface.
_HAND_AWAY = 0.6  # [s]
_GIZMO_SCALE = 0.26  # [m]


class Stage:
    """Draws snapshots; the gizmo asks.

    Args:
        server: The page.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, ask: Ask) -> None:
        self._server, self._ask = server, ask
        self._built: tuple[str, str] | None = None
        self._plan: Plan | None = None
        self._tone = ""
        self._said = ""
        self._visible: dict[str, bool] = {}
        self._touched = float("-inf")
        camera = server.initial_camera
        camera.position, camera.look_at, camera.fov = (2.0, -2.1, 1.45), (0.1, 0.05, 0.62), 0.75

    def show(self, state: UiState, status: SupervisorStatus, text: Text) -> None:
        """Draws what has changed."""
        wanted = (state.model.name, state.quality)
        if wanted != self._built:
            self._build(state)
            self._built = wanted
        if state.model.T_flange_tool is not self._tool:
            self._tool = state.model.T_flange_tool
            for arm in (self._live, self._candidate, self._ghost):
                arm.show_tool(self._tool)
        live = status.q
        if live is None:  # Nothing is connected: what stands there is the run that is looked at.
            replayed = replayed_pose(state)
            live = state.goal.q if replayed is None else replayed
        self._live.show(live)
        self._see(
            "candidate",
            self._candidate,
            status.q is not None and self._differs(state.goal.q, live) and not is_moving(status),
        )
        self._candidate.show(state.goal.q)
        self._show_plan(state, status, live)
        self._show_target(state, text)
        self._grip.show(state, status, text)
        self._setup.show(state, text)

    def _build(self, state: UiState) -> None:
        server, full = self._server, state.quality == "full"
        scene = server.scene
        if self._built is not None:
            for arm in (self._live, self._candidate, self._ghost):
                arm.remove()
            self._gizmo.remove()
            self._grip.remove()
            self._setup.remove()
        server.scene.configure_default_lights(True, cast_shadow=full)
        scene.configure_environment_map("studio" if full else None, environment_intensity=0.55)
        scene.set_background_image(_backdrop(), format="jpeg", jpeg_quality=92)
        scene.add_light_ambient("/light", intensity=0.3 if full else 1.1)
        scene.add_grid(
            "/ground",
            width=4.0,
            height=4.0,
            cell_size=0.1,
            section_size=0.5,
            cell_color=(196, 206, 218),
            section_color=(150, 165, 184),
            cell_thickness=0.6,
            section_thickness=1.0,
            fade_distance=5.0,
            fade_strength=1.6,
            shadow_opacity=0.28 if full else 0.0,
        )
        scene.add_frame("/base_axes", axes_length=0.22, axes_radius=0.004, origin_radius=0.006)
        drawing = ViserScene(server, shadows=full)
        self._live = ArmView(drawing, "live", state.model, "live", quality="fine" if full else "coarse")
        self._grip = Grip(server, drawing, self._live, self._ask)
        self._setup = SetupStage(server, drawing, self._live, self._ask)
        self._tool = state.model.T_flange_tool
        self._candidate = ArmView(drawing, "candidate", state.model, "candidate")
        self._ghost = ArmView(drawing, "plan", state.model, "plan")
        self._visible, self._plan, self._tone, self._said = {}, None, "", ""
        self._see("plan", self._ghost, False)
        self._build_target(state)

    def _build_target(self, state: UiState) -> None:
        pose, scene = state.goal.target, self._server.scene
        nowhere = np.zeros((PATH_POINTS - 1, 2, 3))
        self._path: Any = scene.add_line_segments(
            "/path", nowhere.astype(np.float32), nowhere.astype(np.uint8), thickness=0.008, visible=False
        )
        self._gizmo: Any = scene.add_transform_controls(
            "/target", scale=_GIZMO_SCALE, line_width=3.0, depth_test=False, wxyz=pose.wxyz, position=pose.position
        )
        self._mark: Any = scene.add_icosphere(
            "/mark", radius=0.075, color=TONE_COLORS["good"], opacity=0.4, cast_shadow=False, receive_shadow=False,
            position=pose.position,
        )  # fmt: skip
        self._label: Any = scene.add_label(
            "/verdict",
            "",
            position=_above(pose.position),
            anchor="bottom-center",
            depth_test=False,
            font_screen_scale=1.0,
        )

        @self._gizmo.on_update
        async def _(event: Any) -> None:
            self._touched = time.monotonic()
            self._ask(
                requests.MoveTarget(
                    page=event.client_id,
                    position=tuple(map(float, event.target.position)),
                    wxyz=tuple(map(float, event.target.wxyz)),
                    ended=event.phase == "end",
                )
            )

    def _show_target(self, state: UiState, text: Text) -> None:
        goal = state.goal
        away = hides_target(state)
        if self._gizmo.visible == away:
            self._gizmo.visible = self._mark.visible = self._label.visible = not away
        if time.monotonic() - self._touched > _HAND_AWAY:
            position, wxyz = goal.target.position, goal.target.wxyz
            if np.abs(np.asarray(self._gizmo.position) - position).max() > 1e-7:
                self._gizmo.position = position
            if 1.0 - abs(float(np.asarray(self._gizmo.wxyz) @ wxyz)) > 1e-12:
                self._gizmo.wxyz = wxyz
        self._label.position = _above(goal.target.position)
        self._mark.position = goal.target.position
        if goal.reach.tone != self._tone:
            self._tone = goal.reach.tone
            self._mark.color = TONE_COLORS[self._tone]
            self._candidate.set_look(color=_CANDIDATE_COLORS[self._tone])
        tone, reason = goal.reach.tone, text.say(goal.reach.reason)
        said = text("reach.label") if tone == "good" else f"{text('reach.tone.' + tone)} {reason}"
        if said != self._said:
            self._said = said
            self._label.text = said

    def _show_plan(self, state: UiState, status: SupervisorStatus, live: np.ndarray) -> None:
        plan = state.plan
        if plan is not self._plan:
            moved = plan is None or self._plan is None or plan.path is not self._plan.path
            self._plan = plan
            self._path.visible = plan is not None
            if plan is not None and moved:
                colors = effort_colors(plan.effort).astype(np.uint8)
                self._path.points = np.stack([plan.path[:-1], plan.path[1:]], axis=1).astype(np.float32)
                self._path.colors = np.stack([colors[:-1], colors[1:]], axis=1)
        if plan is None or is_moving(status):
            self._see("plan", self._ghost, False)
            return
        q = plan.motion.at(state.place * plan.motion.duration).q
        shown = (state.playing or 0.0 < state.place < 1.0) and self._differs(q, live)
        self._see("plan", self._ghost, shown)
        if shown:
            self._ghost.show(q)

    def _see(self, name: str, arm: ArmView, visible: bool) -> None:
        if self._visible.get(name) != visible:
            self._visible[name] = visible
            arm.set_visible(visible)

    @staticmethod
    def _differs(a: np.ndarray, b: np.ndarray) -> bool:
        return float(np.abs(a - b).max()) > _SAME_POSE


def _above(position: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in position)
    return x, y, z + 0.75 * _GIZMO_SCALE


def _backdrop() -> np.ndarray:
    """Returns a soft vertical gradient, so that a white arm stands out, (H, W, 3) uint8."""
    top, bottom = np.array([222.0, 231.0, 241.0]), np.array([250.0, 251.0, 253.0])
    share = np.linspace(0.0, 1.0, 256)[:, None]
    return np.repeat(((1.0 - share) * top + share * bottom)[:, None, :], 16, axis=1).astype(np.uint8)
