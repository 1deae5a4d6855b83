"""`--realism real`: friction, noise and steps of a recorded xMatePro3, and the log of their effect."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.robot_model import load_model
from rcilab.robots.description import JointImperfection
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.friction_watch import FrictionWatch
from rcilab.sim.plants import Realism, build_plant
from rcilab.sim.virtual_arm import VirtualArm
from tests.makers.rokae.controller.conftest import Hand, smooth
from tests.makers.rokae.controller.test_server import Peer, running

NAME = "xMatePro7"


def joints_of(name: str = NAME) -> tuple[JointImperfection, ...]:
    joints = load_model(name).description.imperfections
    assert joints is not None
    return joints


def real_hand(realism: Realism = "real") -> Hand:
    model = load_model(NAME)
    hand = Hand(model, "mujoco")
    watch = FrictionWatch([joint.friction for joint in joints_of()])
    arm = VirtualArm(model, build_plant("mujoco", model, realism), prefill=0, friction_watch=watch)
    hand.cycle = RciController(arm, mode_delay=3)
    hand.states = [hand.cycle.state]
    return hand


def move_by(hand: Hand, angle: float) -> Array:
    """Moves all joints under joint impedance and waits; returns how far they end off their commands, [deg]."""
    start = hand.state.q_c
    for k in range(1300):  # Against friction the last tenths of a degree take half a second.
        assert hand.command((start + angle * smooth(min(k / 600.0, 1.0))).tolist()).faults == (), hand.cycle.reason
    off = np.degrees(np.abs(hand.state.q_c - hand.state.q))
    assert hand.ask(rci.StopMove()) == 0
    return off


@pytest.mark.parametrize("name", ROBOTS)
def test_every_arm_has_friction_steps_and_noise_in_the_range_of_the_recording(name: str) -> None:
    joints = joints_of(name)
    assert len(joints) == load_model(name).n
    for joint in joints:
        assert 0.33 <= joint.friction <= 0.59
        assert joint.torque_step in (0.0488, 0.0266)
        assert 0.01 <= joint.torque_noise <= 0.38


def test_torque_readings_have_steps_noise_above_20_hz_and_friction() -> None:
    hand, exact = real_hand(), real_hand("off")
    for one in (hand, exact):
        one.start()
        one.play(one.swing(2, 0.5, 0.3))
        one.play(one.state.q_c + np.outer(np.arange(1, 1001), np.eye(7)[1]) * 5e-4)  # 0.5 rad/s
    tau, smooth_tau = (np.array([state.tau for state in one.states[-1000:]]) for one in (hand, exact))
    for joint, readings, exactly in zip(joints_of(), tau.T, smooth_tau.T, strict=True):
        steps = readings / joint.torque_step
        assert steps == pytest.approx(np.rint(steps), abs=1e-6)
        spectrum = np.fft.rfft(readings - exactly)
        spectrum[:20] = 0.0  # [Hz], of one second.
        both = np.hypot(joint.torque_noise, joint.torque_step / np.sqrt(12.0))
        assert np.fft.irfft(spectrum).std() == pytest.approx(both, rel=0.1)
    difference = (tau - smooth_tau).mean(axis=0)
    assert difference[1] == pytest.approx(joints_of()[1].friction, abs=0.02)
    assert np.abs(np.delete(difference, 1)).max() < 0.02
    assert np.array_equal([s.q for s in hand.states[-1000:]], [s.q for s in exact.states[-1000:]])


def test_readings_are_the_same_in_every_run() -> None:
    def run() -> bytes:
        hand = real_hand()
        hand.start(2, 1)
        hand.play(hand.swing(1, 0.5, 0.3))
        return np.array([[*state.tau, *state.q] for state in hand.states]).tobytes()

    assert run() == run()


@pytest.mark.parametrize("stiffness", [20.0, 100.0])
def test_friction_holds_a_soft_joint_off_its_command_and_the_warning_is_true(stiffness: float) -> None:
    hand = real_hand()
    hand.ask(rci.SetJointImpedance((stiffness,) * 7))
    hand.start(2, 1)
    off = move_by(hand, 0.3)
    bound = np.degrees([joint.friction / stiffness for joint in joints_of()])
    assert (off < 1.02 * bound).all()
    assert off.max() > 0.8 * bound.max()
    joint = int(off.argmax())
    (warning,) = hand.cycle.arm.warnings
    assert f"joint {joint + 1} ended {off[joint]:.2g} deg off its command" in warning
    assert f"a stiffness of {stiffness:g} N m/rad ends up to {bound[joint]:.2g} deg off" in warning


def test_a_soft_tool_that_friction_holds_is_reported() -> None:
    hand = real_hand()
    hand.ask(rci.SetCartesianImpedance((500.0,) * 3 + (50.0,) * 3))
    hand.start(3, 2)
    hand.shift((0.0, 0.05, 0.0), 0.6)
    for _ in range(300):
        hand.pose(hand.state.T_base_tool_c)
    off = np.linalg.norm(hand.state.T_base_tool_c.position - hand.state.T_base_tool.position)
    hand.ask(rci.StopMove())
    (warning,) = hand.cycle.arm.warnings
    assert f"the tool ended {1e3 * off:.2g} mm" in warning


def test_without_friction_nothing_is_reported() -> None:
    hand = real_hand("off")
    hand.ask(rci.SetJointImpedance((100.0,) * 7))
    hand.start(2, 1)
    assert move_by(hand, 0.3).max() < 0.05
    assert hand.cycle.arm.warnings == []


def drive_by_torques(hand: Hand, damping: float) -> list[str]:
    """Runs a client's own control law with the delay of a network; returns the warnings."""
    hand.start(4, 0)
    stiffness = np.array([600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0])
    dampers = np.array([50.0, 50.0, damping, 50.0, 5.0, 5.0, 0.5])
    start, delayed = hand.state.q, deque([np.zeros(7)] * 2)
    for k in range(1500):
        goal = start + 0.3 * smooth(min(k / 600.0, 1.0))
        delayed.append(stiffness * (goal - hand.state.q) - dampers * hand.state.dq)
        if hand.torque(delayed.popleft().tolist()).faults:
            break
    hand.ask(rci.StopMove())
    return hand.cycle.arm.warnings


def test_a_gain_that_rings_with_friction_is_reported_with_joint_frequency_and_amplitude() -> None:
    assert drive_by_torques(real_hand("off"), 28.0) == []
    assert drive_by_torques(real_hand(), 15.0) == []
    warnings = drive_by_torques(real_hand(), 28.0)
    assert any("joint 3 rings at 97 Hz with 0.08" in warning for warning in warnings), warnings


def test_the_log_of_the_controller_has_the_warning() -> None:
    with running(lockstep=True, plant="mujoco", realism="real") as found, Peer(found) as peer:
        assert peer.ask(rci.SetJointImpedance((50.0,) * 7)) == 0
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.ask(rci.StartMove(2, 1)) in (0, 1)
        while (state := peer.receive_state()).controller_mode != 2:
            pass
        start = state.q_c
        for k in range(1300):  # Against friction the last tenths of a degree take half a second.
            peer.send(state.message_id, start + 0.2 * smooth(min(k / 600.0, 1.0)))
            answered = state.message_id
            while state.message_id == answered:
                state = peer.receive_state()
        assert peer.ask(rci.StopMove()) == 0
        found.wait_for_line("N m a stiffness of 50 N m/rad ends up to")


def test_realism_needs_the_plant_that_has_it_and_figures_of_the_arm() -> None:
    with pytest.raises(InvalidValueError, match="needs the plant mujoco"):
        ControllerConfig(model=NAME, realism="real")
    with pytest.raises(InvalidValueError, match="known: off, real"):
        ControllerConfig(model=NAME, plant="mujoco", realism="some")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="nothing is known of friction"):
        build_plant("mujoco", load_model("Panda"), "real")
    server = build_virtual_controller(ControllerConfig(model=NAME, port=0, plant="mujoco", realism="real"))
    server.close()


@pytest.mark.parametrize("realism", ["real", "off"])
def test_a_first_command_off_a_compliant_arm_that_friction_holds_is_refused_with_that_cause(realism: Realism) -> None:
    hand = real_hand(realism)
    hand.ask(rci.SetJointImpedance((100.0,) * 7))
    hand.start(2, 1)
    first = hand.state.q_c
    move_by(hand, 0.3)
    hand.start(2, 1)
    for _ in range(3):
        hand.command(first.tolist())
    assert "the first command of the motion is" in hand.cycle.reason
    named = "(friction held the compliant arm off the commands of its last motion)" in hand.cycle.reason
    assert named is (realism == "real")
