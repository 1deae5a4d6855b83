"""Commanded torques: a rate beyond its bound is an error, a value beyond the arm's torque is reduced to it."""

from __future__ import annotations

import pytest

from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.controller.phases import Phase
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove, Move
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, Status
from rcilab.model.robot_model import load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

ZERO = (0.0,) * 7


@pytest.fixture(params=["Panda", "FR3"])
def controller(request: pytest.FixtureRequest) -> FciController:
    """Follows torques; in version 5 beside joint velocities of zero."""
    model = load_model(request.param)
    is_panda = request.param == "Panda"
    arm = VirtualArm(model, build_plant("ideal", model), prefill=0)
    controller = FciController(arm, VERSION_5 if is_panda else VERSION_10)
    deviation = (0.1,) * 3
    move = Move(2, 1, deviation, deviation) if is_panda else AsyncMove(2, 4, deviation, deviation)
    assert controller.begin_move(move) is Status.MOTION_STARTED
    return controller


def command(controller: FciController, number: int, torque: float) -> None:
    """Commands a torque of joint 7, [N m]."""
    tau = (*ZERO[:6], torque)
    nothing = (0.0,) * 16, (0.0,) * 6, (0.0, -1.0)
    controller.receive(CommandPacket(number, ZERO, ZERO, *nothing, False, False, tau, False))
    controller.step()


def test_a_torque_beyond_the_arms_is_reduced_to_it_without_an_error(controller: FciController) -> None:
    for k in range(30):
        command(controller, k, 0.9 * k)
        assert controller.phase is Phase.MOVING
        tau_c = controller.arm.signals.tau_c
        assert tau_c is not None
        assert tau_c[6] == pytest.approx(min(0.9 * k, 12.0))


def test_a_step_of_a_torque_is_a_discontinuity(controller: FciController) -> None:
    command(controller, 0, 0.0)
    command(controller, 1, 1.1)
    assert controller.faults == (FrankaError.CONTROLLER_TORQUE_DISCONTINUITY,)
    assert controller.phase is Phase.REFLEX
