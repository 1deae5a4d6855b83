"""Who gets in by the headers of a request alone."""

from __future__ import annotations

from urllib.parse import quote

import pytest

from rcilab.views.access_control import AccessPolicy, WrongTokenDelay, is_loopback

LOCAL = AccessPolicy(host="127.0.0.1", port=8080)


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
    gate = AccessPolicy(host="0.0.0.0", port=80, token="s3cret")
    name = "rcilab_token_80"
    assert gate.refuse_page("10.0.0.5:80", "/", None) is not None
    assert gate.refuse_page("10.0.0.5:80", "/?token=wrong", None) is not None
    assert gate.refuse_page("10.0.0.5:80", "/?token=s3cret", None) is None
    assert gate.refuse_socket("10.0.0.5:80", "http://10.0.0.5:80", None) is not None
    assert gate.refuse_socket("10.0.0.5:80", "http://10.0.0.5:80", f'theirs="a b"; {name}=s3cret') is None
    assert gate.refuse_socket("10.0.0.5:80", "http://evil.example", f'theirs="a b"; {name}=s3cret') is not None


@pytest.mark.parametrize("token", ["a+b;c&d#e%20 f/g=h", "四个字的密码很长很长", '"quoted", \\ and , more'])
def test_a_token_of_any_characters_goes_through_address_and_cookie(token: str) -> None:
    gate = AccessPolicy(host="0.0.0.0", port=80, token=token)
    assert gate.refuse_page("10.0.0.5:80", f"/?token={quote(token, safe='')}", None) is None
    assert gate.cookie is not None
    assert gate.cookie.isascii()
    assert ";" not in gate.cookie
    assert gate.refuse_page("10.0.0.5:80", "/", gate.cookie) is None
    assert gate.refuse_socket("10.0.0.5:80", "http://10.0.0.5:80", f"x=1; {gate.cookie}") is None


def test_only_a_wrong_token_is_a_guess() -> None:
    gate = AccessPolicy(host="0.0.0.0", port=80, token="s3cret")
    missing, wrong = (gate.refuse_page("10.0.0.5:80", path, None) for path in ("/", "/?token=x"))
    assert missing is not None
    assert wrong is not None
    assert (missing.has_wrong_token, wrong.has_wrong_token) == (False, True)
    assert "s3cret" not in wrong.reason


def test_every_guess_waits_longer_than_the_one_before() -> None:
    now = 0.0
    guesses = WrongTokenDelay(lambda: now)
    delays = [guesses.delay() for _ in range(10)]
    assert delays == sorted(delays)
    assert (delays[0], delays[1], delays[-1]) == (0.1, 0.2, 5.0)
    now = 61.0
    assert guesses.delay() == 0.1


@pytest.mark.parametrize(
    ("host", "local"), [("127.0.0.9", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("::", False),
                        ("10.0.0.5", False), ("fe80::1%lo", False)]
)  # fmt: skip
def test_loopback_is_known_by_the_address(host: str, local: bool) -> None:
    assert is_loopback(host) is local
