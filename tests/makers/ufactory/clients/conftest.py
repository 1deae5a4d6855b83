"""`rcilab controller` as users start it, and programs with the maker's unmodified client library.

A program runs in a process of its own: the library changes the time limit of every socket, keeps threads and a log
folder. It gets an address and returns what it prints as JSON in its last line.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from rcilab.control_process.launch import _find_free_address
from rcilab.core.errors import UsageError
from rcilab.execution.simulation_control import SimulationControl
from tests.peers.arena import Process
from tests.waiting import wait_for

PORT = 502  # That of the interface: its clients know no other.
ROOT = Path(__file__).parents[4]
PATIENCE = 60.0  # [s]
Q6 = (0.2, -0.5, -0.8, 0.1, 1.1, 0.3)

if find_spec("xarm") is None:
    collect_ignore_glob = ["test_*.py"]


def may_open_port() -> bool:
    with socket.socket() as probe:
        try:
            probe.bind(("127.0.0.1", PORT))
        except PermissionError:
            return False
        except OSError:
            return True
    return True


class Served:
    """A running controller.

    Attributes:
        host: Its address, all that a client is given.
        world: What happens to the arm.
    """

    def __init__(self, process: Process, world: SimulationControl, home: Path) -> None:
        self.host, self.world, self._home = process.host, world, home

    def run(self, program: Callable[..., object], *arguments: object) -> Any:
        """Returns what a function of `programs` returns in a process of its own."""
        return run_program(self._home, program.__name__, self.host, *arguments)

    def place(self, *q: float) -> None:
        """Puts the arm elsewhere once it stands still."""

        def is_placed() -> bool:
            with suppress(UsageError):
                self.world.place_arm(q=list(q))
                return True
            return False

        wait_for(is_placed, what="the arm at standstill")


def run_program(home: Path, name: str, *arguments: object, timeout: float = PATIENCE) -> Any:
    """Returns what a program prints; its errors are those of the test."""
    command = [sys.executable, "-m", "tests.makers.ufactory.clients.programs", name, *map(str, arguments)]
    environment = {**os.environ, "HOME": str(home)}
    found = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=timeout, check=False
    )
    assert found.returncode == 0, f"{name}:\n{found.stdout[-3000:]}\n{found.stderr[-3000:]}"
    assert "Traceback" not in found.stderr, found.stderr[-3000:]
    return json.loads(found.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """An xArm6."""
    if not may_open_port():
        pytest.skip(f"this user may not open port {PORT}")
    arguments = ("--host", _find_free_address(PORT), "--port", str(PORT), "--loop-back")
    with Process(*arguments, model="xArm6") as process:
        world = SimulationControl(process.host, process.world_port)
        yield Served(process, world, tmp_path_factory.mktemp("home"))
        world.close()


@pytest.fixture
def arm(served: Served) -> Served:
    """An xArm6 that stands away from singular poses."""
    served.place(*Q6)
    return served
