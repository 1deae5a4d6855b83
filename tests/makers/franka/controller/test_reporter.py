"""A state between a setter and the next cycle."""

from __future__ import annotations

from rcilab.core.arrays import readonly_copy
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.wire.requests import SetLoad
from rcilab.makers.franka.wire.state_packet import SLICES
from rcilab.makers.franka.wire.versions import VERSION_10, Status
from rcilab.model.robot_model import load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

MODEL = load_model("FR3")


def test_the_elbow_has_a_side_at_the_very_angle_of_its_flip():
    controller = FciController(VirtualArm(MODEL, build_plant("ideal", MODEL), prefill=0), VERSION_10)
    flip = MODEL.description.elbow_flip
    q = MODEL.home.copy()
    q[3] = flip
    controller.reset(readonly_copy(q))
    controller.step()
    assert controller.packet.numbers[SLICES["elbow"]].tolist() == [0.0, MODEL.elbow(q)[1]]


def test_a_state_after_a_setter_has_its_values_and_the_readings_of_the_last_cycle():
    controller = FciController(VirtualArm(MODEL, build_plant("ideal", MODEL), prefill=0), VERSION_10)
    controller.step()
    before = controller.packet.accelerometers
    status, _ = controller.set(SetLoad(1.0, (0.0, 0.0, 0.05), (0.0,) * 9))
    after = controller.packet
    assert status is Status.SUCCESS
    assert after.numbers[SLICES["m_load"]] == 1.0
    assert after.accelerometers == before
