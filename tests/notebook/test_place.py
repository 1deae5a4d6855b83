from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest

from rcilab.notebook.place import Place, Server, Way, find_place

LOCAL = Server(hostname="127.0.0.1", base="/")


@pytest.mark.parametrize(
    ("environment", "server", "has_proxy", "way"),
    [
        ({}, LOCAL, False, "loopback"),
        ({}, LOCAL, True, "loopback"),
        ({"COLAB_RELEASE_TAG": "1"}, LOCAL, True, "static"),
        ({"JUPYTERHUB_SERVICE_PREFIX": "/user/ann/"}, LOCAL, True, "proxy"),
        ({"JUPYTERHUB_SERVICE_PREFIX": "/user/ann/"}, LOCAL, False, "static"),
        ({}, Server(hostname="0.0.0.0", base="/"), True, "proxy"),
        ({}, Server(hostname="lab.example", base="/"), False, "static"),
        ({}, Server(hostname="127.0.0.1", base="/arm/"), True, "proxy"),
        ({"SSH_CONNECTION": "x"}, LOCAL, True, "proxy"),
        ({"VSCODE_PID": "7"}, LOCAL, False, "loopback"),
        ({"VSCODE_PID": "7", "SSH_CONNECTION": "x"}, None, True, "static"),
        ({"VSCODE_PID": "7", "CODESPACES": "true"}, None, True, "static"),
    ],
)
def test_the_rule_of_where_the_browser_is(
    environment: dict[str, str], server: Server | None, has_proxy: bool, way: Way
) -> None:
    assert find_place(environment, server, has_proxy).way == way


def test_an_address_goes_below_the_notebook_server_behind_a_proxy() -> None:
    place = find_place({"JUPYTERHUB_SERVICE_PREFIX": "/user/ann/"}, None, True)
    assert place.address("http://127.0.0.1:4711/static/?plain") == "/user/ann/proxy/4711/static/?plain"
    assert Place(way="loopback").address("http://127.0.0.1:4711/static/") == "http://127.0.0.1:4711/static/"


def test_the_server_that_started_the_kernel_is_known_by_what_it_wrote(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    file = tmp_path / "jpserver-4711.json"
    file.write_text('{"hostname": "0.0.0.0", "base_url": "/arm/", "pid": 4711}', encoding="utf-8")
    started = {"JPY_PARENT_PID": "4711"}
    assert find_place(started, None, True) == Place(way="proxy", base="/arm/")
    assert find_place({"JPY_PARENT_PID": "1"}, None, True).way == "loopback"  # Some other program started it.
    file.write_text('{"hostname": "0.0', encoding="utf-8")
    assert find_place(started, None, True).way == "loopback"
