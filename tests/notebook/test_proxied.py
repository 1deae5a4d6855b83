"""Below a path of a proxied notebook server the frame of a scene is served, and its websocket brings the arm."""

from __future__ import annotations

import asyncio
import json
import os
import re
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import rcilab
from rcilab import notebook
from rcilab.notebook.place import find_place
from tests.late import Late

if TYPE_CHECKING:
    from tornado.httpclient import HTTPRequest

httpclient, websocket, umsgpack = Late("tornado.httpclient"), Late("tornado.websocket"), Late("umsgpack")


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """A notebook server below /arm/ with jupyter-server-proxy, as it writes about itself."""
    folder = tmp_path_factory.mktemp("server")
    environment = {**os.environ, "JUPYTER_CONFIG_DIR": str(folder), "JUPYTER_DATA_DIR": str(folder)}
    environment["JUPYTER_RUNTIME_DIR"] = str(folder / "runtime")
    command = [sys.executable, "-m", "jupyter_server", "--ServerApp.ip=127.0.0.1", "--ServerApp.port=0"]
    command += ["--ServerApp.base_url=/arm/", "--no-browser", "--allow-root", f"--ServerApp.root_dir={folder}"]
    with open(folder / "log", "w", encoding="utf-8") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        yield wait_for_server(folder / "runtime", process, folder / "log")
    finally:
        process.terminate()
        process.wait(10)


def wait_for_server(runtime: Path, process: subprocess.Popen[bytes], log: Path) -> dict[str, Any]:
    deadline = time.monotonic() + 40.0
    while time.monotonic() < deadline:
        assert process.poll() is None, log.read_text(encoding="utf-8")
        for file in runtime.glob("jpserver-*.json"):
            text = file.read_text(encoding="utf-8")
            if text.strip().endswith("}"):
                return {**json.loads(text), "runtime": str(runtime)}
        time.sleep(0.05)
    raise AssertionError("no server within 40 s:\n" + log.read_text(encoding="utf-8"))


def test_a_scene_is_live_through_the_proxy(server: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    import_module("ipykernel")  # What makes this process look like a kernel.
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", server["runtime"])
    place = find_place({"JPY_PARENT_PID": str(server["pid"])})
    assert (place.way, place.base) == ("proxy", "/arm/")
    model = rcilab.load_model("xMate3")
    with notebook.Scene(model, place=place) as scene:
        found = re.search(r'src="(/arm/proxy/[^"]*)"', scene._frame.value)
        assert found is not None
        origin = f"http://127.0.0.1:{server['port']}"
        keys = {"Authorization": f"token {server['token']}"}
        with urllib.request.urlopen(urllib.request.Request(origin + found[1], headers=keys), timeout=20) as answer:
            page = answer.read().decode()
        assert 'new URL("../"' in page
        socket = "ws" + (origin + found[1]).removeprefix("http").split("static/")[0]
        paths = asyncio.run(drawn(httpclient.HTTPRequest(socket, headers={**keys, "Origin": origin})))
        assert "/meshcat/arm/joint1" in paths


async def drawn(request: HTTPRequest) -> set[str]:
    """Names of what the page is told first, until the arm is among it."""
    socket = await websocket.websocket_connect(request)
    paths: set[str] = set()
    while "/meshcat/arm/joint1" not in paths:
        message = await asyncio.wait_for(socket.read_message(), 20.0)
        assert isinstance(message, bytes), "the connection was closed"
        paths.add(umsgpack.unpackb(message)["path"])
    socket.close()
    while await socket.read_message() is not None:
        pass
    return paths
