"""Every door of the page: who gets in, who does not, and what they cannot do once inside."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator

import msgspec
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from rcilab.core.errors import UsageError
from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_server import GuardedServer, listen
from rcilab.workbench import security
from rcilab.workbench.live import HEARTBEAT_PATH, LIVE_PATH, Answer, Here, LiveChannel, PageMessage, Seek, Take
from rcilab.workbench.page import decorate
from rcilab.workbench.security import bind, check_host
from tests.waiting import wait_for


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.2", "localhost", "::1"])
def test_loopback_needs_no_token(host):
    check_host(host, None)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.5", "::"])
def test_an_open_address_without_a_token_is_refused_in_one_sentence(host):
    with pytest.raises(UsageError, match="give a token") as caught:
        check_host(host, None)
    assert "\n" not in str(caught.value)
    check_host(host, "sixteen letters!")


def test_a_name_that_begins_like_loopback_is_not_loopback(monkeypatch):
    def resolve(host, *args, **kwargs):
        assert host == "127.evil.example"
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", ("192.0.2.1", 0))]

    monkeypatch.setattr(socket, "getaddrinfo", resolve)
    with pytest.raises(UsageError, match="opens the workbench to the network"):
        check_host("127.evil.example", None)


def test_a_name_that_leads_nowhere_is_refused():
    with pytest.raises(UsageError, match="is not an address of this machine"):
        check_host("127.evil.invalid", None)


def test_what_counts_is_where_the_socket_is(monkeypatch):
    """A name may lead elsewhere by the time that it is listened on."""
    monkeypatch.setattr("rcilab.views.viser_server.listen", lambda host, port: listen("0.0.0.0", 0))
    with pytest.raises(UsageError, match="opens the workbench to the network"):
        bind("127.0.0.1", 0)
    bind("127.0.0.1", 0, "sixteen letters!").close()


def test_a_busy_port_is_refused_and_says_what_to_change():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(UsageError, match=rf"port {port} is in use.*--port {port + 1}"):
            bind("127.0.0.1", port)


def test_an_address_that_is_not_ours_is_refused():
    with pytest.raises(UsageError, match="--host"):
        bind("192.0.2.1", 0)


class Door:
    """A running server behind the gate."""

    def __init__(self) -> None:
        self.stops = threading.Event()
        self.received: list[tuple[int, PageMessage]] = []
        self.malformed = 0
        self.live = LiveChannel(
            self.stops.set, lambda page, message: self.received.append((page, message)), self.count_malformed
        )
        bound = bind("127.0.0.1", 0)
        self.port = bound.getsockname()[1]
        self.guard = GuardedServer(
            bound,
            AccessPolicy(host="127.0.0.1", port=self.port),
            decorate=decorate,
            routes={LIVE_PATH: self.live.serve, HEARTBEAT_PATH: self.live.serve_heartbeats},
        )
        self.server = self.guard.viser

    def count_malformed(self) -> None:
        self.malformed += 1

    def connect(self, path: str = "/", origin: str | None = "", protocol: str | None = None):
        headers = {} if origin is None else {"Origin": origin or f"http://127.0.0.1:{self.port}"}
        return connect(
            f"ws://127.0.0.1:{self.port}{path}",
            additional_headers=headers,
            subprotocols=None if protocol is None else [protocol],
            compression=None,
        )


@pytest.fixture(scope="module")
def door() -> Iterator[Door]:
    opened = Door()
    yield opened
    opened.guard.close()


PROTOCOL = f"viser-v{__import__('viser').__version__}"


@pytest.mark.parametrize("origin", [None, "http://evil.example"])
@pytest.mark.parametrize("path", ["/", LIVE_PATH, HEARTBEAT_PATH])
def test_the_real_server_answers_403_to_strangers(door, origin, path):
    with pytest.raises(InvalidStatus) as caught:
        door.connect(path, origin, PROTOCOL)
    assert caught.value.response.status_code == 403


def test_the_real_server_lets_its_own_page_in(door):
    with door.connect(protocol=PROTOCOL) as page:
        assert page.recv(timeout=10)


def test_it_listens_on_loopback_only(door):
    with socket.socket() as other:
        other.settimeout(1.0)
        assert other.connect_ex(("127.0.0.9", door.port)) != 0


def test_the_page_is_ours_and_cannot_be_framed_by_strangers(door):
    status, headers, body = fetch(door.port, f"127.0.0.1:{door.port}")
    assert status == 200
    assert b"rl-stop" in body
    assert b"<title>rcilab workbench</title>" in body
    assert headers["Content-Security-Policy"].startswith("frame-ancestors 'self'")
    assert fetch(door.port, "evil.example")[0] == 403


def fetch(port: int, host: str) -> tuple[int, dict[str, str], bytes]:
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    link.request("GET", "/", headers={"Host": host})
    answer = link.getresponse()
    body = answer.read()
    link.close()
    return answer.status, dict(answer.getheaders()), body


def test_nobody_can_ask_for_the_share_tunnel(door):
    from viser import _messages

    handlers = door.server._websock_server._incoming_handlers
    assert _messages.ShareUrlRequest not in handlers
    assert _messages.ShareUrlDisconnect not in handlers


def test_a_client_can_set_a_value_but_neither_nan_nor_anything_else(door):
    gui = door.server.gui
    slider = gui.add_slider("x", 0.0, 1.0, 0.1, 0.5)
    button_like = gui.add_checkbox("marker", False)

    @slider.on_update
    async def _(_event):
        pass

    def update(uuid: str, **updates) -> bytes:
        return msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates})

    arrived = threading.Event()

    @button_like.on_update
    async def _(_event):
        arrived.set()

    with door.connect(protocol=PROTOCOL) as page:
        page.send(update(slider._impl.uuid, value=float("nan")))
        page.send(update(slider._impl.uuid, update_cb=[]))
        page.send(update(slider._impl.uuid, value=0.7, update_cb=[]))
        page.send(update(slider._impl.uuid, value=0.25))
        wait_for(lambda: slider.value == 0.25)
    assert len(slider._impl.update_cb) == 1
    assert slider.value == 0.25


GARBAGE: tuple[str | bytes, ...] = (
    "", "{", "[]", "1", "x" * 9000, "[" * 4000, b"\xff\x00", '{"kind": []}', '{"kind": "clear"}',
    json.dumps({"kind": "seek", "share": "x"}), '{"kind":"seek","share":NaN}', '{"kind":"seek","share":1e999}',
    json.dumps({"kind": "seek", "share": True}), json.dumps({"kind": "answer", "yes": 1}),
    json.dumps({"kind": "condition", "id": "joint.velocity\n"}), json.dumps({"kind": "condition", "id": "a" * 61}),
    json.dumps({"kind": "peek"}), json.dumps({"kind": "peek", "branch": -1}),
    json.dumps({"kind": "branch", "index": 10**30}), json.dumps({"kind": "tab", "index": -1}),
    *(json.dumps({"kind": "edit", **edit}) for edit in (
        {"what": "select", "key": 1}, {"what": "clear", "key": 1, "index": 1}, {"what": ["up"], "key": 1, "index": 0},
        {"what": "select", "key": "x", "index": 0}, {"what": "select", "key": -1, "index": 0},
    )),
)  # fmt: skip


def test_stop_and_seek_arrive_over_the_live_channel_and_garbage_does_not_hurt_it(door):
    door.stops.clear()
    door.received.clear()
    door.malformed = 0
    with door.connect("/rcilab/live") as page:
        assert isinstance(json.loads(page.recv(timeout=10)), dict)
        page.send(json.dumps({"kind": "seek", "share": 0.5}))  # Of nobody that we know.
        page.send(json.dumps({"kind": "hello", "page": 7, "key": door.live.introduce(7)}))
        for garbage in GARBAGE:
            page.send(garbage)
        page.send(json.dumps({"kind": "seek", "share": 7.0}))
        page.send(json.dumps({"kind": "seek", "share": 0.25}))
        page.send(json.dumps({"kind": "stop"}))
        assert door.stops.wait(10.0)
    assert door.received == [(7, Here()), (7, Seek(7.0)), (7, Seek(0.25))]
    assert door.malformed == len(GARBAGE)
    door.live.forget(7)


def test_published_values_reach_every_page_and_the_next_one_too(door):
    with door.connect("/rcilab/live") as first:
        first.recv(timeout=10)
        door.live.publish(chips=[{"id": "a"}], language="en")
        assert json.loads(first.recv(timeout=10)) == {"chips": [{"id": "a"}], "language": "en"}
        door.live.publish(chips=[{"id": "a"}], language="zh")
        assert json.loads(first.recv(timeout=10)) == {"language": "zh"}
        with door.connect("/rcilab/live") as second:
            assert json.loads(second.recv(timeout=10))["language"] == "zh"


def test_a_heartbeat_thread_gets_heartbeats_only_and_its_answers_count(door):
    door.received.clear()
    with door.connect(HEARTBEAT_PATH) as thread, door.connect(LIVE_PATH) as page:
        page.recv(timeout=10)
        thread.send(json.dumps({"kind": "hello", "page": 8, "key": door.live.introduce(8)}))
        wait_for(lambda: door.received == [(8, Here())], what="the greeting")
        door.live.publish(chips=[{"id": "b"}])
        door.live.beat()
        assert json.loads(thread.recv(timeout=10)) == {"beat": 1}
        assert [json.loads(page.recv(timeout=10)) for _ in range(2)] == [{"chips": [{"id": "b"}]}, {"beat": 1}]
        thread.send(json.dumps({"kind": "here"}))
        wait_for(lambda: door.received == [(8, Here())] * 2, what="the answer")
    door.live.forget(8)


def test_only_a_page_that_brings_its_key_is_somebody(door):
    door.received.clear()
    key = door.live.introduce(5)
    words = [{"kind": "here"}, {"kind": "take"}, {"kind": "answer", "yes": True}]
    with door.connect("/rcilab/live") as page:
        page.recv(timeout=10)
        for hello in ({"page": 5, "key": "guessed"}, {"page": 5}, {"page": "5", "key": key}, {"page": 6, "key": key}):
            for said in ({"kind": "hello", **hello}, *words):
                page.send(json.dumps(said))
        for said in ({"kind": "hello", "page": 5, "key": key}, *words, {"kind": "answer", "yes": 1}):
            page.send(json.dumps(said))
        wait_for(lambda: len(door.received) >= 4)
    assert door.received == [(5, message) for message in (Here(), Here(), Take(), Answer(yes=True))]
    door.live.forget(5)


def test_viser_is_left_as_it_was(door):
    import websockets.asyncio.server as serving

    assert serving.serve.__module__ == "websockets.asyncio.server"
    assert security.DEFAULT_PORT == 8080
