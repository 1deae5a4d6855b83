"""A virtual controller for a peer to meet: in a thread of this process, or as the command a user would start."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from rcilab.makers.maker import capabilities_of
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.robot_model import load_model
from rcilab.realtime.cpu_affinity import one_core
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.plants import build_plant
from tests.peers.robot import PATIENCE, Robot

PLANTS = ("ideal", "mujoco")


class Arena:
    """A controller in lock-step in a thread, whose cycle a test can reach between two steps.

    Attributes:
        cycle: The controller without its sockets; touch it inside `between` only.
        entries: The log of the controller.
    """

    def __init__(self, *, wrap_plant: Callable[[Any], Any] | None = None, **options: Any) -> None:
        self.entries: list[LogEntry] = []
        settings = {"model": "xMatePro7", "port": 0, "realtime": False, "lockstep": True}
        model = load_model(options.get("model", "xMatePro7"))
        if "mode_delay" in capabilities_of(model).options:
            settings["mode_delay"] = 0.005
        if options.get("lockstep", True):
            settings["patience"] = 1.0  # A client that falls silent is given up.
            settings["prefill"] = 0  # Torques, too, act in the next cycle.
        config = ControllerConfig(**{**settings, **options})
        plant = build_plant(config.plant, model)
        self.plant = plant if wrap_plant is None else wrap_plant(plant)
        self.server = build_virtual_controller(config, plant=self.plant, log=self.entries.append)
        self.cycle: RciController = self.server.controller
        self.host, port = re.match(r"\w+://([\d.]+):(\d+)", self.server.url).groups()  # type: ignore[union-attr]
        self.port = int(port)
        self._actions: deque[Callable[[RciController], object]] = deque()
        self._step = self.cycle.step
        self.cycle.step = self._stepping  # type: ignore[method-assign]
        self.thread = threading.Thread(target=self.server.run)

    def between(self, action: Callable[[RciController], object]) -> None:
        """Lets the controller's own thread do something before its next step."""
        self._actions.append(action)

    def _stepping(self, **options: Any) -> Any:
        while self._actions:
            self._actions.popleft()(self.cycle)
        return self._step(**options)

    def connect(self, **options: Any) -> Robot:
        """Returns a robot object that waits for its states patiently and does not dawdle after StartMove."""
        return _connect(self.host, self.port, **{"axes": self.cycle.model.n, **options})


@contextmanager
def arena(**options: Any) -> Iterator[Arena]:
    """A running `Arena`."""
    found = Arena(**options)
    found.thread.start()
    try:
        with one_core(found.thread.native_id if found.server.config.lockstep else None):
            yield found
    finally:
        found.server.request_stop()
        found.thread.join(PATIENCE)
        assert not found.thread.is_alive()


class Process:
    """`rcilab controller` in a process of its own; its log goes to stderr, or to a file."""

    def __init__(self, *arguments: str, model: str = "xMatePro7", log: Path | None = None) -> None:
        command = [sys.executable, "-m", "rcilab.cli", "controller", "--model", model, "--port", "0", *arguments]
        with nullcontext() if log is None else log.open("w") as stderr:
            self.process = subprocess.Popen(
                [*command, "--exit-with-parent"], stdout=subprocess.PIPE, stderr=stderr, text=True
            )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        found = re.match(r"listening \w+://([\d.]+):(\d+)", line)
        assert found, f"instead of listening the controller said {line!r}"
        self.host, self.port = found[1], int(found[2])
        self.world_port = int(self.process.stdout.readline().rpartition(":")[2])

    def connect(self, **options: Any) -> Robot:
        """Returns a robot object like that of `Arena.connect`."""
        return _connect(self.host, self.port, **options)

    def memory(self) -> int:
        """Returns the resident memory, [bytes]."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * 4096

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(PATIENCE)
        assert self.process.stdout is not None
        self.process.stdout.close()


def _connect(host: str, port: int, **options: Any) -> Robot:
    settings: dict[str, Any] = {"start_sleep": 0.0, "receive_timeout": PATIENCE, "first_timeout": PATIENCE}
    return Robot(host, port, **{**settings, **options})
