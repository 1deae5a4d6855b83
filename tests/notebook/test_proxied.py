"""Below a path of a proxied notebook server the frame of a scene is served, and its websocket brings the arm."""

from __future__ import annotations

import asyncio
import json
import re
import sys
import urllib.request
from collections.abc import Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest
import umsgpack
from tornado import httpclient, websocket

import rcilab
from rcilab import notebook
from rcilab.notebook.kernel_reachability import find_reachability
from tests.notebook.jupyter_servers import serving

if TYPE_CHECKING:
    from tornado.httpclient import HTTPRequest


UNUSED = ("jupyter_lsp", "jupyter_server_terminals", "jupyterlab", "notebook_shim")


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """A notebook server below /arm/ with jupyter-server-proxy, and nothing else, as it writes about itself."""
    folder = tmp_path_factory.mktemp("server")
    (folder / "config").mkdir()
    chosen = {"ServerApp": {"jpserver_extensions": dict.fromkeys(UNUSED, False)}}
    (folder / "config" / "jupyter_server_config.json").write_text(json.dumps(chosen), encoding="utf-8")
    command = [sys.executable, "-m", "jupyter_server", "--ServerApp.ip=127.0.0.1", "--ServerApp.port=0"]
    with serving([*command, "--ServerApp.base_url=/arm/", f"--ServerApp.root_dir={folder}"], folder) as told:
        yield {**told, "runtime": str(folder / "runtime")}


def test_a_scene_is_live_through_the_proxy(server: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    import_module("ipykernel")  # What makes this process look like a kernel.
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", server["runtime"])
    reachability = find_reachability({"JPY_PARENT_PID": str(server["pid"])})
    assert (reachability.route, reachability.base) == ("proxy", "/arm/")
    model = rcilab.load_model("xMate3")
    with notebook.Scene(model, reachability=reachability) as scene:
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
