"""Commands of velocities and goals in the record of a virtual controller, and the motion that they make."""

from __future__ import annotations

import re
from math import cos, pi, sin

import numpy as np
import pytest

from rcilab.core.cycle_ring import CycleRing
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.controller.phases import Phase
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove, Move
from rcilab.makers.franka.wire.versions import VERSION_5, VERSION_10, FciVersion, Status
from rcilab.model.robot_model import load_model
from rcilab.recording.client_motions import ClientMotions
from rcilab.recording.playout import played_commands
from rcilab.recording.run import build_run
from rcilab.recording.sent_motion import check_sent, sent_motion
from rcilab.sim.cycle_capture import CycleCapture
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm
from tests.peers.franka.arena import fci_arena
from tests.peers.franka.robot import Output

CYCLES = 600
FIELDS = {1: "command_dq", 3: "command_twist", 0: "command_goal"}
"""By the number of the motion generator in a Move."""
SPEED = 0.05  # [rad/s] and [m/s]
DEVIATION = (0.1,) * 3


def recorded(name: str, version: FciVersion) -> tuple[FciController, CycleCapture, ClientMotions, CycleRing]:
    """A controller with the record of its cycles, and the reader of that."""
    model = load_model(name)
    controller = FciController(VirtualArm(model, build_plant("ideal", model), prefill=0), version)
    ring = CycleRing.create(7, {"model": name, "plant": "ideal", "url": "fci://127.0.0.1", "realtime": False})
    return controller, CycleCapture(ring, controller), ClientMotions(ring), ring


def packet(number: int, generator: int, size: float, start: tuple[float, ...], *, is_last: bool) -> CommandPacket:
    """A command of joint 7, or of the tool along z."""
    q = (*start[:6], start[6] + 0.02)
    dq, twist = (0.0,) * 6 + (size,), (0.0, 0.0, size, 0.0, 0.0, 0.0)
    return CommandPacket(number, q, dq, (0.0,) * 16, twist, (0.0, -1.0), False, is_last, (0.0,) * 7, False)


@pytest.mark.parametrize("generator", list(FIELDS))
def test_the_record_has_velocities_and_goals_and_its_check_the_angles_that_follow(generator: int) -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    model = controller.model
    start = tuple(controller.state.q_c.tolist())
    is_goal = generator == 0
    move = AsyncMove(0, generator, DEVIATION, DEVIATION, is_goal, (0.5,) * 7)
    assert controller.begin_move(move) is Status.MOTION_STARTED
    controller.step()
    capture.write()
    sizes = [0.0 if k == CYCLES else SPEED * (1.0 - cos(2.0 * pi * k / CYCLES)) / 2.0 for k in range(CYCLES + 1)]
    for k, size in enumerate(sizes):
        is_last = k == CYCLES
        controller.receive(packet(controller.cycle_number, generator, size, start, is_last=is_last))
        controller.step()
        capture.write()
    while controller.phase is not Phase.IDLE:
        assert not controller.faults
        controller.step()
        capture.write()
    for _ in range(50):
        controller.step()
        capture.write()
    parts = motions.poll(is_last=True)
    assert [part.end is not None for part in parts] == [True]
    run = build_run(
        parts[0].cycles, plan=None, model=parts[0].motion.model, setup=parts[0].motion.setup, realtime=False
    )
    assert all(np.isfinite(run.cycles[name]).any() == (name == FIELDS[generator]) for name in FIELDS.values())
    sent = run.cycles[FIELDS[generator]]
    rows, sources = played_commands(run.cycles)
    assert len(rows) == len(sizes)
    motion = sent_motion(run)
    moved = motion.q[-1] - np.array(start)
    if is_goal:
        assert sent[sources, 6] == pytest.approx(start[6] + 0.02)
        assert moved[6] == pytest.approx(0.02, abs=1e-3)
    else:
        assert sent[sources].max(axis=1) == pytest.approx(sizes)
        height = [model.pose(q).parts[1][2] for q in (start, motion.q[-1])]
        way = height[1] - height[0] if generator == 3 else moved[6]
        assert way == pytest.approx(SPEED * 1e-3 * CYCLES / 2.0, rel=1e-3)
    assert check_sent(run).ok
    ring.close()


STILL = "the client stopped the motion without a last command"
SLOW = r"the client stopped the motion while joint 7 moved at 0\.001 rad/s"


@pytest.mark.parametrize(
    ("mode", "is_goal", "speed", "is_last", "found"),
    [
        ((0, 1), False, 1e-3, False, SLOW),
        ((0, 1), False, 0.0, False, STILL),
        ((0, 0), True, 0.0, False, STILL),
        ((2, 4), False, 0.0, False, STILL),
        ((0, 1), False, 0.0, True, ""),
    ],
)
def test_a_motion_ran_to_its_end_only_with_a_last_command(
    mode: tuple[int, int], is_goal: bool, speed: float, is_last: bool, found: str
) -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    start = tuple(controller.state.q_c.tolist())
    assert controller.begin_move(AsyncMove(*mode, DEVIATION, DEVIATION, is_goal, (0.5,) * 7)) is Status.MOTION_STARTED
    controller.step()
    capture.write()
    for size in (0.0, speed, speed):
        controller.receive(packet(controller.cycle_number, mode[1], size, start, is_last=is_last))
        controller.step()
        capture.write()
    controller.stop_move()
    while controller.phase is not Phase.IDLE:
        controller.step()
        capture.write()
    for _ in range(2):
        controller.step()
        capture.write()
    (end,) = [part.end for part in motions.poll(is_last=True) if part.end is not None]
    assert re.fullmatch(found, end.stopped or "")
    ring.close()


def test_the_reason_of_a_stop_outlives_a_recovery_that_comes_before_the_arm_stands() -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    start = tuple(controller.state.q_c.tolist())
    assert controller.begin_move(AsyncMove(0, 1, DEVIATION, DEVIATION, False, (0.5,) * 7)) is Status.MOTION_STARTED
    controller.step()
    capture.write()
    for size in (*(0.005 * k for k in range(100)), 3.0):
        controller.receive(packet(controller.cycle_number, 1, size, start, is_last=False))
        controller.step()
        capture.write()
    assert controller.faults
    assert controller.begin_recovery() is None
    assert not controller.arm.commanded.is_stationary
    for _ in range(200):
        controller.step()
        capture.write()
    assert not controller.faults
    (end,) = [part.end for part in motions.poll(is_last=True) if part.end is not None]
    assert "joint 7: commanded" in (end.stopped or "")
    ring.close()


def test_a_user_stop_that_is_released_before_the_arm_has_stopped_ended_the_motion() -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    start = tuple(controller.state.q_c.tolist())
    assert controller.begin_move(AsyncMove(0, 1, DEVIATION, DEVIATION, False, (0.5,) * 7)) is Status.MOTION_STARTED
    for k in range(100):
        controller.receive(packet(controller.cycle_number, 1, 1e-3 * k, start, is_last=False))
        controller.step()
        capture.write()
    for button in ("estop", "none"):
        controller.press_button(button)
        controller.step()
        capture.write()
    assert controller.is_moving
    while controller.is_moving:
        controller.step()
        capture.write()
    controller.step()
    capture.write()
    (end,) = [part.end for part in motions.poll(is_last=True) if part.end is not None]
    assert end.stopped == "the user stop was pressed"
    ring.close()


JUMP, NO_NUMBER = 0.05, float("nan")
E = FrankaError
STOPPED = [
    ((0, 1), {"dq_c": (0.0,) * 6 + (JUMP,)}, E.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY),
    ((0, 1), {"dq_c": (NO_NUMBER,) * 7}, E.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION),
    ((0, 3), {"O_dP_EE_c": (0.0, 0.0, JUMP, 0.0, 0.0, 0.0)}, E.CARTESIAN_MOTION_GENERATOR_VELOCITY_DISCONTINUITY),
    ((0, 3), {"O_dP_EE_c": (NO_NUMBER,) * 6}, E.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION),
    ((0, 2), {"elbow_c": (0.0, 1.0)}, E.CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT),
    ((0, 2), {"elbow_c": (NO_NUMBER, -1.0)}, E.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION),
    ((1, 0), {"q_c": (0.0,) * 7}, E.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY),
    ((2, 0), {"q_c": (0.0,) * 7}, E.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY),
    ((2, 4), {"tau_c": (0.0,) * 6 + (9.0,)}, E.CONTROLLER_TORQUE_DISCONTINUITY),
]
"""Controller and generator of a Move, what changes after 50 commands at standstill, and the error for it."""
KINDS = {
    (0, 1): "joint_velocity",
    (0, 2): "cartesian_position",
    (0, 3): "cartesian_velocity",
    (1, 0): "joint_position-cartesian_impedance",
    (2, 0): "torque",
    (2, 4): "torque",
}


@pytest.mark.parametrize(("mode", "changed", "fault"), STOPPED)
def test_a_motion_that_was_stopped_for_its_command_does_not_conform(
    mode: tuple[int, int], changed: dict[str, tuple[float, ...]], fault: FrankaError
) -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    q = tuple(controller.state.q_c.tolist())
    pose = tuple(controller.model.forward(q).matrix.T.ravel().tolist())
    still = packet(0, 1, 0.0, q, is_last=False)._replace(q_c=q, O_T_EE_c=pose, elbow_c=(q[2], -1.0), has_elbow=True)
    assert controller.begin_move(AsyncMove(*mode, DEVIATION, DEVIATION, False, (0.5,) * 7)) is Status.MOTION_STARTED
    for k in range(100):
        command = still._replace(message_id=controller.cycle_number, **(changed if k >= 50 else {}))
        controller.receive(command)
        controller.step()
        capture.write()
    assert fault in controller.faults
    part = motions.poll(is_last=True)[-1]
    assert part.end is not None
    setup = part.motion.setup
    run = build_run(
        part.cycles, plan=None, model=part.motion.model, setup=setup, realtime=False, stopped=part.end.stopped
    )
    report = check_sent(run)
    assert fault in {violation.fault for violation in report.violations}
    assert report.violations[0].time == pytest.approx(0.05, abs=2e-3)
    assert setup.motion_kind == KINDS[mode]
    ring.close()


def test_the_settings_in_force_are_those_of_this_maker() -> None:
    with fci_arena(10, is_recorded=True) as place, place.connect() as robot:
        state = robot.move(0, 0)
        robot.play(state, lambda state, k: Output(q=state.q_d), cycles=5)
        ring = place.arena.server.ring
        assert ring is not None
        events, _ = ring.events(0)
    settings = events[0]["settings"]
    assert settings["prefill"] == 0
    assert settings["collision_torque_thresholds"] == settings["contact_torque_accelerating_thresholds"] == [20.0] * 7
    assert settings["collision_force_thresholds"] == [20.0] * 6
    assert {"F_T_NE", "NE_T_EE", "EE_T_K", "joint_stiffness", "cartesian_filter"} <= settings.keys()
    assert not {"collision_thresholds", "safety_box", "joint_lower", "force_frame", "desired_wrench"} & settings.keys()


def test_a_motion_that_follows_at_once_is_another_one_in_the_record() -> None:
    controller, capture, motions, ring = recorded("FR3", VERSION_10)
    start = tuple(controller.state.q_c.tolist())
    for generator in (1, 3, 3, 1):
        assert controller.begin_move(AsyncMove(0, generator, DEVIATION, DEVIATION, False, (0.5,) * 7)) is (
            Status.MOTION_STARTED
        )
        for is_last in (False, False, True):
            controller.receive(packet(controller.cycle_number, generator, 0.0, start, is_last=is_last))
            controller.step()
            capture.write()
        while controller.phase is not Phase.IDLE:
            controller.step()
            capture.write()
    parts = [part for part in motions.poll(is_last=True) if part.end is not None]
    assert [part.motion.number for part in parts] == [1, 2, 3, 4]
    assert [part.end.received for part in parts if part.end] == [3, 3, 3, 3]
    fields = [np.isfinite(part.cycles["command_twist"]).any() for part in parts]
    assert fields == [False, True, True, False]
    ring.close()


def test_torques_with_a_generator_at_standstill_are_checked_by_the_measured_angles() -> None:
    """A client of version 5 cannot command torques alone: it sends zero velocities with them."""
    controller, capture, motions, ring = recorded("Panda", VERSION_5)
    assert controller.begin_move(Move(2, 1, DEVIATION, DEVIATION)) is Status.MOTION_STARTED
    start, cycles = tuple(controller.state.q_c.tolist()), 300
    for k in range(cycles):
        push = 3.0 * sin(2.0 * pi * k / cycles)
        is_last = k == cycles - 1
        tau = (0.0,) * 6 + (push,)
        command = packet(controller.cycle_number, 1, 0.0, start, is_last=is_last)
        controller.receive(command._replace(tau_c=tau))
        controller.step()
        capture.write()
        assert not controller.faults
    while controller.phase is not Phase.IDLE:
        controller.step()
        capture.write()
    for _ in range(50):
        controller.step()
        capture.write()
    (part,) = motions.poll(is_last=True)
    run = build_run(part.cycles, plan=None, model=part.motion.model, setup=part.motion.setup, realtime=False)
    assert abs(run.cycles["q"][-1, 6] - run.cycles["q"][0, 6]) > 0.05
    assert check_sent(run).ok
    ring.close()
