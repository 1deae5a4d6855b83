"""Sessions with an RM65 over the maker's own client library. The interface has no lock-step: they run by the clock."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.execution.session import RobotSession
from rcilab.model.robot_model import load_model

HOME = load_model("RM65").home


@pytest.fixture(scope="module")
def shared() -> Iterator[RobotSession]:
    pytest.importorskip("Robotic_Arm", reason="needs the extra realman")
    with simulate(load_model("RM65")) as robot:
        yield robot


@pytest.fixture
def robot(shared: RobotSession) -> RobotSession:
    """The shared robot, without an error, a tool or a load, and at home."""
    shared.simulation.press("none")
    shared.recover()
    shared.set_tool(load_model("RM65").T_flange_tool)
    shared.set_load(0.0, np.zeros(3))
    shared.realman.move_j(HOME, 3.0)
    return shared
