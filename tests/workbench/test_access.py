"""Where the token of a page comes from, and who gets to see it."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit
from urllib.request import url2pathname

import pytest

from rcilab.core.errors import UsageError
from rcilab.workbench.access import find_token, private_address

GOOD = "sixteen letters!"


def test_loopback_needs_no_token_unless_it_is_to_be_private():
    assert find_token("127.0.0.1", environ={}) is None
    made = find_token("127.0.0.1", is_private=True, environ={})
    assert made is not None
    assert re.fullmatch(r"[\w-]{32}", made, re.ASCII)
    assert made != find_token("127.0.0.1", is_private=True, environ={})
    assert len(find_token("0.0.0.0", environ={}) or "") == 32


def test_a_given_token_counts_and_the_file_counts_first(tmp_path: Path):
    file = tmp_path / "token"
    file.write_text(f"{GOOD} of the file\nnot this\n")
    file.chmod(0o600)
    assert find_token("127.0.0.1", environ={"RCILAB_TOKEN": GOOD}) == GOOD
    assert find_token("0.0.0.0", file=file, environ={"RCILAB_TOKEN": GOOD}) == f"{GOOD} of the file"


@pytest.mark.parametrize(("token", "problem"), [("short", "has 5 characters"), ("", "has 0"), (16 * "\x07", "printed")])
def test_a_poor_token_is_refused(tmp_path: Path, token: str, problem: str):
    file = tmp_path / "token"
    file.write_text(token)
    file.chmod(0o600)
    with pytest.raises(UsageError, match=problem):
        find_token("127.0.0.1", file=file, environ={})
    if token:
        with pytest.raises(UsageError, match=problem):
            find_token("127.0.0.1", environ={"RCILAB_TOKEN": token})


def test_a_token_that_others_can_read_is_refused(tmp_path: Path):
    file = tmp_path / "token"
    file.write_text(GOOD)
    file.chmod(0o644)
    with pytest.raises(UsageError, match="chmod 600"):
        find_token("127.0.0.1", file=file, environ={})


def test_a_browser_is_led_by_a_file_that_nobody_else_can_read():
    url = "http://127.0.0.1:8080/?token=a%2Bb"
    with private_address(url) as address:
        assert "token" not in address
        file = Path(url2pathname(unquote(urlsplit(address).path)))
        assert file.stat().st_mode & 0o077 == 0
        assert url in file.read_text()
    assert not file.exists()


COMMAND = [sys.executable, "-m", "rcilab", "--no-browser", "--port", "0", "--quality", "light", "--private"]


def test_the_token_is_shown_in_a_terminal_and_nowhere_else():
    """Not in a log, not among the processes."""
    ours, theirs = pty.openpty()
    environ = {name: value for name, value in os.environ.items() if name != "RCILAB_TOKEN"}
    shown = subprocess.Popen(COMMAND, stdout=theirs, stderr=subprocess.PIPE, env=environ)
    logged = subprocess.Popen(
        COMMAND, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**environ, "RCILAB_TOKEN": GOOD}, text=True
    )
    try:
        line = b""
        while b"\n" not in line:
            line += os.read(ours, 1000)
        _, _, token = line.decode().split()[2].partition("?token=")
        assert len(token) == 32
        assert token.encode() not in Path(f"/proc/{shown.pid}/cmdline").read_bytes()
        assert logged.stdout is not None
        said = logged.stdout.readline()
        assert "with its token" in said
        assert GOOD not in unquote(said)
    finally:
        for process in (shown, logged):
            process.terminate()
            process.communicate(timeout=30)
        os.close(ours)
        os.close(theirs)
