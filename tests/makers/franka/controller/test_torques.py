"""Commanded torques: a rate beyond its bound is an error, a value beyond the arm's torque acts as that torque."""

from __future__ import annotations

import pytest

from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.controller.phases import Phase
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove, Move
from rcilab.makers.franka.wire.state_packet import SLICES
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, Status
from rcilab.model.robot_model import load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

ZERO = (0.0,) * 7


@pytest.fixture(params=["Panda", "FR3"])
def controller(request: pytest.FixtureRequest) -> FciController:
    return following(request.param)


def following(name: str) -> FciController:
    """Follows torques; in version 5 beside joint velocities of zero."""
    model = load_model(name)
    is_panda = name == "Panda"
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


def test_a_torque_beyond_the_arms_acts_as_that_torque(controller: FciController) -> None:
    other = following(controller.model.name)
    for k in range(30):
        command(controller, k, 0.9 * k)
        command(other, k, min(0.9 * k, 12.0))
        assert controller.phase is Phase.MOVING
        assert controller.arm.signals.measured.q.tolist() == other.arm.signals.measured.q.tolist()


def test_a_client_that_limits_its_rate_against_the_state_is_followed_beyond_the_arms_torque(
    controller: FciController,
) -> None:
    last, seen = 0.0, []
    for k in range(32):
        wanted = 14.0 if k < 16 else 0.0
        command(controller, k, last + min(max(wanted - last, -0.999), 0.999))
        assert controller.phase is Phase.MOVING
        last = float(controller.packet.numbers[SLICES["tau_J_d"]][6])
        seen.append(last)
    assert max(seen) == pytest.approx(14.0)


def test_a_step_of_a_torque_is_a_discontinuity(controller: FciController) -> None:
    command(controller, 0, 0.0)
    command(controller, 1, 1.1)
    assert controller.faults == (FrankaError.CONTROLLER_TORQUE_DISCONTINUITY,)
    assert controller.phase is Phase.REFLEX
