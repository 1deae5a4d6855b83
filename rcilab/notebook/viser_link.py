"""A motion on a page of its own: a link out of the notebook, on loopback, with a time slider and a play button."""

from __future__ import annotations

import math
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rcilab.errors import UsageError
from rcilab.model import RobotModel, require_model
from rcilab.motion.motion import Motion, require_motion
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.views.viser_stage import set_stage

if TYPE_CHECKING:
    import viser

LOOPBACK = "127.0.0.1"
_TICK = 1.0 / 30.0  # [s] As often as a slider sends, and more than software rendering shows.
_HOLD = 1.0  # [s] The arm rests at the goal before the motion starts again.
_MARKUP = """<p>viser: <a href="{url}" target="_blank">{url}</a></p>
<iframe src="{url}" style="width: 100%; height: {height}px; border: none"></iframe>"""


class PreviewPage:
    """A page that plays one motion: the arm solid, its goal as a ghost. Nothing on it can move a robot.

    Shows itself in a notebook as a link and a frame. Close it, or let it end with the kernel.

    Args:
        motion: What to play.
        model: The arm.
        port: TCP port on loopback; 0 takes any free one.

    Raises:
        UsageError: The port is taken.
    """

    def __init__(self, motion: Motion, model: RobotModel, *, port: int = 0) -> None:
        require_motion(motion)
        require_model(model)
        bound = _bind(port)
        self.port: int = bound.getsockname()[1]
        self._motion = motion
        self._server = _open_server(bound)
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        set_stage(self._server, quality="light")
        scene = ViserScene(self._server, shadows=False)
        ArmView(scene, "goal", model, "plan").show(motion.goal)
        self._arm = ArmView(scene, "arm", model)
        self._arm.show(motion.start)
        gui = self._server.gui
        last = max(math.ceil(1e3 * motion.duration) / 1e3, _TICK)
        self._play = gui.add_checkbox("Play", True)
        self._slider = gui.add_slider("Time [s]", min=0.0, max=last, step=0.001, initial_value=0.0)
        self._speed = gui.add_dropdown("Speed", ("1", "0.5", "0.25", "0.1"))
        self._closed = threading.Event()
        self._player = threading.Thread(target=self._run, name="rcilab preview", daemon=True)
        self._player.start()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.port}/"

    @property
    def time(self) -> float:
        """Where in the motion the page is, [s]."""
        return float(self._slider.value)

    def close(self) -> None:
        """Takes the page away; calling it again does nothing."""
        if not self._closed.is_set():
            self._closed.set()
            self._player.join()
            with _quiet():  # viser says that it stopped; whoever called us knows.
                self._server.stop()

    def __enter__(self) -> PreviewPage:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<PreviewPage {self.url}>"

    def _repr_html_(self, height: int = 420) -> str:
        return _MARKUP.format(url=self.url, height=height)

    def _run(self) -> None:
        """Plays, and follows the hand: a time that is not the one we set last was set by somebody on the page."""
        t, shown, resting = 0.0, 0.0, 0.0
        while not self._closed.wait(_TICK):
            wanted = self._slider.value
            if wanted != shown:
                self._play.value, resting = False, 0.0
                t = min(max(wanted, 0.0), self._motion.duration) if math.isfinite(wanted) else shown
            elif self._play.value and t < self._motion.duration:
                t = min(t + _TICK * float(self._speed.value), self._motion.duration)
            elif self._play.value:
                resting += _TICK
                if resting >= _HOLD:
                    t, resting = 0.0, 0.0
            self._arm.show(self._motion.at(t).q)
            self._slider.value = shown = round(t, 3)


def serve_preview(motion: Motion, model: RobotModel, *, port: int = 0) -> PreviewPage:
    """Returns a page on loopback that plays a motion; in a notebook it shows itself as a link and a frame.

    Args:
        motion: What to play.
        model: The arm.
        port: TCP port on loopback; 0 takes any free one.

    Raises:
        UsageError: The port is taken.
    """
    return PreviewPage(motion, model, port=port)


def _bind(port: int) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind((LOOPBACK, port))
        bound.listen(100)
    except OSError as error:
        bound.close()
        raise UsageError(
            f"cannot listen on {LOOPBACK} port {port} ({error.strerror}); port=0 takes a free one"
        ) from error
    return bound


def _open_server(bound: socket.socket) -> viser.ViserServer:
    """Starts viser on a bound socket, for pages of our own origin only and without its share tunnel."""
    import viser
    from viser import _messages

    port = bound.getsockname()[1]
    with _guarded_serve(bound, [f"http://{LOOPBACK}:{port}", f"http://localhost:{port}"]):
        server = viser.ViserServer(host=LOOPBACK, port=port, verbose=False)
    server._websock_server.unregister_handler(_messages.ShareUrlRequest)
    server._websock_server.unregister_handler(_messages.ShareUrlDisconnect)
    return server


@contextmanager
def _guarded_serve(bound: socket.socket, origins: list[Any]) -> Iterator[None]:
    """While it lasts, viser's server takes our socket, and websockets answers foreign origins with 403."""
    from websockets.asyncio import server as serving

    original = serving.serve

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        del host, port  # viser would move on to the next port; the socket is bound already.
        return original(handler, sock=bound, origins=origins, **options)

    serving.serve = serve
    try:
        with _quiet():  # viser prints a box of addresses; ours is one line.
            yield
    finally:
        serving.serve = original


@contextmanager
def _quiet() -> Iterator[None]:
    """Keeps viser from printing: it goes through rich, which in a notebook does not go through stdout."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
