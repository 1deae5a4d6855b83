"""Commands that come late, in bursts or not at all."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.motion.joint import plan_joint
from rcilab.sim.jitter_buffer import FIRST_COMMAND_TIMEOUT
from rcilab.sim.streamed_motion import LOSS_BEHAVIOURS
from tests.makers.rokae.controller.conftest import smooth

F = Fault
both = pytest.mark.parametrize("on_loss", LOSS_BEHAVIOURS)


def test_queued_commands_are_played_before_stop_move_is_answered(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05).q
    hand.play(rows)
    assert not np.array_equal(hand.state.q_c, rows[-1])
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert np.array_equal(hand.state.q_c, rows[-1])


@pytest.mark.parametrize("limit", [10, 20])
def test_n_lost_cycles_in_a_row_are_an_instability_and_one_stop(make_hand, limit: int) -> None:
    hand = make_hand(lost_limit=limit, on_loss="bridge")
    hand.start()
    hand.play(hand.swing(1, 1.0, 0.4))
    assert hand.step(limit - 1).faults == ()
    assert hand.step().faults == (F.INSTABILITY_DETECTION,)
    assert hand.state.success_rate == pytest.approx(400 / (400 + limit))
    hand.rest()
    hand.assert_smooth()


def test_commands_that_never_begin_are_lost_commands(make_hand) -> None:
    hand = make_hand()
    hand.start()
    for _ in range(FIRST_COMMAND_TIMEOUT + 100):
        if hand.step().faults:
            break
    assert hand.state.faults == (F.INSTABILITY_DETECTION,)
    assert str(hand.cycle.reason) == "no command came within 5 s of the start"
    assert hand.state.success_rate == 0.0


def test_lost_cycles_are_bridged_with_the_acceleration_of_the_last_ones(make_hand) -> None:
    hand = make_hand(on_loss="bridge")
    hand.start()
    hand.play(hand.swing(1, 1.0, 0.4)[:200])
    ddq = hand.state.ddq_c[0]
    state = hand.step(3)
    assert state.ddq_c[0] == pytest.approx(ddq, abs=1e-6)
    assert state.success_rate < 1.0


def test_a_pause_of_the_client_is_survived_by_the_prefill(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    waiting: list[rci.CommandPacket] = []
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        waiting.append(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if k % 50 not in (10, 11, 12, 13):  # Four cycles of nothing; then it answers all the states it has missed.
            for packet in waiting:
                hand.cycle.receive(packet)
            waiting.clear()
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost == 0


@both
def test_a_lost_datagram_does_not_stop_a_motion(make_hand, on_loss) -> None:
    hand = make_hand(prefill=4, on_loss=on_loss)
    hand.start()
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        if k % 37 != 5:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost > 10
    assert hand.state.success_rate < 1.0


def test_a_burst_of_old_commands_is_played_as_the_motion_it_is(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.3).q
    first_id = hand.state.message_id
    for k, row in enumerate(rows[:91]):
        hand.cycle.receive(rci.CommandPacket(first_id - 1000 + k, tuple(row)))
    for row in rows[91:]:
        hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        hand.step()
    hand.ask(rci.StopMove())
    assert not any(state.faults for state in hand.states)
    assert np.array_equal(hand.state.q_c, rows[-1])
    assert hand.state.success_rate == 1.0


def test_after_the_last_command_nothing_is_lost(hand) -> None:
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05).q
    hand.play(rows[:-1])
    hand.command(rows[-1], finished=True)
    assert hand.step(50).faults == ()
    assert hand.state.success_rate == 1.0
    assert np.array_equal(hand.state.q_c, rows[-1])


@pytest.mark.parametrize(
    ("lost", "copied", "overtaken"),
    [(0.01, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2), (0.05, 0.05, 0.05)],
)
@pytest.mark.parametrize("speed", [0.3, 1.0])
@both
def test_a_bad_network_does_not_stop_a_good_motion(make_hand, lost, copied, overtaken, speed, on_loss) -> None:
    """At full speed accelerations and jerks are at their limits: what stands in for a lost command cannot keep them."""
    hand = make_hand(prefill=10, on_loss=on_loss)
    hand.start()
    goal = hand.model.home + [0.5, -0.4, 0.3, 0.4, -0.3, 0.2, 0.6]
    rows = np.vstack([plan_joint(hand.model, hand.model.home, goal, speed=speed).q, np.tile(goal, (15, 1))])
    play_badly(hand, [{"q_c": tuple(row)} for row in rows], lost, copied, overtaken)
    assert np.abs(hand.state.q_c - goal).max() < 1e-6
    assert (hand.cycle.playout.lost > 0) == (lost > 0.0)
    assert (hand.cycle.playout.duplicates > 0) == (copied > 0.0)


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@both
def test_a_bad_network_does_not_stop_a_good_line(make_hand, plant, on_loss) -> None:
    hand = make_hand(plant=plant, prefill=10, on_loss=on_loss)
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix
    commands = []
    for k in range(1, 816):
        pose = T.copy()
        pose[:3, 3] += smooth(min(k / 800.0, 1.0)) * np.array([0.05, 0.15, -0.1])
        commands.append({"T_base_tool_c": tuple(pose.ravel().tolist())})
    play_badly(hand, commands, 0.05, 0.05, 0.05)
    assert np.abs(hand.state.T_base_tool_c.matrix - np.reshape(commands[-1]["T_base_tool_c"], (4, 4))).max() < 1e-6


def test_a_cycle_that_nobody_sees_is_no_gap_for_the_client(make_hand) -> None:
    """More commands than the prefill are in stock from the beginning: they are worked off once, and that is all."""
    hand = make_hand(prefill=3)
    hand.start()
    rows = hand.swing(1, 1.0, 0.5)
    first = hand.state.message_id
    for k in range(8):
        hand.cycle.receive(rci.CommandPacket(first - 8 + k, tuple(rows[k])))
    extra = 0
    for row in rows[8:]:
        hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if hand.cycle.playout.pop_extra_cycle():
            hand.cycle.step(is_sent=False)
            extra += 1
        assert hand.step().faults == ()
    assert extra == 8  # The countdown of the prefill came on top of them.
    assert np.diff([state.message_id for state in hand.states[-400:]]).max() == 1
    assert (hand.cycle.playout.lost, hand.state.success_rate) == (0, 1.0)


@both
def test_a_client_that_jumps_after_a_pause_learns_why(make_hand, on_loss) -> None:
    hand = make_hand(prefill=4, on_loss=on_loss)
    hand.start()
    rows = hand.swing(1, 1.0, 0.4)
    rows[300:, 0] += 0.01
    for k, row in enumerate(rows):
        if k not in (298, 299):
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if hand.step().faults:
            break
    assert (
        F.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION in hand.state.faults or F.INSTABILITY_DETECTION in hand.state.faults
    )
    assert "joint 1" in hand.cycle.reason


def play_badly(
    hand, commands: list[dict[str, tuple[float, ...]]], lost: float, copied: float, overtaken: float
) -> None:
    """Answers every state with the next command, over a network that loses, copies and delays some by 1 to 3 cycles."""
    rng = np.random.default_rng(7)
    on_the_way: list[tuple[int, rci.CommandPacket]] = []
    for k, fields in enumerate(commands):
        packet = rci.CommandPacket(hand.state.message_id, **fields)
        delay = int(rng.integers(1, 4)) if rng.random() < overtaken else 0
        if rng.random() >= lost:
            on_the_way.append((k + delay, packet))
        if rng.random() < copied:
            on_the_way.append((k + int(rng.integers(0, 4)), packet))
        for due, packet in on_the_way:
            if due <= k:
                hand.cycle.receive(packet)
        on_the_way = [(due, packet) for due, packet in on_the_way if due > k]
        assert hand.step().faults == (), hand.cycle.reason
    for _, packet in on_the_way:
        hand.cycle.receive(packet)
    hand.ask(rci.StopMove())
    assert hand.state.faults == (), hand.cycle.reason


@pytest.mark.parametrize("prefill", [0, 4])
def test_answers_to_states_that_overtook_each_other_are_played_as_they_came(make_hand, prefill: int) -> None:
    """Their ids are swapped, the motion is not."""
    hand = make_hand(prefill=prefill)
    hand.start()
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        swap = {10: 1, 11: -1}.get(k % 37, 0)
        hand.cycle.receive(rci.CommandPacket(hand.state.message_id + swap, tuple(row)))
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert (hand.cycle.playout.lost, hand.cycle.playout.late) == (0, 0)


@both
def test_a_command_lost_long_after_an_id_was_repeated_is_one_loss(make_hand, on_loss) -> None:
    hand = make_hand(prefill=4, on_loss=on_loss)
    hand.start()
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        if k != 250:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id - (k >= 50), tuple(row)))
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost == 1
