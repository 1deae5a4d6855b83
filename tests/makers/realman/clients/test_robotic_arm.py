"""The maker's client library, unmodified, against `rcilab controller`: all joint commands, and motions."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from rcilab.control_process.launch import start_controller
from tests.peers.arena import Process

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")

PROGRAM = Path(__file__).with_name("programs.py")
MODES = {"single": 0, "dual": 1, "triple": 2}
AXES = {"RM65": 6, "RM75": 7}
LONGEST = 60.0  # [s] A program that waits for longer hangs.


@pytest.fixture(scope="module", params=AXES)
def served(request: pytest.FixtureRequest) -> Iterator[tuple[str, Process]]:
    with Process("--host", "127.0.0.1", model=request.param) as process:
        yield request.param, process


def run(process: Process, mode: str, part: str, home: Path) -> dict[str, Any]:
    command = [sys.executable, str(PROGRAM), process.host, str(process.port), str(MODES[mode]), part]
    output = subprocess.run(
        command, capture_output=True, text=True, timeout=LONGEST, check=True, env={"HOME": str(home)}, cwd=home
    ).stdout
    (line,) = (line for line in output.splitlines() if line.startswith("FOUND "))
    return json.loads(line.removeprefix("FOUND "))


@pytest.mark.parametrize("mode", MODES)
def test_every_joint_command_has_its_effect(served: tuple[str, Process], mode: str, tmp_path: Path):
    model, process = served
    n = AXES[model]
    found = run(process, mode, "joint_commands", tmp_path)
    assert found["id"] > 0
    assert (found["info"]["arm_dof"], found["info"]["robot_controller_version"]) == (n, 3)
    assert found["refused while enabled"] == 1
    assert found["disabled"] == 0
    for name, value in (
        ("speed", 90.0),
        ("acceleration", 600.0),
        ("lower", -100.0),
        ("upper", 100.0),
        ("drive speed", 120.0),
        ("drive acceleration", 600.0),
        ("drive lower", -90.0),
        ("drive upper", 90.0),
    ):
        code, (read, values) = found[name]
        assert (code, read) == (0, 0), name
        assert len(values) == n
        assert values[1] == pytest.approx(value, abs=0.01), name
    assert (found["zero"], found["cleared"]) == (0, 0)
    assert found["enabled while one is disabled"] == [0, [1, 0] + [1] * (n - 2)]
    assert found["error flags"]["brake_state"] == [0, 1] + [0] * (n - 2)
    code, (_, upper) = found["factory ranges"]
    assert code == 0
    assert upper[1] == 130.0
    assert found["enabled"] == [0] * n


def test_motions_end_where_they_should_and_refusals_are_seen(served: tuple[str, Process], tmp_path: Path):
    _, process = served
    found = run(process, "triple", "motions", tmp_path)
    for name in ("movej", "movej_p", "movel", "movec", "joint step", "cleared"):
        assert found[name] == 0, name
    assert found["moves"] == [0, 0, 0]
    assert found["refused"] == 1
    assert "0x1002" in str(found["error"]) or "4098" in str(found["error"]) or "1002" in str(found["error"])
    assert found["frames"][:2] == [0, 0]
    assert found["frames"][2] == "table"
    assert found["streamed"] == pytest.approx(10.0, abs=0.1)
    assert found["stop"] == [0, 0, 0, 0]


def test_a_client_in_single_thread_mode_waits_for_motions_that_end_at_once(served: tuple[str, Process], tmp_path: Path):
    _, process = served
    found = run(process, "single", "ends_at_once", tmp_path)
    assert found["reached"] == [0, 0, 0]
    assert found["refused"] == [1, 1, 1]


def test_ports_and_voltages_are_read_back_as_they_were_set(served: tuple[str, Process], tmp_path: Path):
    _, process = served
    found = run(process, "triple", "signals", tmp_path)
    assert found["functions"] == [0, 0, 0, 0]
    assert found["start"][1]["io_config"]["io_mode"] == 2
    assert found["input set"] == 1
    code, (_, port) = found["speed"]
    assert code == 0
    assert port["io_config"] == {"io_mode": 14, "io_real_time_config_t": {"speed": 50, "mode": 1}}
    assert found["output"] == [0, 0, [0, [0, 1, 0, 0]]]
    assert found["inputs"] == [0, [0, 0, 0, 0]]
    assert found["voltage"] == found["tool voltage"] == [0, [0, 3]]
    assert found["tool"] == [0, 0, {"return_code": 0, "IO_Mode": [1, 0], "IO_state": [1, 0]}]


def test_a_program_is_recorded_stored_and_run(served: tuple[str, Process], tmp_path: Path):
    _, process = served
    found = run(process, "triple", "program", tmp_path)
    assert found["dragged"] == [0, 0]
    code, count = found["saved"]
    assert code == 0
    assert count == len((tmp_path / "recorded.txt").read_text().splitlines()) > 0
    assert found["stored"] == found["sent"] == [0, -1]
    assert found["running"] == 1
    assert found["paused"] == [0, 2]
    assert found["continued"] == 0
    assert found["moved"] == pytest.approx(4.95, abs=0.05)
    assert found["listed"] == [5, 6]
    assert found["run by number"] == 0
    assert found["default"] == [0, [0, 5]]
    assert found["deleted"] == 0


def test_one_program_has_five_robots_of_both_generations_and_receives_their_states(tmp_path: Path):
    with ExitStack() as stack:
        ports = []
        for generation in (3, 3, 3, 4, 4):
            options = ("--host", "127.0.0.1", "--generation", str(generation))
            controller = start_controller("RM65", options=options)
            stack.callback(controller.end)
            ports.append(str(urlsplit(controller.address).port))
        command = [sys.executable, str(PROGRAM), "127.0.0.1", ",".join(ports), "2", "five"]
        output = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=True,
            env={"HOME": str(tmp_path)},
            cwd=tmp_path,
        ).stdout
    (line,) = (line for line in output.splitlines() if line.startswith("FOUND "))
    found = json.loads(line.removeprefix("FOUND "))
    assert found["generations"] == [3, 3, 3, 4, 4]
    assert found["moved"] == [0] * 5
    assert found["joint 1"] == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0], abs=0.01)
    assert found["offset"] == 0
    assert found["pushed"] > 10
