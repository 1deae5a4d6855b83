"""Virtual controllers of both versions on real sockets, in lock-step."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Robot
from tests.peers.franka.wire import ROBOT_IDLE, ROBOT_MOVE


@pytest.fixture(scope="module", params=[5, 10], ids=["v5", "v10"])
def place(request: pytest.FixtureRequest) -> Iterator[FciArena]:
    """An arm on the ideal plant."""
    with fci_arena(request.param) as running:
        yield running


@pytest.fixture(scope="module", params=[5, 10], ids=["v5", "v10"])
def felt(request: pytest.FixtureRequest) -> Iterator[FciArena]:
    """An arm in MuJoCo, on which forces act."""
    with fci_arena(request.param, plant="mujoco") as running:
        yield running


def ready(place: FciArena) -> Iterator[Robot]:
    """Yields a client of an arm that is at its home pose, without an error and with the settings after power-up."""
    controller = place.controller
    place.simulate("push", wrench=[0.0] * 6, rise_time=0.0)
    with place.connect() as robot:
        place.simulate("press", button="none")
        place.simulate("guide", on=False)
        robot.state_when(lambda state: state.robot_mode != ROBOT_MOVE)
        assert robot.ask("automatic_error_recovery").status == "success"
        robot.state_when(lambda state: state.robot_mode == ROBOT_IDLE and not state.errors)
        place.between(lambda: controller._configure(type(controller.settings).of_arm(controller.model.description)))
        home = controller.model.home.tolist()
        while not place.simulate("place_arm", q=home)["ok"]:  # It may still settle on its servos.
            robot.skip(50)
        robot.skip(3)
        place.arena.entries.clear()
        yield robot


@pytest.fixture
def robot(place: FciArena) -> Iterator[Robot]:
    """A client of `place`."""
    yield from ready(place)


@pytest.fixture
def toucher(felt: FciArena) -> Iterator[Robot]:
    """A client of `felt`."""
    yield from ready(felt)
