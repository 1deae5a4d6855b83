"""Where the RCI is spoken a Panda is refused in one sentence, before anything is started."""

from __future__ import annotations

import pytest

import rcilab
from rcilab.control_process.supervisor import Supervisor
from rcilab.core.errors import ModelError
from rcilab.makers.maker import require_driver
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.sim.controller_config import ControllerConfig

PANDA = load_model("panda")
REFUSED = pytest.raises(ModelError, match=r"Panda is driven by Franka's own interface.*xMatePro3, xMatePro7, xMate3")


def test_all_arms_but_frankas_speak_the_rci():
    assert set(ROBOT_NAMES) - set(ROBOTS) == {"Panda", "FR3"}
    assert all(require_driver(load_model(name)).name == name for name in ROBOTS)


def test_a_panda_is_neither_simulated_nor_connected_nor_supervised():
    with REFUSED:
        rcilab.simulate(PANDA)
    with REFUSED:
        rcilab.connect("rci://127.0.0.1:9", model=PANDA)
    with REFUSED:
        Supervisor(PANDA)


def test_the_virtual_controller_is_not_a_panda():
    with REFUSED:
        build_virtual_controller(ControllerConfig(model="panda"))
