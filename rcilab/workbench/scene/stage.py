"""The 3D scene: the arms in their environment, and everything around them. Owned by the renderer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.readiness import is_connected
from rcilab.app.run.replay import replayed_pose
from rcilab.app.text import Text
from rcilab.core.arrays import JointVector
from rcilab.views.arm_view import ArmView
from rcilab.views.cell_view import carried_mesh
from rcilab.views.viser_scene import ViserScene
from rcilab.views.viser_stage import add_environment, place_camera
from rcilab.workbench.scene.cell_view import CellSceneView
from rcilab.workbench.scene.configuration_view import ConfigurationSceneView
from rcilab.workbench.scene.drag_handle import DragHandle
from rcilab.workbench.scene.elbow_view import ElbowSceneView
from rcilab.workbench.scene.extras_view import ExtrasView
from rcilab.workbench.scene.goal_view import GoalView
from rcilab.workbench.scene.path_drawing_view import PathDrawingView
from rcilab.workbench.scene.path_strip_view import PathStripView
from rcilab.workbench.scene.watchers import Watchers
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.robots.mesh import Mesh

_Ghost = Literal["commanded", "candidate", "plan"]
_CANDIDATE_COLORS = {"good": (46, 180, 124), "warn": (240, 165, 40), "bad": (225, 62, 52), "peek": (130, 86, 225)}
_SAME_POSE = 2e-3  # [rad] At a smaller distance from the arm a ghost would only flicker on its surface.
_ABSENT = 0.25  # Opacity of an arm without a robot.
_STRAYED, _BACK = 0.01, 0.006
"""[rad] The commanded arm is drawn if a joint is more than 0.6 degrees away from it, some 10 mm at the tool, and
until the distance has been smaller for a second."""


class Stage:
    """Draws snapshots; handles in the scene send requests.

    Args:
        server: The page.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, ask: Ask) -> None:
        self._server, self._ask = server, ask
        self._built: tuple[str, str] | None = None
        self._look = self._theme = ""
        self._ghosts: dict[_Ghost, ArmView] = {}
        self._visible: set[_Ghost] = set()
        self._watchers = Watchers(server)
        place_camera(server)

    @property
    def is_held(self) -> bool:
        """Whether the goal is being dragged, or has just been."""
        return self._built is not None and (self._goal.is_held or self._elbow.is_held)

    def show(self, state: UiState, status: SupervisorStatus, text: Text) -> None:
        """Draws what has changed."""
        wanted = (state.model.name, state.quality)
        if wanted != self._built:
            self._build(state)
            self._built = wanted
        elif state.theme != self._theme:
            self._add_environment(state)
        self._theme = state.theme
        if state.model.T_flange_tool is not self._tool:
            self._tool = state.model.T_flange_tool
            for arm in (self._live, *self._ghosts.values()):
                arm.show_tool(self._tool)
        self._model, live = state.model, status.q
        replayed = replayed_pose(state) if live is None else None
        self._show_presence(is_connected(status) or replayed is not None)
        if live is None:  # Without a connection, the position is that of a displayed run, or the target.
            live = state.goal.q if replayed is None else replayed
        self._live.show(live)
        self._show_commanded(status, live)
        self._show_candidate(state, status, live)
        self._show_plan(state, status, live)
        is_with_arm = is_moving(status) or _apart(state.goal.q, live) <= _SAME_POSE
        is_hidden = (bool(state.watched) and is_with_arm) or state.replay is not None
        self._goal.show(state, text, is_hidden=is_hidden)
        self._elbow.show(state, status, text)
        self._ribbon.show(state, text)
        self._extras.show(state)
        self._grip.show(state, status, text)
        self._setup.show(state, text)
        self._cell.show(state, text)
        self._drawn_path.show(state)
        self._show_carried(state)
        self._watchers.show(
            state.control_lock, self._goal.handles + self._elbow.handles + self._setup.handles + self._cell.handles
        )

    def _build(self, state: UiState) -> None:
        server, full = self._server, state.quality == "full"
        if self._built is not None:
            self._setup.remove()
            self._cell.remove()
            self._drawn_path.remove()
            for part in (self._goal, self._elbow, self._ribbon, self._extras, self._grip, self._live):
                part.remove()
            for ghost in self._ghosts.values():
                ghost.remove()
        self._add_environment(state)
        drawing = self._drawing = ViserScene(server, shadows=full)
        self._model = model = state.model
        self._live = ArmView(drawing, "live", model, "live", quality="fine" if full else "coarse")
        self._ghosts, self._look, self._is_there = {}, "", True
        self._visible.clear()
        self._grip = DragHandle(server, drawing, self._live, self._ask)
        self._setup = ConfigurationSceneView(server, drawing, self._live, self._ask)
        self._cell = CellSceneView(server, drawing, self._ask)
        self._drawn_path = PathDrawingView(server, drawing, self._ask)
        self._carried: Mesh | None = None
        self._carried_of: tuple[object, object] = (None, None)
        self._goal = GoalView(server, state, self._ask)
        self._elbow = ElbowSceneView(server, drawing, self._ask)
        self._ribbon = PathStripView(server, drawing, self._ask)
        self._extras = ExtrasView(server, drawing, self._live)
        self._tool = model.T_flange_tool

    def _show_carried(self, state: UiState) -> None:
        """Draws tool and part of the cell on every arm, and the ground at its floor."""
        wanted = (state.cell.cell, state.model.T_flange_tool)
        if wanted[0] is self._carried_of[0] and wanted[1] is self._carried_of[1]:
            return
        self._carried_of = wanted
        self._carried = carried_mesh(state.cell_for(state.model), state.model.T_flange_tool)
        for arm in (self._live, *self._ghosts.values()):
            arm.show_carried(self._carried)
        if _floor_of(state) != self._floor:
            self._add_environment(state)

    def _add_environment(self, state: UiState) -> None:
        self._floor = _floor_of(state)
        full, dark = state.quality == "full", state.theme == "dark"
        add_environment(self._server, full=full, dark=dark, floor=self._floor)

    def _show_presence(self, is_there: bool) -> None:
        """Draws the arm translucent while no robot reports its position."""
        if is_there != self._is_there:
            self._is_there = is_there
            self._live.set_look(opacity=1.0 if is_there else _ABSENT)

    def _show_commanded(self, status: SupervisorStatus, live: np.ndarray) -> None:
        """Draws the commanded pose of the arm if it differs from the measured one."""
        commanded = status.q_c if status.q is not None else None
        bound = _BACK if "commanded" in self._visible else _STRAYED
        self._see("commanded", commanded, commanded is not None and _apart(commanded, live) > bound)

    def _show_candidate(self, state: UiState, status: SupervisorStatus, live: np.ndarray) -> None:
        """Draws the goal, or its branch under the mouse."""
        goal, peek = state.goal, state.scene.peek
        solutions = goal.reach.solutions
        q, look = goal.q, goal.reach.tone
        if peek is not None and solutions is not None and peek < len(solutions):
            q, look = solutions[peek], "peek"
        stands = (status.q is not None or look == "peek") and _apart(q, live) > _SAME_POSE
        self._see("candidate", q, stands and not is_moving(status))
        if look != self._look and "candidate" in self._ghosts:
            self._look = look
            self._ghosts["candidate"].set_look(color=_CANDIDATE_COLORS[look])

    def _show_plan(self, state: UiState, status: SupervisorStatus, live: np.ndarray) -> None:
        plan = state.plan
        is_previewed = state.playing or 0.0 < state.playhead < 1.0
        is_fault = state.learn.show is not None  # Its record may end at the fault, away from the goal.
        if plan is None or is_moving(status) or not (is_previewed or is_fault):
            self._see("plan", None, False)
            return
        q = plan.motion.at(state.playhead * plan.motion.duration).q
        self._see("plan", q, _apart(q, live) > _SAME_POSE)

    def _see(self, name: _Ghost, q: JointVector | None, visible: bool) -> None:
        """Shows or hides a ghost; creates it at its first use, so that opening a page does not wait for it."""
        if visible and name not in self._ghosts:
            self._ghosts[name] = ArmView(self._drawing, name, self._model, name)
            self._ghosts[name].show_carried(self._carried)
            self._visible.add(name)
        if name not in self._ghosts:
            return
        ghost = self._ghosts[name]
        if q is not None:
            ghost.show(q)
        if visible != (name in self._visible):
            (self._visible.add if visible else self._visible.discard)(name)
            ghost.set_visible(visible)


def _floor_of(state: UiState) -> float | None:
    cell = state.cell.cell
    return 0.0 if cell is None else cell.floor_height


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max())
