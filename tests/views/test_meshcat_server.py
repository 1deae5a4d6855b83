"""The notebook's scene server: this machine only, its own pages only."""

from __future__ import annotations

import base64
import http.client
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from rcilab.core.errors import ConnectionLostError
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.meshcat_scene import MeshcatScene


@pytest.fixture
def scene() -> Iterator[MeshcatScene]:
    page = MeshcatScene()
    yield page
    page.close()


def listening_addresses() -> set[str]:
    """Local addresses of every TCP socket this process listens on, from /proc; hexadecimal address:port."""
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    ours = {os.readlink(link) for link in links if os.path.lexists(link)}
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in ours:  # 0A: LISTEN
                found.add(fields[1])
    return found


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads Linux's table of sockets")
def test_nothing_listens_beyond_loopback() -> None:
    before = listening_addresses()
    scene = MeshcatScene()
    try:
        added = listening_addresses() - before
        port = urlsplit(scene.url).port
        assert added == {f"0100007F:{port:04X}"}  # 127.0.0.1, and no second socket
    finally:
        scene.close()


def test_the_page_is_served_from_this_machine(scene: MeshcatScene) -> None:
    address = urlsplit(scene.url)
    assert address.hostname == "127.0.0.1"
    connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=10)
    connection.request("GET", "/static/")
    assert b"MeshCat" in connection.getresponse().read()
    connection.close()


@pytest.mark.parametrize(("origin", "status"), [("http://evil.example", 403), (None, 101)])
def test_websockets_of_foreign_pages_are_refused(scene: MeshcatScene, origin: str | None, status: int) -> None:
    address = urlsplit(scene.url)
    headers = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(bytes(16)).decode(),
        "Origin": origin or f"http://127.0.0.1:{address.port}",
    }
    connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=10)
    connection.request("GET", "/", headers=headers)
    assert connection.getresponse().status == status
    connection.close()


def test_the_scene_can_be_kept_as_one_page_without_a_server(scene: MeshcatScene) -> None:
    bare = len(scene.as_html())
    model = load_model("xMate3")
    ArmView(scene, "live", model).show(model.home)
    assert len(scene.as_html()) > bare + 100_000
    assert scene.visualizer.render_static() is not None


def test_closing_frees_the_port_and_later_drawing_is_said_plainly() -> None:
    scene = MeshcatScene()
    port = urlsplit(scene.url).port
    scene.close()
    scene.close()
    with pytest.raises(ConnectionLostError, match="closed"):
        scene.add_frame("/late")
    with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.1", port), timeout=5):
        pass
