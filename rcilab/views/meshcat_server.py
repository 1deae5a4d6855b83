"""A meshcat server that only this machine can reach.

meshcat's own server prints a 127.0.0.1 address but listens on every interface, and has no option for that. This server
runs meshcat's scene tree and page in a thread of this process, with the web port bound to 127.0.0.1 and without ZeroMQ:
drawing commands are passed in memory. Tornado refuses websockets of foreign origin (403). The page opens its websocket
at a path relative to its own, so that it works behind a proxy with a path prefix; meshcat's own page uses /.
"""

from __future__ import annotations

import asyncio
import threading
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from rcilab.core.errors import ConnectionLostError, DeadlineError

_HOST = "127.0.0.1"
_CONNECT = "viewer.connect();"
_CONNECT_RELATIVE = """viewer.connect(new URL("../", location.href.split("?")[0]).href.replace(/^http/, "ws"));
if (location.search === "?plain") {
  document.head.insertAdjacentHTML("beforeend", "<style>.dg { display: none }</style>");
}"""
_TIMEOUT = 10.0  # [s] for the thread to answer; it does so in milliseconds


def import_meshcat() -> Any:
    """Returns the module, without the warning that meshcat 0.3.2 imports a deprecated module of pyzmq."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        import meshcat.geometry
        import meshcat.servers.zmqserver
    return meshcat


class MeshcatServer:
    """Serves one scene to browsers on this machine until closed. Usable as the window of a `meshcat.Visualizer`."""

    def __init__(self) -> None:
        import_meshcat()
        self._ready: Future[str] = Future()
        self._loop = asyncio.new_event_loop()
        self._bridge: Any = None
        self._thread = threading.Thread(target=self._serve, name="meshcat", daemon=True)
        self._thread.start()
        self.web_url = self._ready.result(_TIMEOUT)
        """Address of the page."""

    def send(self, command: Any) -> None:
        """Sends a drawing command (a meshcat object) to every open page."""
        import umsgpack

        content: Mapping[str, Any] = command.lower()
        frames = [str(content["type"]).encode(), str(content["path"]).encode(), umsgpack.packb(content)]
        self._post(lambda: self._bridge.handle_zmq(frames))

    def get_scene(self) -> str:
        """Returns the whole scene as one HTML page that needs no server."""
        return self._call(self._bridge.scene_html)

    def flush(self) -> None:
        """Waits until all commands have been sent."""
        self._call(lambda: "")

    def close(self) -> None:
        """Stops serving; open pages keep what they show. Calling it again does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(_TIMEOUT)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._bridge = _build_bridge()
            http, port = _listen(self._bridge.app)
            self._ready.set_result(f"http://{_HOST}:{port}/static/")
        except Exception as error:  # The constructor raises it.
            self._ready.set_exception(error)
            return
        self._loop.run_forever()
        http.stop()
        self._loop.run_until_complete(http.close_all_connections())
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()

    def _post(self, work: Callable[[], None]) -> None:
        """Runs a function in the server's thread, in order, without waiting for it."""
        try:
            self._loop.call_soon_threadsafe(work)
        except RuntimeError as error:
            raise ConnectionLostError("this meshcat server was closed; make a new MeshcatScene") from error

    def _call(self, function: Callable[[], str]) -> str:
        result: Future[str] = Future()
        self._post(lambda: result.set_result(function()))
        try:
            return result.result(_TIMEOUT)
        except TimeoutError as error:
            raise DeadlineError(f"the meshcat server did not answer within {_TIMEOUT:g} s") from error


def _listen(app: Any) -> tuple[Any, int]:
    """Returns an HTTP server on a free port of the loopback interface, and the port."""
    from tornado.httpserver import HTTPServer
    from tornado.netutil import bind_sockets

    sockets = bind_sockets(0, _HOST)
    http = HTTPServer(app)
    http.add_sockets(sockets)
    return http, int(sockets[0].getsockname()[1])


def _build_bridge() -> Any:
    """Returns meshcat's bridge, which owns the scene tree, with a variable in place of its ZeroMQ socket."""
    import tornado.web
    from meshcat.servers import zmqserver

    class Page(zmqserver.WebSocketHandler):
        """One open page; meshcat's own handler prints to stderr for each."""

        def open(self, *args: str, **kwargs: str) -> None:
            self.bridge.websocket_pool.add(self)
            self.bridge.send_scene(self)

        def on_close(self) -> None:
            self.bridge.websocket_pool.discard(self)

        def on_message(self, message: str | bytes) -> None:
            pass  # Pages reply only to requests for pictures, which this server never sends.

    class Front(tornado.web.RequestHandler):
        """The page itself."""

        def get(self) -> None:
            self.set_header("Cache-Control", "no-store")
            self.finish(_front_page(zmqserver))

    class Bridge(zmqserver.ZMQWebSocketBridge):
        def __init__(self) -> None:
            self.websocket_pool = set()
            self.tree = zmqserver.SceneTree()
            self.zmq_socket = _Reply()
            self.app = self.make_app()

        def make_app(self) -> tornado.web.Application:
            static = {"path": zmqserver.VIEWER_ROOT, "default_filename": zmqserver.VIEWER_HTML}
            front = (r"/static/(?:index\.html)?", Front)
            routes = [
                front,
                (r"/static/(.*)", zmqserver.StaticFileHandlerNoCache, static),
                (r"/", Page, {"bridge": self}),
            ]
            return tornado.web.Application(routes, log_function=lambda handler: None)

        def scene_html(self) -> str:
            self.handle_zmq([b"get_scene"])
            return self.zmq_socket.last.decode("utf-8")

    return Bridge()


def _front_page(zmqserver: Any) -> str:
    """Returns meshcat's page with a relative websocket address; with ?plain, without meshcat's menu."""
    page = (Path(zmqserver.VIEWER_ROOT) / zmqserver.VIEWER_HTML).read_text(encoding="utf-8")
    assert _CONNECT in page, "meshcat's page has changed; check how it connects"
    return page.replace(_CONNECT, _CONNECT_RELATIVE)


class _Reply:
    """Stores the bridge's reply in place of a ZeroMQ socket."""

    def __init__(self) -> None:
        self.last = b""

    def send(self, reply: bytes) -> None:
        self.last = reply
