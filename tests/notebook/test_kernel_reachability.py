from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from rcilab.notebook.kernel_reachability import KernelReachability, Route, Server, find_reachability

LOCAL = Server(hostname="127.0.0.1", base="/")


@pytest.mark.parametrize(
    ("environment", "server", "has_proxy", "route"),
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
        ({"VSCODE_CWD": "/", "VSCODE_IPC_HOOK_CLI": "/tmp/x.sock"}, None, True, "static"),  # A tunnel, say.
        ({"VSCODE_CWD": "/", "VSCODE_IPC_HOOK_CLI": "/x", "WSL_DISTRO_NAME": "Debian"}, None, True, "loopback"),
    ],
)
def test_the_rule_of_where_the_browser_is(
    environment: dict[str, str], server: Server | None, has_proxy: bool, route: Route
) -> None:
    assert find_reachability(environment, server, has_proxy).route == route


CODE_CELL = "vscode-notebook-cell:/home/ann/arm.ipynb#W0sZmlsZQ%3D%3D"
LAB_CELL = "5f9e2d52-4d7e-4b9c-8b8f-6f0b3f1f2f3a"
CODE_SERVER = {
    "CODE_SERVER_PARENT_PID": "7",
    "VSCODE_IPC_HOOK_CLI": "/tmp/x.sock",
    "VSCODE_PROXY_URI": "https://box.example/code/proxy/{{port}}/",
}


@pytest.mark.parametrize(
    ("cell", "environment", "server", "route"),
    [
        (CODE_CELL, {}, LOCAL, "loopback"),
        (CODE_CELL, {}, Server(hostname="127.0.0.1", base="/arm/"), "static"),  # Its page has not the server's paths.
        (CODE_CELL, {"JUPYTERHUB_SERVICE_PREFIX": "/user/ann/"}, None, "static"),
        (CODE_CELL, {"SSH_CONNECTION": "x"}, LOCAL, "static"),
        (CODE_CELL, CODE_SERVER, None, "proxy"),
        (LAB_CELL, CODE_SERVER, LOCAL, "loopback"),
        (LAB_CELL, {"VSCODE_PID": "7", "SSH_CONNECTION": "x"}, LOCAL, "proxy"),  # Started in VS Code's terminal.
    ],
)
def test_who_asks_is_told_by_the_cell(
    cell: str, environment: dict[str, str], server: Server | None, route: Route
) -> None:
    assert find_reachability(environment, server, True, cell).route == route


@pytest.mark.parametrize(
    ("ports", "address"),
    [
        ("https://box.example/code/proxy/{{port}}/", "https://box.example/code/proxy/4711/static/?plain"),
        ("https://{{port}}.box.example", "https://4711.box.example/static/?plain"),
    ],
)
def test_code_server_says_where_a_port_is(ports: str, address: str) -> None:
    place = find_reachability({**CODE_SERVER, "VSCODE_PROXY_URI": ports}, None, True, CODE_CELL)
    assert place.address("http://127.0.0.1:4711/static/?plain") == address


def test_where_ports_are_shown_to_a_login_only_nothing_is_framed() -> None:
    known = {"VSCODE_PROXY_URI": CODE_SERVER["VSCODE_PROXY_URI"], "SSH_CONNECTION": "x", "VSCODE_PID": "7"}
    assert find_reachability(known, None, True, CODE_CELL) == KernelReachability(route="static", proxy_helps=False)


def test_the_cell_that_runs_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, Any] = {"metadata": {"cellId": CODE_CELL}}
    monkeypatch.setattr("rcilab.notebook.kernel_reachability.shell", lambda: SimpleNamespace(get_parent=lambda: told))
    server = Server(hostname="127.0.0.1", base="/arm/")
    assert find_reachability({}, server, True).route == "static"
    told["metadata"] = {}  # A press.
    assert find_reachability({}, server, True).route == "proxy"


def test_an_address_goes_below_the_notebook_server_behind_a_proxy() -> None:
    place = find_reachability({"JUPYTERHUB_SERVICE_PREFIX": "/user/ann/"}, None, True)
    assert place.address("http://127.0.0.1:4711/static/?plain") == "/user/ann/proxy/4711/static/?plain"
    assert (
        KernelReachability(route="loopback").address("http://127.0.0.1:4711/static/") == "http://127.0.0.1:4711/static/"
    )


def test_the_server_that_started_the_kernel_is_known_by_what_it_wrote(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    file = tmp_path / "jpserver-4711.json"
    file.write_text('{"hostname": "0.0.0.0", "base_url": "/arm/", "pid": 4711}', encoding="utf-8")
    started = {"JPY_PARENT_PID": "4711"}
    assert find_reachability(started, None, True) == KernelReachability(route="proxy", base="/arm/")
    assert find_reachability({"JPY_PARENT_PID": "1"}, None, True).route == "loopback"  # Some other program started it.
    file.write_text('{"hostname": "0.0', encoding="utf-8")
    assert find_reachability(started, None, True).route == "loopback"
