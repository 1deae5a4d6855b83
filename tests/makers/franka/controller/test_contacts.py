"""External forces in the state, the flags of contacts and collisions, and the reflex that a collision causes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.makers.franka.bounds import JOINT_STIFFNESS
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.controller.phases import Phase
from rcilab.makers.franka.controller.reporter import columns_of
from rcilab.makers.franka.controller.settings import DEFAULT_THRESHOLDS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import Move, SetCartesianImpedance, SetEEToK, SetJointImpedance, SetNEToEE
from rcilab.makers.franka.wire.state_packet import SLICES
from rcilab.makers.franka.wire.versions import VERSION_5, Status
from rcilab.model.robot_model import load_model
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

MODEL = load_model("Panda")
FAR = (10.0, 3.12, 6.28)
SETTLED = 300  # [cycles]
ZERO = (0.0,) * 7


@pytest.fixture
def controller() -> FciController:
    arm = VirtualArm(MODEL, build_plant("mujoco", MODEL), prefill=0)
    return FciController(arm, VERSION_5)


def field(controller: FciController, name: str) -> np.ndarray:
    return controller.packet.numbers[SLICES[name]].copy()


def push(controller: FciController, wrench: tuple[float, ...], cycles: int = SETTLED) -> None:
    controller.arm.plant.push(wrench)
    for _ in range(cycles):
        controller.step()


def test_forces_have_the_sign_of_what_the_arm_exerts_and_the_place_of_K(controller: FciController) -> None:
    controller._configure(replace(controller.settings, EE_T_K=Pose.from_rpy([0.0, 0.1, 0.0], [0.0, 0.0, 0.5])))
    push(controller, (0.0, 4.0, -10.0, 0.0, 0.0, 0.0))
    found, in_K = field(controller, "O_F_ext_hat_K"), field(controller, "K_F_ext_hat_K")
    assert found[:3] == pytest.approx([0.0, -4.0, 10.0], abs=0.1)
    T_base_K = controller.arm.signals.tool.pose @ controller.settings.EE_T_K
    lever = controller.arm.signals.tool.position - T_base_K.position
    assert found[3:] == pytest.approx(np.cross(lever, found[:3]), abs=0.05)
    assert in_K[:3] == pytest.approx(T_base_K.rotation.T @ found[:3], abs=1e-9)
    J = MODEL.jacobian(controller.arm.signals.measured.q)
    assert field(controller, "tau_ext_hat_filtered") == pytest.approx(J.T @ [0, -4.0, 10.0, 0, 0, 0], abs=0.1)


@pytest.mark.parametrize("turn", [0.0, np.pi / 4.0])
def test_the_springs_of_Cartesian_impedance_act_along_the_axes_of_K(controller: FciController, turn: float) -> None:
    stiffness = (2000.0, 300.0, 1000.0)
    assert controller.set(SetNEToEE(columns_of(Pose.from_rpy([0.0, 0.0, 0.1], [0.2, 0.0, 0.0]))))[0] is Status.SUCCESS
    assert controller.set(SetEEToK(columns_of(Pose.from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, turn]))))[0] is Status.SUCCESS
    assert controller.set(SetCartesianImpedance((*stiffness, 100.0, 100.0, 100.0)))[0] is Status.SUCCESS
    assert controller.begin_move(Move(1, 2, FAR, FAR)) is Status.MOTION_STARTED
    start = controller.arm.tool_c.pose
    force = np.array([10.0, 0.0, 0.0])
    controller.arm.plant.push((*force.tolist(), 0.0, 0.0, 0.0))
    for k in range(1500):
        packet = CommandPacket(k, ZERO, ZERO, columns_of(start), (0.0,) * 6, (0.0, -1.0), False, False, ZERO, False)
        controller.receive(packet)
        controller.step()
    R = (start @ controller.settings.EE_T_K).rotation
    moved = controller.arm.signals.tool.position - start.position
    assert moved == pytest.approx(R @ np.diag(1.0 / np.array(stiffness)) @ R.T @ force, abs=3e-4)


def test_a_contact_disappears_and_a_collision_stays_until_the_recovery(controller: FciController) -> None:
    thresholds = replace(DEFAULT_THRESHOLDS, contact_force=(5.0,) * 6, contact_torque=(100.0,) * 7)
    controller._configure(replace(controller.settings, thresholds=thresholds))
    push(controller, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert field(controller, "cartesian_contact").any()
    assert not field(controller, "cartesian_collision").any()
    push(controller, (0.0, 0.0, -60.0, 0.0, 0.0, 0.0))
    push(controller, (0.0,) * 6)
    assert not field(controller, "cartesian_contact").any()
    assert field(controller, "cartesian_collision").any()
    assert controller.begin_recovery() is Status.SUCCESS
    controller.step()
    assert not field(controller, "cartesian_collision").any()


def test_a_collision_in_a_motion_is_a_reflex(controller: FciController) -> None:
    thresholds = replace(DEFAULT_THRESHOLDS, collision_torque=(500.0,) * 7, collision_torque_accelerating=(500.0,) * 7)
    controller._configure(replace(controller.settings, thresholds=thresholds))
    assert controller.begin_move(Move(0, 0, (0.01,) * 3, (0.01,) * 3)) is Status.MOTION_STARTED
    q = tuple(controller.arm.commanded.q)
    controller.arm.plant.push((0.0, 0.0, -60.0, 0.0, 0.0, 0.0))
    for k in range(SETTLED):
        controller.receive(CommandPacket(k, q, ZERO, (0.0,) * 16, (0.0,) * 6, (0.0, -1.0), False, False, ZERO, False))
        controller.step()
        if controller.faults:
            break
    assert controller.faults == (FrankaError.CARTESIAN_REFLEX,)
    assert controller.phase is Phase.REFLEX


def test_a_setter_in_reflex_keeps_the_flags_of_the_collision(controller: FciController) -> None:
    push(controller, (0.0, 0.0, -60.0, 0.0, 0.0, 0.0))
    push(controller, (0.0,) * 6)
    before = field(controller, "cartesian_collision")
    assert before.any()
    assert controller.set(SetEEToK(columns_of(Pose())))[0] is Status.SUCCESS
    controller.step()
    assert field(controller, "cartesian_collision").tolist() == before.tolist()


def test_near_a_singularity_the_wrench_is_zero_and_the_torques_are_not(controller: FciController) -> None:
    q = [0.0, 0.2, 0.0, -0.467002423653011, 0.0, 1.6, 0.78]
    controller.reset(np.array(q))
    push(controller, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert np.abs(field(controller, "tau_ext_hat_filtered")).max() > 3.0
    for name in ("O_F_ext_hat_K", "K_F_ext_hat_K"):
        assert field(controller, name).tolist() == [0.0] * 6
    assert not controller.state.tau_ext_in_base.any()
    q[3] = -0.8
    controller.reset(np.array(q))
    push(controller, (0.0, 0.0, -10.0, 0.0, 0.0, 0.0))
    assert field(controller, "O_F_ext_hat_K")[2] == pytest.approx(10.0, abs=1.0)


@pytest.mark.parametrize("generator", [0, 2])
def test_while_an_impedance_pushes_its_torques_are_in_the_state(controller: FciController, generator: int) -> None:
    assert controller.set(SetJointImpedance((300.0,) * 7))[0] is Status.SUCCESS
    assert controller.begin_move(Move(generator // 2, generator, FAR, FAR)) is Status.MOTION_STARTED
    q, pose = tuple(controller.arm.commanded.q), columns_of(controller.arm.tool_c.pose)
    before = controller.arm.signals.measured.tau
    controller.arm.plant.push((8.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for k in range(1500):
        packet = CommandPacket(k, q, ZERO, pose, (0.0,) * 6, (0.0, -1.0), False, False, ZERO, False)
        controller.receive(packet)
        controller.step()
    gravity = MODEL.torque(controller.arm.signals.measured.q).gravity
    desired, measured = field(controller, "tau_J_d"), controller.arm.signals.measured
    assert np.abs(measured.tau - before).max() > 1.0
    assert desired == pytest.approx(measured.tau - gravity, abs=0.05)
    if generator == 0:
        assert desired == pytest.approx(300.0 * (np.array(q) - measured.q), abs=0.1)


def test_the_joints_have_the_stiffness_after_power_up(controller: FciController) -> None:
    yielded = []
    for stiffness in (JOINT_STIFFNESS, tuple(0.999 * value for value in JOINT_STIFFNESS)):
        controller.reset(MODEL.home)
        controller.step()
        assert controller.set(SetJointImpedance(stiffness))[0] is Status.SUCCESS
        assert controller.begin_move(Move(0, 0, FAR, FAR)) is Status.MOTION_STARTED
        q = tuple(MODEL.home.tolist())
        controller.arm.plant.push((10.0, 5.0, -10.0, 0.0, 0.0, 0.0))
        for k in range(SETTLED):
            last = k == SETTLED - 1
            packet = CommandPacket(k, q, ZERO, (0.0,) * 16, (0.0,) * 6, (0.0, -1.0), False, last, ZERO, False)
            controller.receive(packet)
            controller.step()
        signals = controller.arm.signals
        yielded.append(signals.measured.q - q)
        assert yielded[-1] == pytest.approx(signals.tau_ext / np.array(stiffness), abs=2e-5)
        assert np.abs(yielded[-1]).max() > 5e-4
        push(controller, (0.0,) * 6)
    assert yielded[1] == pytest.approx(yielded[0], rel=0.01, abs=1e-5)
