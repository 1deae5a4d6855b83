"""The configuration of an arm, at power-up and from the simulation port: joint angles and teach pendant."""

from __future__ import annotations

import json
import re
import threading

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.execution.simulation_control import SimulationControl, parse_simulation_port
from rcilab.makers.rokae import wire as rci
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.sim.api import Done, PlaceArm, PlaceBox, Refused, SetBox, SetLoad, SetSoftLimits, SetTool
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.setup_requests import as_setup
from tests.makers.rokae.controller.test_environment import Place
from tests.makers.rokae.controller.test_server import MODEL, MOTION, Peer, Running, running
from tests.makers.rokae.controller.test_simulation_port import Guest

Q = tuple((MODEL.home + 0.1).tolist())
TOOL = Pose.from_rpy((0.0, 0.01, 0.12), (0.0, 0.0, 0.5))
LOAD = Payload(mass=2.0, center_of_mass=np.array([0.0, 0.0, 0.05]))
BOX = SafetyBox(size=(1.5, 1.5, 1.5), T_base_box=Pose((0.4, 0.0, 0.6)))
SOFT = (tuple((MODEL.home - 0.5).tolist()), tuple((MODEL.home + 0.5).tolist()))


def world_of(found: Running) -> SimulationControl:
    assert found.server.world_address is not None
    host, _, port = found.server.world_address.partition(":")
    return SimulationControl(host, int(port))


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_client_finds_the_arm_as_it_was_set_up_also_after_a_reboot(plant: str) -> None:
    setup = {"start": Q, "tool": TOOL, "load": LOAD, "safety_box": BOX, "soft_limits": SOFT, "inputs": (0, 3)}
    with running(lockstep=True, plant=plant, **setup) as found:
        model = MODEL.with_tool(TOOL).with_load(LOAD)
        for _ in range(2):
            with Peer(found) as peer:
                state = peer.receive_live_state()
                assert np.array_equal(state.q, Q)
                assert np.array_equal(state.q_c, Q)
                assert state.T_base_tool.is_close(model.forward(Q))
                zeros = np.zeros(7)
                assert np.allclose(state.tau, model.torque(Q, zeros, zeros).full, atol=1e-9)
                settings = found.server.controller.settings
                assert (settings.joint_lower, settings.joint_upper) == SOFT
                assert settings.safety_box is not None
                assert settings.safety_box.size == BOX.size
                assert settings.inputs == (True, False, False, True, False, False)
                assert peer.ask(rci.SetCoor(Pose().as_row_major())) == 0  # A client's settings do not survive.
                assert peer.ask(rci.SetJointLimit((1.6,) * 7, (-1.6,) * 7)) == 0
                assert peer.ask(rci.RebootRobot()) == 0


def test_soft_limits_that_were_set_up_stop_a_motion(make_hand) -> None:
    hand = make_hand()
    hand.cycle.set_up(ArmSetup(soft_limits=(tuple(MODEL.home - 0.1), tuple(MODEL.home + 0.1))))
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    assert "joint 1" in hand.cycle.reason


STRETCHED = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LOW = SafetyBox(size=(2.0, 2.0, 0.5), T_base_box=Pose((0.0, 0.0, 1.2)))


@pytest.mark.parametrize(
    ("setup", "expected"),
    [
        ({"start": (0.0,) * 6}, "joint angles: (0.0, 0.0, 0.0, 0.0, 0.0, 0.0) has shape (6,), needs (7,)"),
        ({"start": (0.0, 2.5, *[0.0] * 5)}, "joint 2 at 143.239 deg is outside its range of -120 to 120 deg"),
        ({"start": (0, 30, 0, 60, 0, 90, 0)}, "joint 2 at 1718.87 deg is outside its range of -120 to 120 deg; angles"),
        ({"start": (0.0, float("nan"), *[0.0] * 5)}, "joint angles"),
        ({"start": Q, "soft_limits": ((-0.05,) * 7, (2.0,) * 6 + (0.05,))}, "joint 7 at 5.72958 deg is outside"),
        ({"soft_limits": ((0.1,) * 7, (1.0,) * 7)}, "joint 1 at 0 deg is outside its range of 5.72958 to 57.2958 deg"),
        ({"start": STRETCHED, "safety_box": SafetyBox(size=(1, 1, 1), T_base_box=Pose((0.0, 0.0, 3.0)))}, "mm below"),
        ({"safety_box": LOW}, "mm below the floor of the safety box"),
        ({"soft_limits": ((-1.0,) * 6, (1.0,) * 6)}, "soft limits must have 7 numbers each [rad], got (-1.0, -1.0"),
        ({"soft_limits": ((-9.0,) * 7, (1.0,) * 7)}, "soft limits: lower limit of joint 1: -9.0 rad is outside"),
        ({"tool": Pose((0.0, 0.0, 3.0))}, "tool: distance of the tool from the flange: 3.0 m is outside 0 to 2 m"),
        ({"load": Payload(mass=9.0)}, "load: mass: 9.0 kg is outside 0 to 7 kg"),
        ({"safety_box": SafetyBox(size=(200.0, 1, 1), T_base_box=Pose())}, "safety box: x of the box's size"),
        ({"inputs": (6,)}, "digital input"),
    ],
)
def test_a_configuration_that_is_not_valid_is_one_sentence(setup: dict[str, object], expected: str) -> None:
    with pytest.raises(InvalidValueError) as raised:
        build_virtual_controller(ControllerConfig(model="xMatePro7", port=0, **setup))  # type: ignore[arg-type]
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


def test_links_that_overlap_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """No links of an xMate touch inside its joint limits, so the capsules are made thicker."""
    model = load_model("xMatePro7")
    thick = model.clearance(model.home)
    object.__setattr__(thick, "distance", np.array(-0.004))
    object.__setattr__(thick, "links", np.array([2, 5]))
    monkeypatch.setattr(type(model), "clearance", lambda *_: thick)
    with pytest.raises(InvalidValueError, match="link 2 and link 5 overlap by 4 mm; they must not touch"):
        build_virtual_controller(ControllerConfig(model="xMatePro7", port=0, start=Q))


def test_a_stationary_arm_is_placed_by_its_simulation_port_and_moves_from_there() -> None:
    with running(lockstep=True) as found, Peer(found) as peer, world_of(found) as world:
        assert peer.ask(rci.SetMotorPower(1)) == 0
        world.place_arm(MOTION.goal)
        world.set_tool(TOOL)
        world.set_load(LOAD)
        world.set_box(BOX)
        world.set_soft_limits(*SOFT)
        state = peer.receive_live_state()
        assert np.array_equal(state.q, MOTION.goal)
        assert state.T_base_tool.is_close(MODEL.with_tool(TOOL).forward(MOTION.goal))
        assert found.server.controller.arm.model.load.mass == 2.0
        peer.run(MOTION.q[::-1])
        assert peer.ask(rci.StopMove()) == 0
        assert np.array_equal(peer.receive_live_state().q_c, MODEL.home)
        with pytest.raises(UsageError, match=r"joint 2 at 143\.239 deg is outside its range"):
            world.place_arm([0.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0])
        assert np.array_equal(peer.receive_live_state().q_c, MODEL.home)


def test_an_arm_that_moves_or_follows_is_not_placed() -> None:
    with running(lockstep=True) as found, Peer(found) as peer, Guest(found) as guest:
        peer.run(MOTION.q[:150])
        refused = guest.ask(request="place_arm", q=list(Q))
        assert not refused["ok"]
        assert refused["error"] == "the arm cannot be set up or placed in phase moving; end its motion first"
        for row in MOTION.q[150:]:
            peer.send(peer.seen[-1].message_id, row)
            peer.receive_state()
        assert peer.ask(rci.StopMove()) == 0
        assert np.array_equal(peer.receive_live_state().q_c, MOTION.goal)
        assert guest.ask(request="place_arm", q=list(Q))["ok"]


def test_an_arm_is_not_placed_inside_an_obstacle() -> None:
    place = Place("mujoco")
    try:
        there = MODEL.forward(Q).position.tolist()
        wall = PlaceBox("wall", (0.05, 0.05, 0.05), tuple(there))
        assert place.handle(PlaceArm(tuple((MODEL.home - 0.3).tolist()))) == Done()
        assert place.handle(wall) == Done()
        before = place.cycle.step().q
        refused = place.handle(PlaceArm(Q))
        assert isinstance(refused, Refused)
        assert re.search(r"link\d overlaps the box 'wall' by \S+ mm; remove it or choose other angles", refused.reason)
        place.step(5)
        assert np.array_equal(place.cycle.state.q, before)
    finally:
        place.endpoint.close()


@pytest.mark.parametrize("phase", ["starting", "guiding"])
def test_a_client_that_waits_for_its_motion_or_guides_the_arm_keeps_it(phase: str) -> None:
    place = Place("ideal")
    try:
        place.cycle.handle(rci.StartMove(0, 1) if phase == "starting" else rci.StartDrag(1, 2))
        place.step()
        answer = place.handle(PlaceArm(Q))
        assert f"in phase {phase}" in json.dumps(answer.reason)  # type: ignore[union-attr]
    finally:
        place.endpoint.close()


def test_after_a_joint_limit_the_arm_can_be_placed_back_inside(make_hand) -> None:
    hand = make_hand()
    hand.cycle.set_up(ArmSetup(soft_limits=(tuple(MODEL.home - 0.1), tuple(MODEL.home + 0.1))))
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    hand.rest()
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED
    hand.cycle.set_up(ArmSetup(q=tuple(MODEL.home.tolist())))
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.SUCCESS
    hand.start()
    assert not hand.command(MODEL.home).faults


@pytest.mark.parametrize("name", ["xMate7", "xMatePro3"])
def test_every_arm_can_be_set_up(name: str) -> None:
    model = load_model(name)
    q = tuple((model.home + 0.05).tolist())
    limits = (tuple((model.home - 0.5).tolist()), tuple((model.home + 0.5).tolist()))
    config = ControllerConfig(model=name, port=0, start=q, tool=TOOL, load=LOAD, soft_limits=limits)
    server = build_virtual_controller(config)
    try:
        assert tuple(server.controller.arm.commanded.q) == q
    finally:
        server.close()


def test_the_status_has_the_configuration_in_force_and_the_log_each_change_of_it() -> None:
    entries: list[LogEntry] = []
    config = ControllerConfig(model=MODEL.name, port=0, udp_port=0, lockstep=True, inputs=(0, 3), realtime=False)
    server = build_virtual_controller(config, log=entries.append)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        assert server.world_address is not None
        with SimulationControl(*parse_simulation_port(server.world_address)) as world:
            before = world.status()
            world.place_arm(Q)
            world.set_tool(TOOL)
            world.set_load(LOAD)
            world.set_box(BOX)
            world.set_soft_limits(*SOFT)
            for mass in (50.0, 500.0):
                with pytest.raises(UsageError, match=f"mass: {mass} kg is outside 0 to 7 kg"):
                    world.set_load(Payload(mass=mass))
            world.set_on_loss("bridge")
            world.set_input(3, False)
            status = world.status()
    finally:
        server.request_stop()
        thread.join()
    lower, upper = (tuple(bound.tolist()) for bound in (MODEL.limits.joint.lower, MODEL.limits.joint.upper))
    assert (before.tool, before.load, before.box) == (SetTool((0.0,) * 3), SetLoad(0.0), None)
    assert before.soft_limits == SetSoftLimits(lower, upper)
    assert before.inputs == (0, 3)
    assert (before.on_loss, status.on_loss) == ("hold", "bridge")
    assert status.q == Q
    assert status.tool is not None
    tool = as_setup(status.tool).T_flange_tool
    assert tool is not None
    assert tool.is_close(TOOL)
    assert status.load == SetLoad(2.0, (0.0, 0.0, 0.05))
    assert status.box == SetBox(BOX.size, (0.4, 0.0, 0.6))
    assert status.soft_limits == SetSoftLimits(*SOFT)
    texts = [entry.text for entry in entries if entry.kind == "set_up"]
    assert texts == [
        "arm placed at 5.73, 35.73, 5.73, 65.73, 5.73, 95.73, 5.73 deg, by the simulation port",
        "tool set at 0, 10, 120 mm from the flange, wxyz 0.9689, 0, 0, 0.2474, by the simulation port",
        "load set to 2 kg with its centre of mass at 0, 0, 50 mm from the flange, by the simulation port",
        "safety box set to 1500, 1500, 1500 mm at 400, 0, 600 mm, active, by the simulation port",
        "soft limits of the joints set from -28.65, 1.352, -28.65, 31.35, -28.65, 61.35, -28.65 deg "
        "to 28.65, 58.65, 28.65, 88.65, 28.65, 118.6, 28.65 deg, by the simulation port",
        "on_loss set to bridge from the next motion on, by the simulation port",
        "digital input 3 set low, by the simulation port",
    ]
    placed = next(entry for entry in entries if entry.kind == "set_up")
    assert placed.facts == {"request": "place_arm", "q": Q}


def test_a_safety_box_is_switched_off_and_on_without_naming_it_again() -> None:
    config = ControllerConfig(model=MODEL.name, port=0, udp_port=0, lockstep=True, realtime=False)
    server = build_virtual_controller(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        assert server.world_address is not None
        with SimulationControl(*parse_simulation_port(server.world_address)) as world:
            with pytest.raises(UsageError, match="there is no safety box"):
                world.ask(SetBox(active=False))
            world.set_box(BOX)
            for active in (False, True):
                world.ask(SetBox(active=active))
                assert world.status().box == SetBox(BOX.size, (0.4, 0.0, 0.6), active=active)
    finally:
        server.request_stop()
        thread.join()
    with pytest.raises(InvalidValueError, match="position needs 3 numbers"):
        SetBox(BOX.size, active=False)
