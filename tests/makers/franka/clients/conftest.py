"""`rcilab controller` as users start it, for programs that know nothing of rcilab: their own client libraries only."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from rcilab.control_process.launch import _find_free_address
from rcilab.core.errors import UsageError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.franka.driver.libraries import kept_scheduling
from rcilab.model.robot_model import RobotModel, load_model
from tests.peers.arena import Process
from tests.waiting import wait_for

PORT = 1337  # That of the interface: its clients know no other.


class Served:
    """A running controller.

    Attributes:
        host: Its address, all that a client is given.
        model: Its arm.
        world: What happens to the arm.
    """

    def __init__(self, process: Process, model: RobotModel, world: SimulationControl) -> None:
        self.host, self.model, self.world = process.host, model, world

    def place(self, *q: float) -> None:
        """Puts the arm elsewhere once it stands still; at home without angles."""

        def is_placed() -> bool:
            with suppress(UsageError):
                self.world.place_arm(q=list(q or self.model.home))
                return True
            return False

        wait_for(is_placed, what="the arm at standstill")


@contextmanager
def served(name: str, *options: str, tool: str | None = None) -> Iterator[Served]:
    """A `Served` with MuJoCo and soft lock-step, the default: a busy machine loses no command."""
    arguments = ["--host", _find_free_address(PORT), "--port", str(PORT), "--plant", "mujoco", *options]
    if tool is not None:
        arguments += ["--tool", tool]
    with Process(*arguments, model=name) as process:
        world = SimulationControl(process.host, process.world_port)
        yield Served(process, load_model(name, tool=tool), world)
        world.close()


@pytest.fixture(autouse=True)
def _kept_scheduling() -> Iterator[None]:
    """The libraries request the highest priority for the thread that calls them."""
    with kept_scheduling():
        yield


def matrix(columns: object) -> np.ndarray:
    """Returns a pose that a library has as 16 numbers, column-major."""
    return np.reshape(np.asarray(columns, dtype=np.float64), (4, 4)).T
