"""Spoilt messages over real sockets: the simulation port, and the websockets of the page."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import msgspec
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from rcilab.app.view_actions import SetView
from rcilab.workbench.app import Workbench
from tests.fuzz.noise import spoilt
from tests.makers.rokae.controller.test_server import running
from tests.workbench.opened import opened, wait

CLOSING_TIME = 0.1  # [s] What has not read all that was sent to it waits in vain for the answer to its goodbye.
_REQUESTS: tuple[dict[str, Any], ...] = (
    {"request": "status"},
    {"request": "push", "wrench": [0, 0, -20, 0, 0, 0], "duration": 1},
    {"request": "press", "button": "none"},
    {"request": "place_box", "box": "a", "size": [0.1, 1, 1], "position": [2, 0, 0.5], "wxyz": [1, 0, 0, 0]},
    {"request": "set_input", "signal": 1, "level": True},
    {"request": "network", "faults": {"loss": 0.0}, "direction": "both"},
    {"request": "limits", "table": "manual"},
)


def fuzz_world(count: int, seed: int) -> None:
    """Sends so many spoilt lines; the controller lives and answers the next guest."""
    corpus = [json.dumps({"id": 1, **request}).encode() for request in _REQUESTS]
    with running(lockstep=True) as found:
        assert found.server.world_address is not None
        host, _, port = found.server.world_address.partition(":")
        link, stream = None, None
        for line in spoilt(corpus, count, seed):
            if link is None:
                link = socket.create_connection((host, int(port)), timeout=30.0)
                stream = link.makefile("rb")
            with suppress(ConnectionError):
                link.sendall(line.replace(b"\n", b" ") + b"\n")
            answer = b""
            with suppress(ConnectionError):
                assert stream is not None
                answer = stream.readline()
            if answer:
                assert isinstance(json.loads(answer)["ok"], bool)
            if not answer or not json.loads(answer)["ok"]:
                link.close()
                link = None
        if link is not None:
            link.close()
        with socket.create_connection((host, int(port)), timeout=30.0) as link:
            link.sendall(b'{"id": 5, "request": "status"}\n')
            assert json.loads(link.makefile("rb").readline())["ok"] is True


def _page_messages(bench: Workbench) -> list[bytes]:
    inputs = bench.server.gui._gui_input_handle_from_uuid
    texts = [uuid for uuid, handle in inputs.items() if isinstance(handle.value, str)][:20]
    numbers = [uuid for uuid, handle in inputs.items() if isinstance(handle.value, float)][:20]
    place: dict[str, Any] = {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [0.1, 0.2, 0.3]}
    messages: list[dict[str, Any]] = [
        *({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": "0.5"}} for uuid in texts),
        *({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": 0.5}} for uuid in numbers),
        {"type": "TransformControlsUpdateMessage", "name": "/target", "owner": "", **place},
        {"type": "TransformControlsDragStartMessage", "name": "/target", "owner": ""},
        {"type": "SceneNodeClickMessage", "name": "/target", "instance_index": None, "ray_origin": [0.0] * 3,
         "ray_direction": [0.0] * 3, "screen_pos": [0.5, 0.5], "modifier": None, "owner": ""},
        {"type": "FileTransferStartUpload", "source_component_uuid": texts[0], "transfer_uuid": "t", "filename": "a",
         "mime_type": "b", "part_count": 1, "size_bytes": 4},
        {"type": "FileTransferPart", "source_component_uuid": texts[0], "transfer_uuid": "t", "part_index": 0,
         "content": b"abcd"},
        {"type": "ViewerCameraMessage", **place, "fov": 1.0, "near": 0.1, "far": 9.0, "image_height": 9,
         "image_width": 9, "look_at": [0.0] * 3, "up_direction": [0.0, 0.0, 1.0]},
        {"type": "CommandTriggerMessage", "uuid": texts[0]},
    ]  # fmt: skip
    return [msgspec.msgpack.encode(message) for message in messages]


def _words(page: int, key: str) -> list[bytes]:
    kinds = ("seek", "size", "here", "tab", "entered", "home", "peek", "software", "branch", "condition")
    fields = {"share": 0.5, "height": 700.0, "index": 1, "branch": 1, "id": "joint.velocity"}
    said = [{"kind": kind, **fields} for kind in kinds]
    said += [{"kind": "edit", "what": what, "key": 1, "index": 0} for what in ("select", "move", "delete", "undo")]
    return [json.dumps(words).encode() for words in ({"kind": "hello", "page": page, "key": key}, *said)]


def _enter(bench: Workbench) -> ClientConnection:
    protocol: Any = f"viser-v{viser.__version__}"
    link = connect(
        f"ws://127.0.0.1:{bench.port}/", additional_headers={"Origin": f"http://127.0.0.1:{bench.port}"},
        subprotocols=[protocol], max_size=None, ping_interval=None, close_timeout=CLOSING_TIME,
    )  # fmt: skip
    link.recv(timeout=30.0)
    return link


@contextmanager
def open_page(bench: Workbench, *, reads: bool = True) -> Iterator[ClientConnection]:
    """A page that says where its camera is, as every browser does, and holds the controls; it answers in its bar.

    Args:
        bench: What to open.
        reads: Whether it reads what the bar is told, and so shows that somebody is there.
    """
    before = set(bench.server.get_clients())
    camera = next(m for m in _page_messages(bench) if b"ViewerCameraMessage" in m)
    origin = {"Origin": f"http://127.0.0.1:{bench.port}"}
    with (
        _enter(bench) as link,
        connect(
            f"ws://127.0.0.1:{bench.port}/rcilab/live",
            additional_headers=origin,
            max_size=None,
            ping_interval=None,
            close_timeout=CLOSING_TIME,
        ) as bar,
    ):
        link.send(camera)
        wait(lambda: set(bench.server.get_clients()) != before, "the page")
        (page,) = set(bench.server.get_clients()) - before
        wait(lambda: page in bench.store.state.control_lock.pages, "the page to be listed")
        bar.send(json.dumps({"kind": "hello", "page": page, "key": bench.live.introduce(page)}))

        def answer() -> None:
            with suppress(ConnectionClosed):
                for said in bar:
                    if "beat" in json.loads(said):
                        bar.send('{"kind": "here"}')

        if reads:
            threading.Thread(target=answer, daemon=True).start()
        yield link


def fuzz_page(count: int, seed: int) -> None:
    """Sends so many spoilt messages, by the page with the controls and in its bar; the workbench goes on as it was."""
    with opened() as bench:
        corpus = _page_messages(bench)
        link, sent = _enter(bench), 0
        bar = connect(
            f"ws://127.0.0.1:{bench.port}/rcilab/live",
            additional_headers={"Origin": f"http://127.0.0.1:{bench.port}"},
        )
        link.send(corpus[-2])  # Its camera: from then on it is a page.
        wait(lambda: bench.store.state.control_lock.holder is not None, "the controls")
        page = bench.store.state.control_lock.holder
        assert page is not None
        words = _words(page, bench.live.introduce(page))
        for number, message in enumerate(spoilt(corpus, count, seed)):
            try:
                link.send(message)
                sent += 1
                if number % 10 == 0:
                    bar.send(next(spoilt(words, 1, seed + number)))
            except ConnectionClosed:
                link = _enter(bench)
            if number % 100 == 0:
                with suppress(TimeoutError, ConnectionClosed):
                    while True:
                        link.recv(timeout=0)
        link.close()
        bar.close()
        assert sent > count // 2
        height = bench.store.state.height + 1.0
        bench.dispatcher.ask(SetView(name="height", value=height))
        wait(lambda: bench.store.state.height == height, "the dispatcher to go on")
        assert bench.session.status().phase == "idle"
        with _enter(bench) as fresh:
            assert fresh.recv(timeout=30.0)
