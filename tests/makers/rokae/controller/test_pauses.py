"""Pauses of the client, against those of a real xMatePro3 (docs/pauses.md has the recording)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.motion.joint import plan_joint
from rcilab.sim.streamed_motion import LATE_TOLERANCE
from tests.makers.rokae.controller.conftest import smooth

F = Fault
SPEED = np.array([0.526, -0.252, -0.375, -0.114, -0.437, -0.054, -0.359])  # [rad/s] Recorded before the longest pause.
SLOWEST = np.array([0.152, 0.109, 0.092, 0.045, 0.101, 0.017, 0.085])  # [rad/s] Lowest speed in it.
FASTEST = np.array([0.712, 0.373, 0.521, 0.126, 0.700, 0.101, 0.598])  # [rad/s] Highest afterwards,
PLANNED = np.array([0.510, 0.252, 0.363, 0.089, 0.418, 0.061, 0.349])  # [rad/s] and what the program planned there.
SETTLING = 400  # [cycles]


class Pause(NamedTuple):
    """What an arm did in a pause of its client and afterwards."""

    slowest: Array
    """Lowest speed, shape (7,), [rad/s]."""
    slowest_after: int
    """Cycles from the beginning of the pause to the lowest speed of joint 1."""
    overshoot: Array
    """Highest speed over the commanded one, shape (7,), [rad/s]."""
    last_error: Array
    """[rad]."""


def pause_at_speed(hand, cycles: int, prefill: int = 0, speed: Array = SPEED) -> Pause:
    """Runs a client that stops answering for some cycles and then answers all that it has missed at once."""
    hand.start()
    t = np.arange(1, 1001) / 1000.0
    ramp = 0.3  # [s]
    path = np.where(t < ramp, 0.5 * (t - ramp / np.pi * np.sin(np.pi * t / ramp)), t - 0.5 * ramp)
    begins, last, waiting, measured = 400, 400 + cycles + SETTLING, [], []
    rows = hand.state.q_c + np.outer(path, speed)
    for k, row in enumerate(rows[: last + 1]):
        waiting.append(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if not begins <= k < begins + cycles:
            for packet in waiting:
                hand.cycle.receive(packet)
            waiting.clear()
        state = hand.step()
        assert state.faults == (), hand.cycle.reason
        measured.append(state.dq * np.sign(speed))
    dq = np.array(measured[begins:])
    return Pause(
        dq.min(axis=0), int(dq[:, 0].argmin()), dq.max(axis=0) - np.abs(speed), hand.state.q - rows[last - prefill]
    )


@pytest.mark.parametrize(("prefill", "pause"), [(0, 22), (10, 30)])
def test_a_pause_is_that_of_a_real_arm_within_a_fifth(make_hand, prefill: int, pause: int) -> None:
    """Commands are missing for 22 cycles on the recording, and for 20 of a pause of 30 ms with the default prefill."""
    hand = make_hand("xMatePro3", plant="mujoco", prefill=prefill)
    found = pause_at_speed(hand, pause, prefill)
    assert found.slowest[0] == pytest.approx(SLOWEST[0], rel=0.2)  # 0.53 to 0.15 rad/s
    assert found.overshoot[0] == pytest.approx(FASTEST[0] - PLANNED[0], rel=0.2)  # 0.71 for 0.51 rad/s
    large = np.abs(SPEED) > 0.2  # The others' figures are within the ripple of the measured speed, 0.02 rad/s.
    slowed, overshoot = np.abs(SPEED) - found.slowest, found.overshoot
    assert slowed[large] == pytest.approx((np.abs(SPEED) - SLOWEST)[large], rel=0.3)
    assert overshoot[large] == pytest.approx((FASTEST - PLANNED)[large], rel=0.3)
    assert np.abs(found.last_error).max() < 1e-3


def test_with_the_default_prefill_a_pause_of_30_ms_slows_the_arm_within_32_ms(make_hand) -> None:
    found = pause_at_speed(make_hand("xMatePro3", plant="mujoco", prefill=10), 30)
    assert found.slowest_after == pytest.approx(32, rel=0.2)


def test_a_bridged_pause_is_not_what_a_real_arm_does(make_hand) -> None:
    hand = make_hand("xMatePro3", plant="mujoco", prefill=10, on_loss="bridge", lost_limit=None)
    found = pause_at_speed(hand, 30)
    assert (found.slowest > 0.95 * np.abs(SPEED)).all()


def test_another_behaviour_counts_from_the_next_motion_on(make_hand) -> None:
    hand = make_hand("xMatePro3", prefill=10, lost_limit=None)
    hand.start()
    hand.cycle.arm.on_loss = "bridge"
    hand.play(hand.swing(1, 0.5, 0.3))
    hand.step(40)
    assert hand.state.dq_c[0] < 0.25  # It still holds.
    hand.ask(rci.StopMove())
    assert (pause_at_speed(hand, 30).slowest > 0.95 * np.abs(SPEED)).all()


@pytest.mark.parametrize("pause", [1, 3, 10, 22])
def test_after_a_pause_the_arm_is_back_at_its_commands_to_the_last_bit(make_hand, pause: int) -> None:
    hand = make_hand("xMatePro3")
    assert not pause_at_speed(hand, pause).last_error.any()


@pytest.mark.parametrize("limit", [10, 20])
def test_commands_that_are_later_than_the_longest_known_pause_are_lost(make_hand, limit: int) -> None:
    hand = make_hand(lost_limit=limit)
    hand.start()
    hand.play(hand.swing(1, 0.5, 0.4))
    held = hand.state.q_c
    assert hand.step(LATE_TOLERANCE + limit - 1).faults == ()
    assert np.abs(hand.state.q_c - held).max() < 0.02 * 0.5  # It has run out as its servo lets it, 17 ms of its speed,
    assert np.abs(hand.state.dq_c).max() < 0.05  # and hardly moves.
    assert hand.step().faults == (F.INSTABILITY_DETECTION,)
    assert hand.rest().faults == (F.INSTABILITY_DETECTION,)


@pytest.mark.parametrize("joint", range(1, 8))
def test_a_pause_of_30_ms_at_half_a_radian_a_second_stops_no_joint(make_hand, joint: int) -> None:
    found = pause_at_speed(make_hand("xMatePro3", plant="mujoco"), 30, speed=0.53 * np.eye(7)[joint - 1])
    assert found.overshoot[joint - 1] > 0.1


def test_a_jolt_beyond_those_of_the_recording_is_a_warning_once(make_hand) -> None:
    recorded, hand = (make_hand("xMatePro3", plant="mujoco") for _ in range(2))
    pause_at_speed(recorded, 22)
    assert recorded.cycle.arm.warnings == []
    pause_at_speed(hand, 22, speed=2.0 * SPEED)
    (warning,) = hand.cycle.arm.warnings
    assert "the arm jolts: joint 5: measured acceleration" in warning


def test_a_client_that_vanishes_at_speed_has_lost_commands(make_hand) -> None:
    hand = make_hand()
    hand.start()
    hand.play(hand.swing(1, 2.0, 0.5))
    assert hand.rest().faults == (F.INSTABILITY_DETECTION,)
    text = "50 cycles in a row had no command: 30 by which one may be late, then 20 lost"
    assert hand.cycle.reason == text


def test_where_the_motion_is_bridged_no_command_may_be_late(make_hand) -> None:
    hand = make_hand(on_loss="bridge")
    hand.start()
    hand.play(hand.swing(1, 0.5, 0.5))
    assert hand.rest().faults == (F.INSTABILITY_DETECTION,)
    assert hand.cycle.reason == "20 cycles in a row had no command"


@pytest.mark.parametrize(("offset", "is_broken"), [(0.0, False), (0.02, True)])
def test_after_a_pause_the_commands_are_checked_by_their_ids_and_not_against_the_held_one(
    make_hand, offset: float, is_broken: bool
) -> None:
    hand = make_hand()
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.5, speed=0.2).q.copy()
    rows[300:, 0] += offset
    for k, row in enumerate(rows[:600]):
        if not 280 <= k < 302:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if hand.step().faults:
            break
    assert bool(hand.state.faults) is is_broken
    assert not is_broken or F.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION in hand.state.faults


@pytest.mark.parametrize("finished", [True, False])
def test_a_motion_that_ends_right_after_a_pause_ends_at_its_goal(make_hand, finished: bool) -> None:
    hand = make_hand()
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05, speed=0.5).q
    for k, row in enumerate(rows):
        if not len(rows) - 60 <= k < len(rows) - 40:
            last = finished and k == len(rows) - 1
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row), finished=last))
        hand.step()
    assert not np.array_equal(hand.state.q_c, rows[-1])
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert np.array_equal(hand.state.q_c, rows[-1])


def test_a_line_of_the_tool_is_held_in_its_joints(make_hand) -> None:
    hand = make_hand(plant="mujoco")
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix.copy()
    start = T[:3, 3].copy()
    for k in range(800):
        T[:3, 3] = start + smooth(min(k / 700, 1.0)) * np.array([0.0, 0.06, 0.0])
        if not 300 <= k < 322:
            fields = {"T_base_tool_c": tuple(T.ravel().tolist()), "psi_valid": True, "psi_c": hand.state.psi_c}
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, **fields))
        assert hand.step().faults == (), hand.cycle.reason
    around = [state.T_base_tool.position for state in hand.states[280:360]]
    speeds = np.linalg.norm(np.diff(around, axis=0), axis=1) * 1000.0
    assert speeds.min() < 0.5 * speeds.max()
    assert np.abs(hand.state.T_base_tool_c.matrix - T).max() < 1e-9


@pytest.mark.parametrize("cut_off", [30.0, 100.0, 300.0])
@pytest.mark.parametrize("pose", [False, True])
def test_a_pause_in_which_the_arm_begins_to_brake_breaks_nothing_with_a_filter_on(
    make_hand, cut_off: float, pose: bool
) -> None:
    """The filter continues on the path that the commands took meanwhile, not on that of the last commands before."""
    hand = make_hand()
    assert hand.ask(rci.SetFilters(cut_off, cut_off, 1000.0)) == 0
    hand.start(int(pose), 2 if pose else 1)
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.4 * np.eye(7)[0], speed=0.5).q
    speed = np.abs(np.diff(rows[:, 0]))
    begins = int(np.flatnonzero(speed > 0.999 * speed.max())[-1]) - 5
    for k, row in enumerate(rows[: begins + 60]):
        fields: dict[str, Any] = {"q_c": tuple(row)}
        if pose:
            T, psi = hand.model.forward(row).matrix, hand.model.arm_angle(row)
            fields = {"T_base_tool_c": tuple(T.ravel().tolist()), "psi_valid": True, "psi_c": psi}
        if not begins <= k < begins + 22:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, **fields))
        assert hand.step().faults == (), (k - begins, hand.cycle.reason)


def test_an_arm_whose_response_to_a_pause_breaks_a_limit_stops_nearby(hand) -> None:
    """It accelerates far beyond its limits when the fault comes: it must not keep within the limit of the jerk."""
    hand.start()
    t = np.arange(1, 1001) / 1000.0
    rows = hand.state.q_c + np.outer(
        np.where(t < 0.5, 0.5 * (t - 0.5 / np.pi * np.sin(np.pi * t / 0.5)), t - 0.25), 3.8 * SPEED
    )
    waiting, accelerations = [], []
    for k, row in enumerate(rows):
        waiting.append(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if not 600 <= k < 640:
            for packet in waiting:
                hand.cycle.receive(packet)
            waiting.clear()
        if hand.step().faults:
            break
        accelerations.append(np.abs(hand.state.ddq_c).max())
    assert hand.state.faults == (F.INSTABILITY_DETECTION,), hand.cycle.reason
    assert max(accelerations) > 100.0
    q, speeds = hand.state.q, []
    for _ in range(1000):
        speeds.append(np.abs(hand.step().dq).max())
    assert max(speeds) < 1.05 * speeds[0]
    assert speeds[-1] < 0.01
    assert np.abs(hand.state.q - q).max() < 1.0
