"""`rcilab controller` as a process of its own: what it prints, how it ends."""

from __future__ import annotations

import re
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

# Straight to the command: the command line itself is tested elsewhere.
_MAIN = """
import argparse, sys
from rcilab.cli import controller
from rcilab.errors import RcilabError
parser = argparse.ArgumentParser()
controller.add_parser(parser.add_subparsers())
try:
    args = parser.parse_args(["controller", *sys.argv[1:]])
    sys.exit(args.run(args))
except RcilabError as error:
    sys.exit(str(error))
"""
PATIENCE = 30.0  # [s] A cold start on a busy machine.


@contextmanager
def controller(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", _MAIN, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    assert select.select([process.stdout], [], [], PATIENCE)[0]
    return process.stdout.readline()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_says_one_line_when_it_is_ready_and_ends_cleanly(number: signal.Signals) -> None:
    with controller("--model", "xmatepro3", "--port", "0", "--lockstep") as process:
        line = first_line(process)
        found = re.fullmatch(r"listening rci://127\.0\.0\.2:(\d+) model=xMatePro3 plant=ideal\n", line)
        assert found
        socket.create_connection(("127.0.0.2", int(found[1])), timeout=PATIENCE).close()
        process.send_signal(number)
        output, errors = process.communicate(timeout=PATIENCE)
        assert (process.returncode, output, errors) == (0, "", "")


def test_a_port_in_use_is_one_sentence_and_a_status() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.2", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with controller("--model", "xMate3", "--port", str(port)) as process:
            _, errors = process.communicate(timeout=PATIENCE)
            assert process.returncode != 0
            assert re.fullmatch(rf"TCP port {port} on 127\.0\.0\.2 is in use; .*--port N.*\n", errors)


def test_an_address_that_others_can_reach_gets_a_warning() -> None:
    with controller("--model", "xMate3", "--port", "0", "--host", "0.0.0.0", "--lockstep") as process:
        first_line(process)
        process.terminate()
        _, errors = process.communicate(timeout=PATIENCE)
        assert "warning: 0.0.0.0 is reachable from outside this machine" in errors


def test_a_private_controller_ends_when_its_parent_is_gone() -> None:
    # The parent starts the controller, passes its line on and ends without a word to it.
    parent = f"""
import subprocess, sys
child = subprocess.Popen(
    [sys.executable, "-c", {_MAIN!r}, "--model", "xMate3", "--port", "0", "--lockstep", "--exit-with-parent"],
    stdout=subprocess.PIPE, text=True, stderr=subprocess.DEVNULL)
print(child.stdout.readline(), end="", flush=True)
import os; os._exit(0)
"""
    line = subprocess.run([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True, timeout=PATIENCE).stdout
    port = int(line.split()[1].rpartition(":")[2])
    assert is_gone(port)


def is_gone(port: int) -> bool:
    """Whether nobody listens there any more within the time a person would wait."""
    pause = threading.Event()
    for _ in range(int(PATIENCE / 0.05)):
        with socket.socket() as sock:
            if sock.connect_ex(("127.0.0.2", port)):
                return True
        pause.wait(0.05)
    return False
