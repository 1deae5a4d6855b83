from __future__ import annotations

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
