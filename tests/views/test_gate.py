"""Who gets in by the headers of a request alone."""

from __future__ import annotations

import pytest

from rcilab.views.gate import Gate, is_loopback

LOCAL = Gate(host="127.0.0.1", port=8080)


@pytest.mark.parametrize("origin", [None, "null", "http://evil.example", "http://127.0.0.1:8081", "file://127.0.0.1:8080",
                                    "http://127.0.0.1:8080.evil.example", "http://evil.example:8080"])  # fmt: skip
def test_a_foreign_or_missing_origin_gets_no_websocket(origin):
    assert LOCAL.refuse_socket("127.0.0.1:8080", origin, None) is not None


@pytest.mark.parametrize("name", ["127.0.0.1:8080", "localhost:8080"])
def test_our_own_pages_get_in(name):
    assert LOCAL.refuse_page(name, "/", None) is None
    assert LOCAL.refuse_socket(name, f"http://{name}", None) is None


def test_a_rebound_name_is_refused_even_when_host_and_origin_agree():
    assert LOCAL.refuse_page("evil.example:8080", "/", None) is not None
    assert LOCAL.refuse_socket("evil.example:8080", "http://evil.example:8080", None) is not None


def test_a_token_is_asked_for_and_kept_in_a_cookie():
    gate = Gate(host="0.0.0.0", port=80, token="s3cret")
    assert gate.refuse_page("10.0.0.5:80", "/", None) is not None
    assert gate.refuse_page("10.0.0.5:80", "/?token=wrong", None) is not None
    assert gate.refuse_page("10.0.0.5:80", "/?token=s3cret", None) is None
    assert gate.refuse_socket("10.0.0.5:80", "http://10.0.0.5:80", None) is not None
    assert gate.refuse_socket("10.0.0.5:80", "http://10.0.0.5:80", "rcilab_token=s3cret") is None
    assert gate.refuse_socket("10.0.0.5:80", "http://evil.example", "rcilab_token=s3cret") is not None


@pytest.mark.parametrize(
    ("host", "local"), [("127.0.0.9", True), ("::1", True), ("0.0.0.0", False), ("10.0.0.5", False)]
)
def test_loopback_is_known_by_its_spelling(host: str, local: bool) -> None:
    assert is_loopback(host) is local
