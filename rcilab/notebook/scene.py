"""The arm in 3D inside a cell: live in meshcat or viser if the browser reaches the kernel, else as an animation."""

from __future__ import annotations

import html
import warnings
from typing import Any, Literal

import numpy as np

from rcilab.app.planning import Plan
from rcilab.cell.cell import Cell
from rcilab.core.arrays import JointVector
from rcilab.core.errors import InvalidValueError
from rcilab.core.optional_deps import require_installed
from rcilab.core.spatial import Pose
from rcilab.notebook.kernel_reachability import KernelReachability, find_reachability
from rcilab.notebook.part import Part
from rcilab.notebook.preview import Preview, aim_camera
from rcilab.notebook.style import block, soft, write
from rcilab.notebook.viser_link import LOOPBACK, open_page
from rcilab.views.arm_view import ArmView
from rcilab.views.cell_view import CellView, carried_mesh
from rcilab.views.scene import Color
from rcilab.views.scene import Scene as Canvas
from rcilab.views.usage_colors import usage_colors

View = Literal["auto", "meshcat", "viser", "static"]
VIEWS: tuple[View, ...] = ("auto", "meshcat", "viser", "static")

_REACHED: Color = (70, 190, 130)
_REFUSED: Color = (230, 80, 70)
_ZOOM = 1.35
_SAME_POSE = 1e-4  # [rad] At a smaller distance a ghost would flicker inside the arm.


class Scene(Part):
    """The arm, its goal as a green ghost, and the arm at the time of `Timeline` as a blue one.

    With a robot the solid arm shows the robot; without one it follows the goal, and the time of `Timeline`.

    Args:
        subject: A model, a session, or another part of the same arm.
        view: "meshcat" or "viser", served on loopback; "static", an animation inside the notebook; "auto" takes meshcat
            if the browser can reach the kernel (see `rcilab.notebook.kernel_reachability`), else the animation.
        height: [px]
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
        reachability: How the browser reaches the kernel; detected by default.

    Raises:
        InvalidValueError: The subject, the view or the language is unknown.
        UsageError: meshcat is not installed.
    """

    def __init__(
        self,
        subject: object,
        *,
        view: View = "auto",
        height: int = 420,
        language: str | None = None,
        reachability: KernelReachability | None = None,
    ) -> None:
        if view not in VIEWS:
            raise InvalidValueError("view", view, f"is unknown; known: {', '.join(VIEWS)}")
        require_installed("meshcat", "Scene")
        super().__init__(subject, language)
        reachability = reachability or find_reachability()
        self.height = height
        reachable = reachability.route == "loopback" or (reachability.route == "proxy" and view != "viser")
        self.is_live = view != "static" and reachable
        self._frame, self._note = block(), block()
        self._picture: _LivePicture | None = None
        self.build([self._frame, self._note], flex="0 0 auto", min_width="300px")
        if self.is_live:
            self._picture = _LivePicture(self, "viser" if view == "viser" else "meshcat")
            self._write_frame(f'src="{html.escape(reachability.address(self._picture.url))}"')
            for topic in ("goal", "moment", "robot"):
                self.subscribe(topic, self._picture.draw)
            self.subscribe("plan", self._picture.draw_path)
        else:
            helps = (
                "scene.static" if reachability.route == "static" and reachability.proxy_helps else "scene.static_here"
            )
            write(self._note, soft(self.text("scene.asked" if view == "static" else helps)))
            self.subscribe("plan", self._show_animation)

    @property
    def url(self) -> str | None:
        """Address of the live scene on loopback; None for an animation."""
        return None if self._picture is None else self._picture.url

    def flush(self) -> None:
        """Returns once all drawings have been sent to every open page; meshcat only, else at once."""
        if self._picture is not None:
            self._picture.flush()

    def save(self, file: str) -> None:
        """Writes the scene as one HTML page that needs neither kernel nor network: an animation, or the pose."""
        self._make_animation().save(file)

    def end(self) -> None:
        """Stops the server."""
        if self._picture is not None:
            self._picture.close()

    def _write_frame(self, source: str) -> None:
        title = html.escape(self.text("scene.title", model=self.model.name))
        write(self._frame, f'<iframe class="rl-frame" title="{title}" {source} height="{self.height}"></iframe>')

    def _show_animation(self) -> None:
        self._write_frame(f'srcdoc="{html.escape(self._make_animation().html())}"')

    def _make_animation(self) -> Preview:
        plan, now = self.state.shown_scene_plan, self.state.now
        what = now.goal.q if plan is None else plan.motion
        return Preview(
            what, self.model, live=False, height=self.height, language=self.text.language, cell=now.session_cell
        )


class _LivePicture:
    """The drawing of the served page; done by the thread that changes the state, one at a time."""

    def __init__(self, part: Scene, view: Literal["meshcat", "viser"]) -> None:
        self._state = part.state
        self._guarded_server: Any = None
        self._meshcat: Any = None
        canvas = self._open_viser() if view == "viser" else self._open_meshcat()
        self._canvas = canvas
        model = part.model
        self._arm = ArmView(canvas, "arm", model, axes_length=0.12)
        self._goal = ArmView(canvas, "goal", model, "candidate")
        self._ghost = ArmView(canvas, "plan", model, "plan")
        self._shown = {"goal": True, "plan": True}
        self._ghost_color = _REACHED
        self._path: Plan | None = None
        self._cell = CellView(canvas)
        self._drawn: tuple[Cell | None, Pose] = (None, model.T_flange_tool)  # Without a cell, nothing is to be drawn.
        self._draw_cell()

    def draw(self) -> None:
        """Moves the three arms to their current positions, and draws the cell."""
        state, status = self._state, self._state.status
        self._draw_cell()
        seen = state.shown_scene_plan
        moment = None if state.moment is None or seen is None else seen.motion.at(state.moment).q
        robot = None if status is None else status.q
        solid = state.now.goal.q if robot is None and moment is None else moment if robot is None else robot
        assert solid is not None
        self._arm.show(solid)
        self._show_ghost("goal", self._goal, state.now.goal.q, solid)
        self._show_ghost("plan", self._ghost, None if robot is None else moment, solid)
        tint = _REFUSED if state.now.goal.reach.tone == "bad" else _REACHED
        if tint != self._ghost_color:
            self._ghost_color = tint
            self._goal.set_look(color=tint)

    def _draw_cell(self) -> None:
        """Draws the cell of the session: its obstacles, and what the arm carries."""
        now = self._state.now
        cell, tool = now.session_cell, now.model.T_flange_tool
        if cell is self._drawn[0] and tool is self._drawn[1]:
            return
        self._drawn = (cell, tool)
        self._cell.show(cell)
        carried = carried_mesh(cell, tool)
        for arm in (self._arm, self._goal, self._ghost):
            arm.show_carried(carried)

    def draw_path(self) -> None:
        """Draws the path of the tool, coloured by the utilisation of the joints' limits."""
        plan = self._state.shown_scene_plan
        if plan is self._path:
            return
        if self._path is not None:
            self._canvas.remove("/path")
        self._path = plan
        if plan is not None:
            self._canvas.add_polyline("/path", plan.path, color=usage_colors(plan.effort))

    def flush(self) -> None:
        """Waits for meshcat's server."""
        if self._meshcat is not None:
            self._meshcat.flush()

    def close(self) -> None:
        """Stops serving."""
        if self._guarded_server is not None:
            self._guarded_server.close()
        if self._meshcat is not None:
            self._meshcat.close()

    def _show_ghost(self, name: str, arm: ArmView, q: JointVector | None, solid: JointVector) -> None:
        visible = q is not None and float(np.abs(q - solid).max()) > _SAME_POSE
        if visible:
            assert q is not None
            arm.show(q)
        if visible != self._shown[name]:
            self._shown[name] = visible
            arm.set_visible(visible)

    def _open_meshcat(self) -> Canvas:
        with warnings.catch_warnings():  # meshcat 0.3 uses pyzmq's deprecated event loop.
            warnings.simplefilter("ignore", DeprecationWarning)
            from rcilab.views.meshcat_scene import MeshcatScene

            self._meshcat = MeshcatScene()
        aim_camera(self._meshcat.visualizer)
        self._meshcat.visualizer["/Cameras/default/rotated/<object>"].set_property("zoom", _ZOOM)
        self.url: str = self._meshcat.url + "?plain"
        return self._meshcat

    def _open_viser(self) -> Canvas:
        from rcilab.views.viser_scene import ViserScene

        self._guarded_server, port = open_page(0)
        self.url = f"http://{LOOPBACK}:{port}/"
        return ViserScene(self._guarded_server.viser, shadows=False)
