"""`rcilab` as a person starts it: one line, one page, and Ctrl-C leaves nothing behind."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from rcilab.cli.workbench import _arm_at
from rcilab.control_process.launch import start_controller

COMMAND = [sys.executable, "-m", "rcilab.cli"]


def children(pid: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        found += [int(child) for child in task.read_text().split()]
    return found + [grandchild for child in found for grandchild in children(child)]


def is_gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_prints_one_line_serves_the_page_and_ends_cleanly(number):
    process = subprocess.Popen(
        [*COMMAND, "--no-browser", "--port", "0", "--quality", "light"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        line = process.stdout.readline()
        match = re.search(r"http://127\.0\.0\.1:\d+/", line)
        assert match, line
        with urllib.request.urlopen(match[0], timeout=20) as answer:
            assert b"rl-stop" in answer.read()
        end = time.monotonic() + 30.0
        while len(children(process.pid)) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        ours = children(process.pid)
        assert len(ours) >= 2, "a controller and a control process"
        process.send_signal(number)
        rest, errors = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    assert errors == ""
    end = time.monotonic() + 10.0
    while not all(is_gone(pid) for pid in ours) and time.monotonic() < end:
        time.sleep(0.05)
    assert all(is_gone(pid) for pid in ours)
    assert rest == ""


@pytest.mark.parametrize(
    ("arguments", "answer"),
    [
        (["--model", "kuka"], "known robots: Panda, FR3, "),
        (["--host", "0.0.0.0"], "the new token would be unknown"),
        (["--private"], "RCILAB_TOKEN"),
        (["--token-file", "/nowhere/token"], "cannot read the token in /nowhere/token"),
        (["--robot", "http://x"], "rci://"),
        (["--robot", "foo"], "'foo' has no scheme, needs fci:// (Franka), "),
        (["--robot", "172.16.0.2"], "'172.16.0.2' has no scheme, needs fci:// (Franka), "),
        (["--robot", "foo", "--model", "xMate3"], "'foo' is not a valid address; write it like rci://"),
        (["--robot", "fci://127.9.9.9"], "rcilab: no robot at fci://127.9.9.9:1337"),
        (["--robot", "rci://127.9.9.9"], "to open the page before the controller answers, add --model NAME"),
        (["--port", "70000"], "0 to 65535"),
        (["--port", "abc"], "0 to 65535"),
    ],
)
def test_bad_arguments_get_one_sentence(arguments, answer):
    done = subprocess.run(
        [*COMMAND, "--no-browser", *arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert answer in done.stderr
    assert "Traceback" not in done.stderr


def test_without_a_model_the_controller_is_asked_which_arm_it_is():
    controller = start_controller("xMate3")
    try:
        assert _arm_at(controller.address) == "xMate3"
    finally:
        controller.end()


def test_an_unreachable_robot_gets_a_line_in_the_terminal():
    process = subprocess.Popen(
        [
            *COMMAND,
            "--no-browser",
            "--port",
            "0",
            "--quality",
            "light",
            "--robot",
            "rci://127.0.0.2:9",
            "--model",
            "xMate3",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr.readline().startswith("rcilab workbench: no robot at rci://127.0.0.2:9")
        process.send_signal(signal.SIGINT)
        _, more = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert (process.returncode, more) == (0, "")


def test_a_busy_port_gets_one_sentence_that_says_what_to_change():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = subprocess.run(
            [*COMMAND, "--no-browser", "--port", str(port)], capture_output=True, text=True, timeout=60, check=False
        )
    assert done.returncode == 2
    assert f"--port {port + 1}" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_the_app_script_is_the_same_command():
    script = Path(__file__).parents[2] / "apps" / "workbench.py"
    done = subprocess.run(
        [sys.executable, str(script), "--model", "kuka"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=dict(os.environ),
    )
    assert done.returncode == 2
    assert "known robots" in done.stderr


def limited(files: int) -> list[str]:
    """The page's command with few file descriptors."""
    start = f"import resource, runpy; resource.setrlimit(resource.RLIMIT_NOFILE, ({files}, {files})); "
    return [sys.executable, "-c", start + "runpy.run_module('rcilab', run_name='__main__', alter_sys=True)"]


def test_the_page_starts_with_64_file_descriptors():
    process = subprocess.Popen(
        [*limited(64), "--no-browser", "--port", "0", "--quality", "light"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        address = process.stdout.readline().split()[2]
        end = time.monotonic() + 30.0
        while "rcilab worker" not in names_of(children(process.pid)) and time.monotonic() < end:
            time.sleep(0.05)
        assert "rcilab worker" in names_of(children(process.pid)), "the control process runs"
        with urllib.request.urlopen(address, timeout=10) as page:
            assert page.status == 200
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert (process.returncode, errors) == (0, "")


def test_too_few_file_descriptors_get_one_sentence():
    done = subprocess.run([*limited(40), "--no-browser"], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr == "rcilab: only 40 files may be open, the page needs 48: run `ulimit -n 48` before\n"


STARVING = """
import threading, sys
from rcilab.control_process.layout import ControlBlock
def create(*_):
    raise OSError(12, "Cannot allocate memory")
ControlBlock.create = create
from rcilab.app.dispatcher import Dispatcher
before = Dispatcher._run
def run(self):
    if DIES:
        raise RuntimeError("can't start new thread")
    before(self)
Dispatcher._run = run
from rcilab.cli import main
sys.exit(main(["--no-browser", "--port", "0", "--quality", "light"]))
"""


def test_a_thread_that_dies_for_want_of_memory_ends_the_page_in_one_sentence():
    code = STARVING.replace("DIES", "True")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr == "rcilab: there is not enough free memory for this; close other programs or raise ulimit -v\n"


def test_a_page_whose_robot_side_finds_no_memory_stays_without_a_traceback():
    process = subprocess.Popen(
        [sys.executable, "-c", STARVING.replace("DIES", "False")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        address = process.stdout.readline().split()[2]
        with urllib.request.urlopen(address, timeout=10) as page:
            assert page.status == 200
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    reason = "there is not enough free memory for this; close other programs or raise ulimit -v"
    assert (process.returncode, errors) == (0, f"rcilab workbench: {reason}\n")


def names_of(pids: list[int]) -> list[str]:
    """What `top` shows for processes; those that have gone are left out."""
    files = [Path(f"/proc/{pid}/comm") for pid in pids]
    return [file.read_text().strip() for file in files if file.exists()]
