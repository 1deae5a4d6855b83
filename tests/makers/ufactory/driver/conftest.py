"""Sessions with an xArm7 over the maker's own client library. The interface has no lock-step: they run by the clock."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.execution.session import RobotSession
from rcilab.model.robot_model import load_model

HOME = load_model("xArm7").home


@pytest.fixture(scope="module")
def shared() -> Iterator[RobotSession]:
    with simulate(load_model("xArm7")) as robot:
        yield robot


@pytest.fixture
def robot(shared: RobotSession) -> RobotSession:
    """The shared robot, without an error, a tool or a load, and at home."""
    shared.simulation.press("none")
    shared.recover()
    shared.set_tool(load_model("xArm7").T_flange_tool)
    shared.set_load(0.0, np.zeros(3), np.zeros((3, 3)))
    shared.xarm.move_j(HOME, 3.0, 20.0)
    return shared
