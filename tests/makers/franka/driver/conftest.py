"""Sessions with both arms over the maker's own client libraries, in lock-step: every run has the same result."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.execution.session import RobotSession
from rcilab.model.robot_model import load_model

NO_LIBRARY = pytest.mark.skipif(sys.version_info >= (3, 13), reason="pylibfranka has no wheel for this Python")
ARMS = [pytest.param("Panda"), pytest.param("FR3", marks=NO_LIBRARY)]


@pytest.fixture(scope="module", params=ARMS)
def shared(request: pytest.FixtureRequest) -> Iterator[RobotSession]:
    with simulate(load_model(request.param)) as robot:
        yield robot


@pytest.fixture
def robot(shared: RobotSession) -> RobotSession:
    """The shared robot, without an error, a tool or a load, and at home."""
    shared.simulation.press("none")
    shared.power_on()
    if shared.state.faults:
        shared.recover()
    home = load_model(shared.model.name)
    shared.set_tool(home.T_flange_tool)
    shared.set_load(0.0, np.zeros(3), np.zeros((3, 3)))
    if np.abs(shared.state.q_c - home.home).max() > 1e-6:
        shared.move_j(home.home, 1.0)
    return shared
