"""A motion on a separate page: a link from the notebook, on loopback, with a time slider and a play button."""

from __future__ import annotations

import math
import threading

from rcilab.core.closeable import Closeable
from rcilab.core.errors import UsageError
from rcilab.i18n.notebook_language import chosen_language
from rcilab.i18n.translator import Text
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.motion import Motion, require_motion
from rcilab.views.access_control import AccessPolicy
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_ext.client_messages import run_javascript
from rcilab.views.viser_scene import ViserScene
from rcilab.views.viser_server import GuardedServer, listen
from rcilab.views.viser_stage import add_environment, place_camera

LOOPBACK = "127.0.0.1"
_PERIOD = 1.0 / 30.0  # [s] The rate of a slider's messages, faster than software rendering.
_HOLD = 1.0  # [s] Pause at the goal before the motion starts again.
_HIDE_WARNING = """document.head.insertAdjacentHTML("beforeend",
"<style>#webgl-software-rendering { display: none }</style>")"""  # viser's box covers the arm in a small frame.
_MARKUP = """<p>viser: <a href="{url}" target="_blank">{url}</a></p>
<iframe src="{url}" style="width: 100%; height: {height}px; border: none"></iframe>"""


class PreviewPage(Closeable):
    """A page that plays one motion: the arm solid, its goal as a ghost. Nothing on it can move a robot.

    Displays itself in a notebook as a link and a frame. Close it, or let it end with the kernel.

    Args:
        motion: The motion.
        model: The arm.
        port: TCP port on loopback; 0 takes any free one.
        language: "en" or "zh"; defaults to that of the notebook.

    Raises:
        InvalidValueError: The language is not supported.
        UsageError: The port is taken.
    """

    def __init__(self, motion: Motion, model: RobotModel, *, port: int = 0, language: str | None = None) -> None:
        require_motion(motion)
        require_model(model)
        self._motion = motion
        self._guarded_server, self.port = open_page(port)
        scene = ViserScene(self._guarded_server.viser, shadows=False)
        ArmView(scene, "goal", model, "plan").show(motion.goal)
        self._arm = ArmView(scene, "arm", model)
        self._arm.show(motion.start)
        text = Text(chosen_language(language), "rcilab.notebook")
        gui = self._guarded_server.viser.gui
        last = max(math.ceil(1e3 * motion.duration) / 1e3, _PERIOD)
        self._play = gui.add_checkbox(text("timeline.play"), True)
        self._slider = gui.add_slider(text("timeline.time"), min=0.0, max=last, step=0.001, initial_value=0.0)
        self._speed = gui.add_dropdown(text("timeline.rate"), ("1", "0.5", "0.25", "0.1"))
        self._closed = threading.Event()
        self._player = threading.Thread(target=self._run, name="rcilab preview", daemon=True)
        self._player.start()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.port}/"

    @property
    def time(self) -> float:
        """The time of the motion on the page, [s]."""
        return float(self._slider.value)

    def close(self) -> None:
        """Closes the page; may be called twice."""
        if not self._closed.is_set():
            self._closed.set()
            self._player.join()
            self._guarded_server.close()

    def __repr__(self) -> str:
        return f"<PreviewPage {self.url}>"

    def _repr_html_(self, height: int = 420) -> str:
        return _MARKUP.format(url=self.url, height=height)

    def _run(self) -> None:
        """Plays, and follows the slider: a time that differs from the last one set here was set on the page."""
        t, shown, resting = 0.0, 0.0, 0.0
        while not self._closed.wait(_PERIOD):
            wanted = self._slider.value
            if wanted != shown:
                self._play.value, resting = False, 0.0
                t = min(max(wanted, 0.0), self._motion.duration) if math.isfinite(wanted) else shown
            elif self._play.value and t < self._motion.duration:
                t = min(t + _PERIOD * float(self._speed.value), self._motion.duration)
            elif self._play.value:
                resting += _PERIOD
                if resting >= _HOLD:
                    t, resting = 0.0, 0.0
            self._arm.show(self._motion.at(t).q)
            self._slider.value = shown = round(t, 3)


def serve_preview(motion: Motion, model: RobotModel, *, port: int = 0, language: str | None = None) -> PreviewPage:
    """Returns a page on loopback that plays a motion; in a notebook it displays itself as a link and a frame.

    Args:
        motion: The motion.
        model: The arm.
        port: TCP port on loopback; 0 takes any free one.
        language: "en" or "zh"; defaults to that of the notebook.

    Raises:
        InvalidValueError: The language is not supported.
        UsageError: The port is taken.
    """
    return PreviewPage(motion, model, port=port, language=language)


def open_page(port: int) -> tuple[GuardedServer, int]:
    """Returns a viser page on loopback with an empty environment, and its TCP port.

    Args:
        port: TCP port; 0 takes any free one.

    Raises:
        UsageError: The port is taken.
    """
    try:
        bound = listen(LOOPBACK, port)
    except OSError as error:
        raise UsageError(
            f"cannot listen on {LOOPBACK} port {port} ({error.strerror}); port=0 takes a free one"
        ) from error
    number = int(bound.getsockname()[1])
    server = GuardedServer(bound, AccessPolicy(host=LOOPBACK, port=number))
    server.viser.gui.configure_theme(show_logo=False, show_share_button=False)
    place_camera(server.viser)
    add_environment(server.viser, full=False)
    server.viser.on_client_connect(lambda client: run_javascript(client, _HIDE_WARNING))
    return server, number
