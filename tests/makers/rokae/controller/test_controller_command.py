"""`rcilab controller` as a process of its own: what it prints, how it ends, and what its options set."""

from __future__ import annotations

import argparse
import json
import re
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from rcilab.cli import controller as command
from rcilab.core.errors import InvalidValueError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.sim.api import NetworkFaults, Stall, WorldStatus

# Straight to the command: the command line itself is tested elsewhere.
_MAIN = """
import argparse, sys
from rcilab.cli import controller
from rcilab.core.errors import RcilabError
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
def test_it_says_where_it_is_when_it_is_ready_and_ends_cleanly(number: signal.Signals) -> None:
    with controller("--model", "xmatepro3", "--port", "0", "--lockstep") as process:
        line = first_line(process)
        found = re.fullmatch(r"listening rci://127\.0\.0\.2:(\d+) model=xMatePro3 plant=ideal\n", line)
        assert found
        assert process.stdout is not None
        socket.create_connection(("127.0.0.2", int(found[1])), timeout=PATIENCE).close()
        assert re.fullmatch(r"world 127\.0\.0\.2:\d+\n", process.stdout.readline())
        process.send_signal(number)
        output, errors = process.communicate(timeout=PATIENCE)
        assert (process.returncode, output) == (0, "")
        assert all(re.search(r" s client 127\.0\.0\.1 (dis)?connected$", line) for line in errors.splitlines())


def status_of(process: subprocess.Popen[str]) -> WorldStatus:
    """What the controller says over the simulation port that its second line names."""
    first_line(process)
    assert process.stdout is not None
    host, _, port = process.stdout.readline().removeprefix("world ").strip().partition(":")
    with SimulationControl(host, int(port)) as world:
        return world.status()


def test_the_faults_of_the_command_line_are_in_force() -> None:
    udp = "--loss 0.01 --delay 0.002 --jitter 0.001 --reorder 0.02 --duplicate 0.03 --corrupt 0.04".split()
    tcp = "--tcp-delay 0.01 --tcp-split --tcp-break 5000 --seed 9".split()
    rest = "--faults-on commands --stall 0.01@0.0 --auto-limit --loop-back --limits sdk".split()
    with controller("--model", "xMate3", "--port", "0", *udp, *tcp, *rest) as process:
        status = status_of(process)
    assert status.states == NetworkFaults(tcp_delay=0.01, tcp_split=1, tcp_break=5000, seed=9)
    assert status.commands == NetworkFaults(
        loss=0.01, delay=0.002, jitter=0.001, reorder=0.02, duplicate=0.03, corrupt=0.04,
        tcp_delay=0.01, tcp_split=1, tcp_break=5000, seed=9,
    )  # fmt: skip
    assert status.stalls == 1


def test_the_arm_starts_where_the_command_line_and_the_file_put_it(tmp_path: Path) -> None:
    file = tmp_path / "my_arm.toml"
    file.write_text('[arm]\nmodel = "xMate3"\nstart = "0,30,60,0,90,10deg"\n[controller]\nport = 0\n', encoding="utf-8")
    with controller(str(file)) as process:
        assert status_of(process).q == pytest.approx(np.radians([0, 30, 60, 0, 90, 10]))
    with controller(str(file), "--start", "0,0.5,1,0,1.5,0.1") as process:
        assert status_of(process).q == (0.0, 0.5, 1.0, 0.0, 1.5, 0.1)


def test_with_json_each_line_of_the_log_is_an_object_and_stdout_stays_as_it_is() -> None:
    options = ("--port", "0", "--lockstep", "--host", "0.0.0.0", "--log-format", "json")
    with controller("--model", "xMate3", *options) as process:
        found = re.fullmatch(r"listening rci://0\.0\.0\.0:(\d+) model=xMate3 plant=ideal\n", first_line(process))
        assert found
        with socket.create_connection(("127.0.0.1", int(found[1])), timeout=PATIENCE):
            assert process.stderr is not None
            lines = [json.loads(process.stderr.readline()) for _ in range(2)]
        process.terminate()
    warning, connected = lines
    assert "reachable from outside" in warning["text"]
    assert {**connected, "time": "", "t": 0.0} == {
        "time": "", "t": 0.0, "kind": "connected", "text": "client 127.0.0.1 connected", "client": "127.0.0.1",
    }  # fmt: skip
    assert datetime.fromisoformat(connected["time"]).tzinfo is not None


def test_without_a_world_there_is_no_second_line() -> None:
    with controller("--model", "xMate3", "--port", "0", "--lockstep", "--no-world") as process:
        assert first_line(process).startswith("listening ")
        process.terminate()
        output, _ = process.communicate(timeout=PATIENCE)
        assert (process.returncode, output) == (0, "")


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--loss", "1.5", r"--loss needs 0 to 1.*, got 1\.5"),
        ("--delay", "nan", "--delay must be a finite number.*, got nan"),
        ("--tcp-split", "-1", "--tcp-split needs a whole number.*, got -1"),
        ("--faults-on", "tcp", "--faults-on: 'tcp' is unknown; known: both, commands, states"),
        ("--stall", "soon", r"--stall needs seconds, as 0\.05@2\.0.*, got 'soon'"),
        ("--stall", "9", "duration needs 0.001 to 5.*, got 9.0"),
        ("--stall", "0.5/0.1", "period needs .*, got 0.1"),
        ("--log-format", "xml", "--log-format: 'xml' is unknown; known: text, json"),
        ("--limits", "none", "--limits: 'none' is unknown; known: manual, sdk"),
        ("--world-port", "70000", "--world-port: 70000 is not a valid port"),
    ],
)
def test_an_option_out_of_range_is_one_sentence(option: str, value: str, message: str) -> None:
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["controller", "--model", "xMate3", "--port", "0", f"{option}={value}"])
    with pytest.raises(InvalidValueError, match=message):
        args.run(args)


@pytest.mark.parametrize(
    ("text", "stall"),
    [
        ("0.05@2.0", Stall(duration=0.05, after=2.0)),
        ("0.02/1.0", Stall(duration=0.02, period=1.0)),
        ("0.02@5/1.0", Stall(duration=0.02, after=5.0, period=1.0)),
        ("1", Stall(duration=1.0)),
    ],
)
def test_a_stall_is_written_as_duration_time_and_period(text: str, stall: Stall) -> None:
    assert command.parse_stall(text) == stall


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


@pytest.mark.parametrize(("name", "address"), [("127.evil.example", "0.0.0.0"), ("good.example", "127.0.0.2")])
def test_the_warning_is_about_the_address_that_a_name_resolves_to(name: str, address: str) -> None:
    resolve = f"import socket; socket.gethostbyname = {{{name!r}: {address!r}}}.__getitem__; "
    command = [sys.executable, "-c", resolve + _MAIN, "--model", "xMate3", "--port", "0", "--host", name, "--lockstep"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        first_line(process)
        process.terminate()
        _, errors = process.communicate(timeout=PATIENCE)
    assert ("warning: 0.0.0.0 is reachable" in errors) == (address == "0.0.0.0")


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
