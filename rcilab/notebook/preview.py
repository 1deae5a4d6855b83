"""A motion, or a pose, as a small 3D scene inside the notebook."""

from __future__ import annotations

import html
import math
import os
import warnings
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell, require_cell
from rcilab.core.arrays import Array, as_vector
from rcilab.core.atomic_file import replacing
from rcilab.core.closeable import Closeable
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.optional_deps import require_installed
from rcilab.i18n.notebook_language import chosen_language
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.motion import Motion
from rcilab.notebook.kernel_reachability import find_reachability
from rcilab.robots.upright import upright_joints
from rcilab.views.arm_view import ArmView
from rcilab.views.cell_view import CellView, carried_mesh

if TYPE_CHECKING:
    from rcilab.motion.motion import Motion

HEIGHT = 420  # [px]
_RATE = 30  # [1/s] Keyframes; the viewer interpolates between them.
_HOLD = 1.0  # [s] Pause at the goal before the motion starts again.
_REPETITIONS = 1000  # More repetitions than anyone watches.
_MIDDLE = (0.2, 0.0, 0.5)  # [m] Point that the camera turns about.
_CAMERA_POSITION = (0.7, -1.0, 0.35)  # [m] From that point.


class Preview(Closeable):
    """An arm in a meshcat viewer; displays itself in a notebook. Nothing in it can move a robot.

    Live, the kernel serves it on loopback, and `show` moves the arm. Static, it is part of the notebook (about
    1.5 MB), needs no kernel, and keeps its initial pose or motion.

    Args:
        what: A motion to repeat, with its goal as a ghost; or joint angles, shape (n,), [rad].
        model: The arm.
        live: Whether the kernel serves it.
        height: Height in the notebook, [px].
        language: "en" or "zh"; defaults to that of the notebook.
        cell: What the arm carries and what stands around it; None: neither.

    Raises:
        InvalidValueError: The pose is not n finite numbers, the motion is for another number of joints, or the language
            is unknown.
        UsageError: meshcat is not installed.
    """

    def __init__(
        self,
        what: Motion | ArrayLike,
        model: RobotModel,
        *,
        live: bool = True,
        height: int = HEIGHT,
        language: str | None = None,
        cell: Cell | None = None,
    ) -> None:
        self._text = Text(chosen_language(language), "rcilab.notebook")
        require_installed("meshcat", "preview")
        require_model(model)
        motion = _motion_in(what)
        pose = as_vector(cast("ArrayLike", what) if motion is None else motion.start, model.n, "q", "rad")
        with warnings.catch_warnings():  # meshcat 0.3 uses pyzmq's deprecated event loop.
            warnings.simplefilter("ignore", DeprecationWarning)
            from rcilab.views.meshcat_scene import MeshcatScene

            self._scene = MeshcatScene()
        self._model = model
        self._height = height
        self._live = live
        self._place = find_reachability()
        self._arm = ArmView(self._scene, "arm", model, quality="fine" if live else "coarse")
        self._arm.show(pose)
        self._moving = False
        if cell is not None:
            require_cell(cell).require_arm(model)
            CellView(self._scene).show(cell)
            self._arm.show_carried(carried_mesh(cell, model.T_flange_tool))
        if motion is not None:
            ArmView(self._scene, "goal", model, "plan").show(motion.goal)
            self._animate(motion)
        self._markup = ""
        aim_camera(self._scene.visualizer)
        if not live:
            self._markup = self._scene.as_html()
            self._scene.close()

    @property
    def url(self) -> str | None:
        """Address of the viewer for the browser, to open it in a separate window; None if it is not live."""
        if not self._live:
            return None
        return self._place.address(self._scene.url + ("" if self._moving else "?plain"))  # A pose needs no play button.

    def show(self, q: ArrayLike) -> None:
        """Moves the arm to joint angles, shape (n,), [rad]; an animation ends.

        Raises:
            UsageError: The preview is static, or was closed.
        """
        if not self._live:
            raise UsageError("a static preview keeps its pose; make a new one, or use preview(..., live=True)")
        if self._moving:
            self._animate(None)
        self._arm.show(q)

    def html(self) -> str:
        """Returns the scene, with its animation, as one HTML page that needs neither kernel nor network."""
        return self._scene.as_html() if self._live else self._markup

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes `html()` to a file.

        Raises:
            InvalidValueError: The file cannot be written.
        """
        page = self.html().encode()
        try:
            with replacing(file) as stream:
                stream.write(page)
        except OSError as error:
            raise InvalidValueError("file", os.fspath(file), f"cannot be written: {error.strerror}").coded(
                "file_unwritable", file=os.fspath(file)
            ) from error

    def close(self) -> None:
        """Stops serving and keeps the current scene as a static one; may be called twice."""
        if self._live:
            self._markup = self._scene.as_html()
            self._scene.close()
            self._live = False

    def __repr__(self) -> str:
        return f"<Preview of {self._model.name}, {self.url or 'static'}>"

    def _repr_html_(self) -> str:
        note = self._text("preview.nothing", call="<code>preview(..., live=False)</code>")
        style = f"width: 100%; height: {self._height}px; border: none"
        if self.url is None:
            return f'<iframe srcdoc="{html.escape(self.html())}" style="{style}"></iframe>'
        url = html.escape(self.url)
        return (
            f'<iframe src="{url}" style="{style}"></iframe>'
            f'<p><small><a href="{url}" target="_blank">{url}</a> {note}</small></p>'
        )

    def _animate(self, motion: Motion | None) -> None:
        """Sends the viewer a track of orientations for each joint; None removes them."""
        from meshcat.animation import Animation, AnimationClip, AnimationTrack

        visualizer = self._scene.visualizer
        clips = {}
        if motion is not None:
            times, q = _keyframes(motion)
            frames = (times * _RATE).tolist()
            for joint, node in zip(upright_joints(self._model.description), self._arm.joint_nodes, strict=True):
                angles = q[:, len(clips)]
                track = AnimationTrack("quaternion", "quaternion", frames, _xyzw(joint.axis, angles))
                path = visualizer[node.strip("/")].path
                clips[path] = AnimationClip({"quaternion": track}, fps=_RATE)
        visualizer.set_animation(Animation(clips), play=True, repetitions=_REPETITIONS)
        self._moving = motion is not None


def preview(
    motion: Motion | ArrayLike,
    model: RobotModel,
    *,
    live: bool | None = None,
    height: int = HEIGHT,
    language: str | None = None,
    cell: Cell | None = None,
) -> Preview:
    """Returns a 3D scene that plays a motion, or shows joint angles, inside the notebook.

    Args:
        motion: A motion to repeat; or joint angles, shape (n,), [rad].
        model: The arm.
        live: Served by the kernel (True) or part of the notebook (False); None serves it if the browser can reach the
            kernel, see `rcilab.notebook.kernel_reachability`.
        height: Height in the notebook, [px].
        language: "en" or "zh"; defaults to that of the notebook.
        cell: What the arm carries and what stands around it; None: neither.

    Raises:
        InvalidValueError: The pose is not n finite numbers, or the cell is that of another arm.
    """
    if live is None:
        live = find_reachability().route != "static"
    return Preview(motion, model, live=live, height=height, language=language, cell=cell)


def aim_camera(visualizer: Any) -> None:
    """Points the camera at the middle of the arm. meshcat 0.3's camera always turns about the origin: the arm moves."""
    T_viewer_base = np.eye(4)
    T_viewer_base[:3, 3] = -np.array(_MIDDLE)
    visualizer.set_transform(T_viewer_base)
    visualizer["/Axes"].set_transform(T_viewer_base)
    visualizer["/Grid"].set_property("visible", False)  # Lines out to 20 m, far larger than any arm.
    x, y, z = _CAMERA_POSITION
    visualizer["/Cameras/default/rotated/<object>"].set_property("position", [x, z, -y])  # Its y axis points up.


def _motion_in(what: Motion | ArrayLike) -> Motion | None:
    """Returns the motion, if it is one."""
    return what if isinstance(what, Motion) else None


def _keyframes(motion: Motion) -> tuple[Array, Array]:
    """Returns times, shape (K,), [s], and their joint angles, shape (K, n), with the pause at the goal."""
    count = math.ceil(motion.duration * _RATE) + 1
    times = np.append(np.linspace(0.0, motion.duration, count), motion.duration + _HOLD)
    return times, np.array([motion.at(t).q for t in times])


def _xyzw(axis: Array, angles: Array) -> list[list[float]]:
    """Returns rotations about an axis as quaternions in the viewer's order."""
    half = 0.5 * angles[:, np.newaxis]
    return np.hstack((np.sin(half) * axis, np.cos(half))).tolist()
