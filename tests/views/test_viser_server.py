"""A guarded viser without a page of ours: what the preview uses. The decorated one is tried in tests/workbench."""

from __future__ import annotations

import http.client
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress

import msgspec
import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from rcilab.views.access_control import AccessPolicy
from rcilab.views.pending_connections import BACKLOG, MAX_PENDING
from rcilab.views.viser_ext.message_guard import is_bounded
from rcilab.views.viser_server import GuardedServer, listen

PROTOCOL = f"viser-v{viser.__version__}"
CLOSING_TIME = 0.1  # [s] A page that has not read all that was sent to it waits in vain for the answer to its goodbye.


@pytest.fixture(scope="module")
def guarded() -> Iterator[tuple[GuardedServer, int]]:
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    with GuardedServer(bound, AccessPolicy(host="127.0.0.1", port=port)) as server:
        yield server, port


def fetch(port: int, host: str) -> tuple[int, dict[str, str]]:
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    link.request("GET", "/", headers={"Host": host})
    answer = link.getresponse()
    answer.read()
    link.close()
    return answer.status, dict(answer.getheaders())


def test_the_page_is_visers_own_and_a_notebook_elsewhere_may_frame_it(guarded) -> None:
    _, port = guarded
    status, headers = fetch(port, f"localhost:{port}")
    assert status == 200
    assert "Content-Security-Policy" not in headers


def test_a_rebound_name_gets_no_page(guarded) -> None:
    assert fetch(guarded[1], "evil.example")[0] == 403


@pytest.mark.parametrize("path", ["/", "/rcilab/live"])
def test_a_foreign_origin_gets_no_websocket(guarded, path: str) -> None:
    with pytest.raises(InvalidStatus) as caught:
        connect(f"ws://127.0.0.1:{guarded[1]}{path}", additional_headers={"Origin": "http://evil.example"})
    assert caught.value.response.status_code == 403


def test_a_number_that_is_none_reaches_no_control(guarded) -> None:
    server, port = guarded
    spoiled, after = (server.viser.gui.add_slider(name, 0.0, 1.0, 0.1, 0.5) for name in ("x", "y"))
    origin = {"Origin": f"http://127.0.0.1:{port}"}
    with connect(f"ws://127.0.0.1:{port}/", additional_headers=origin, subprotocols=[PROTOCOL]) as page:  # type: ignore[list-item]
        for slider, value in ((spoiled, 0.25), (spoiled, float("nan")), (spoiled, float("inf")), (after, 0.75)):
            message = {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": {"value": value}}
            page.send(msgspec.msgpack.encode(message))
        end = time.monotonic() + 10.0
        while after.value != 0.75 and time.monotonic() < end:
            time.sleep(0.01)
    assert (spoiled.value, after.value) == (0.25, 0.75)


def test_closing_lets_go_of_the_port() -> None:
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    GuardedServer(bound, AccessPolicy(host="127.0.0.1", port=port)).close()
    listen("127.0.0.1", port).close()


def test_a_taken_port_is_refused_and_nothing_stays_open() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OSError, match="in use"):
            listen("127.0.0.1", taken.getsockname()[1])


@pytest.mark.parametrize(
    ("value", "finite"),
    [(1.0, True), (float("nan"), False), ([0.0, float("inf")], False), ("nan", True), ([[1], (2.0,)], True)],
)
def test_a_message_is_looked_into_to_the_end(value, finite):
    assert is_bounded(value) is finite


def test_with_an_open_address_every_page_that_brings_the_token_gets_in_and_no_other() -> None:
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    gate = AccessPolicy(host="0.0.0.0", port=port, token="s3cret")
    headers = {"Origin": f"http://127.0.0.1:{port}"}
    with GuardedServer(bound, gate, decorate=lambda page: page):
        for secret, status in (("?token=s3cret", 200), ("", 403), ("?token=guessed", 403)):
            link = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
            link.request("GET", f"/{secret}")
            answer = link.getresponse()
            assert answer.status == status
            if status == 200:
                headers["Cookie"] = (answer.getheader("Set-Cookie") or "").partition(";")[0]
            link.close()
        address = f"ws://127.0.0.1:{port}/"
        for _ in range(2):
            with connect(address, additional_headers=headers, subprotocols=[PROTOCOL]) as page:  # type: ignore[list-item]
                assert page.recv(timeout=20)
        with pytest.raises(InvalidStatus):
            connect(address, additional_headers={"Origin": headers["Origin"]}, subprotocols=[PROTOCOL])  # type: ignore[list-item]


@pytest.mark.parametrize(
    "request_line",
    ["GET /" + "x" * 300 + " HTTP/1.1", "GET /" + "%41" * 300 + ".js HTTP/1.1"],
)
def test_a_path_that_cannot_be_is_a_bad_request(guarded, request_line: str) -> None:
    assert answer_to(guarded[1], request_line) == 400


@pytest.mark.parametrize("name", ["Host", "Cookie", "Upgrade", "Accept-Encoding"])
def test_a_doubled_header_is_a_bad_request(guarded, name: str) -> None:
    assert answer_to(guarded[1], "GET / HTTP/1.1", *2 * [f"{name}: websocket"]) == 400


def test_a_page_of_another_version_is_told_to_load_again(guarded) -> None:
    origin = {"Origin": f"http://127.0.0.1:{guarded[1]}"}
    with pytest.raises(InvalidStatus) as caught:
        connect(f"ws://127.0.0.1:{guarded[1]}/", additional_headers=origin, subprotocols=["viser-v0.0.1"])  # type: ignore[list-item]
    assert caught.value.response.status_code == 400


def answer_to(port: int, request_line: str, *headers: str) -> int:
    """The status of the answer to a request that no library would send."""
    own = [] if any(header.startswith("Host") for header in headers) else [f"Host: 127.0.0.1:{port}"]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as link:
        link.sendall("\r\n".join([request_line, *own, *headers, "", ""]).encode())
        return int(link.recv(4096).split()[1])


def open_page(port: int):
    return connect(
        f"ws://127.0.0.1:{port}/",
        additional_headers={"Origin": f"http://127.0.0.1:{port}"},
        subprotocols=[PROTOCOL],  # type: ignore[list-item]
        compression=None,
        close_timeout=CLOSING_TIME,
    )


def test_text_that_is_no_unicode_ends_no_page(guarded) -> None:
    """Such as a file name, or a key of a hostile file; viser says it again to every page that comes."""
    server, port = guarded
    label = server.viser.gui.add_text("half \ud800", initial_value="caf\udce9")
    for _ in range(2):
        with open_page(port) as page:
            assert page.recv(timeout=10)
            time.sleep(0.3)
            page.ping().wait(10)
            assert page.close_code is None
    label.remove()


def test_who_only_connects_takes_nobodys_place(guarded) -> None:
    _, port = guarded
    idle: list[socket.socket] = []
    for _ in range(3 * MAX_PENDING):
        idle.append(socket.create_connection(("127.0.0.1", port)))
        if len(idle) % (BACKLOG // 2) == 0:  # More than are accepted at a time would come again only a second later.
            assert fetch(port, f"127.0.0.1:{port}")[0] == 200
    try:
        assert fetch(port, f"127.0.0.1:{port}")[0] == 200
        with open_page(port) as page:
            assert page.recv(timeout=10)
        for link in idle[: 2 * MAX_PENDING]:  # The oldest are gone.
            link.settimeout(10.0)
            with suppress(ConnectionResetError):
                assert link.recv(1) == b""
    finally:
        for link in idle:
            link.close()


def test_a_server_without_a_file_left_says_so_once_and_goes_on() -> None:
    code = """
import resource, socket, sys, time
from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_server import GuardedServer, listen
bound = listen("127.0.0.1", 0)
port = bound.getsockname()[1]
server = GuardedServer(bound, AccessPolicy(host="127.0.0.1", port=port))
links = [socket.socket() for _ in range(12)]  # Fewer than are accepted at a time: others wait to come again.
resource.setrlimit(resource.RLIMIT_NOFILE, (links[-1].fileno() + 1, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
for link in links:
    link.setblocking(False)
    link.connect_ex(("127.0.0.1", port))
time.sleep(1.5)
for link in links:
    link.close()
time.sleep(1.5)
page = socket.create_connection(("127.0.0.1", port), timeout=10)
page.sendall(f"GET / HTTP/1.1\\r\\nHost: 127.0.0.1:{port}\\r\\n\\r\\n".encode())
print(page.recv(12).decode())
page.close()
server.close()
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "HTTP/1.1 200"
    assert [line for line in ran.stderr.splitlines() if line] == [
        "no page can be connected at present: Too many open files; open pages are not affected. Close programs, or "
        "allow more open files (ulimit -n)"
    ]
