from __future__ import annotations

import itertools

import pytest

from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.jitter_buffer import CAPACITY, SLACK, JitterBuffer, Playback

_numbers = itertools.count()


def command(message_id: int, *, finished: bool = False) -> ArmCommand:
    """A command unlike any other."""
    return ArmCommand(message_id, psi=next(_numbers), finished=finished)


def by_whole_gap(packet: ArmCommand, steps: int, in_doubt: bool) -> bool:
    return in_doubt


def by_one_step(packet: ArmCommand, steps: int, in_doubt: bool) -> bool:
    return True


def take_ids(playout: JitterBuffer, cycles: int) -> list[int | str]:
    """The id played in each cycle, "wait" or "lost"."""
    found: list[int | str] = []
    for _ in range(cycles):
        playback = playout.take(by_whole_gap)
        if playback.is_lost:
            found.append("lost")
        elif playback.command is None:
            found.append("wait")
        else:
            found.append(playback.command.number)
    return found


def test_one_command_is_played_a_cycle_in_order() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (7, 8, 9):
        playout.push(command(k))
    assert take_ids(playout, 3) == [7, 8, 9]
    assert playout.success_rate == 1.0


def test_nothing_is_lost_before_the_first_command() -> None:
    playout = JitterBuffer(prefill=0)
    assert take_ids(playout, 5) == ["wait"] * 5
    assert (playout.lost, playout.success_rate) == (0, 1.0)


def test_the_prefill_delays_the_first_command_and_then_absorbs_a_pause() -> None:
    playout = JitterBuffer(prefill=3)
    played = []
    for k in range(10):
        if k not in (5, 6, 7):  # The client sleeps for three cycles and then answers all it missed.
            for late in range(5, 8) if k == 8 else ():
                playout.push(command(late))
            playout.push(command(k))
        played += take_ids(playout, 1)
    assert played == ["wait"] * 3 + [0, 1, 2, 3, 4, 5, 6]
    assert playout.lost == 0


def test_a_prefill_does_not_wait_for_commands_that_never_come() -> None:
    playout = JitterBuffer(prefill=4)
    playout.push(command(1))
    assert take_ids(playout, 6) == ["wait"] * 4 + [1, "lost"]


def test_a_burst_with_old_ids_is_played_one_a_cycle_and_its_jump_to_live_ids_is_no_loss() -> None:
    playout = JitterBuffer(prefill=4)
    for k in range(100, 191):
        playout.push(command(k))
    played = []
    for k in range(95):
        playout.push(command(1099 + k))
        played += take_ids(playout, 1)
    assert played == ["wait"] * 4 + list(range(100, 191))
    assert take_ids(playout, 2) == [1099, 1100]
    assert playout.lost == 0


def test_commands_for_cycles_that_were_lost_are_dropped_when_they_come_late() -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(10))
    assert take_ids(playout, 4) == [10, "lost", "lost", "lost"]
    for k in range(11, 16):
        playout.push(command(k))
    assert take_ids(playout, 2) == [14, 15]
    assert (playout.late, playout.lost, playout.consecutive_lost) == (3, 3, 0)
    assert playout.success_rate == 3 / 6


def test_a_command_that_comes_late_feeds_no_cycle() -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(10))
    take_ids(playout, 3)
    playout.push(command(12))
    assert playout.is_starved
    playout.push(command(13))
    assert not playout.is_starved


def test_a_repeated_id_is_the_next_command() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 5, 5, 6):
        playout.push(command(k))
    assert take_ids(playout, 4) == [5, 5, 5, 6]
    assert playout.late == 0


def test_a_repeated_id_explains_the_gap_that_follows() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 5, 7):  # The state 6 never reached the client, which answered 5 again instead.
        playout.push(command(k))
    assert take_ids(playout, 3) == [5, 5, 7]


def test_a_repeated_id_explains_no_gap_that_comes_later() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 5, 6, 7, 9):
        playout.push(command(k))
    assert take_ids(playout, 6) == [5, 5, 6, 7, "lost", 9]


def test_a_repeated_id_explains_nothing_where_the_motion_says_otherwise() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 5, 7):
        playout.push(command(k))
    played = [playout.take(lambda packet, steps, in_doubt: False) for _ in range(4)]
    assert [playback.is_lost for playback in played] == [False, False, True, False]


@pytest.mark.parametrize("prefill", [0, 3])
def test_answers_with_swapped_ids_are_played_as_the_motion_goes_on(prefill: int) -> None:
    """The states overtook each other, and the client answered in the order in which they came."""
    playout, played = JitterBuffer(prefill), []
    for k in (5, 7, 6, 8, 11, 9, 10, 12, 13, 14, 15):
        playout.push(command(k))
        playback = playout.take(by_one_step)
        if playback.command is not None:
            played.append(playback.command.number)
    assert played == [5, 7, 6, 8, 11, 9, 10, 12, 13, 14, 15][: len(played)]
    assert len(played) == 11 - prefill
    assert (playout.late, playout.lost) == (0, 0)


def test_a_lost_command_leaves_a_gap_that_can_be_bridged_to_the_next_one() -> None:
    playout = JitterBuffer(prefill=0)
    last, later = command(5), command(8)
    playout.push(last)
    playout.push(later)
    playout.take(by_whole_gap)
    assert playout.take(by_whole_gap) == Playback(later, 3, True)
    assert playout.take(by_whole_gap) == Playback(later, 2, True)
    assert playout.take(by_whole_gap) == Playback(later, 1, False)
    assert playout.lost == 2


def test_a_gap_of_ids_without_a_gap_of_the_motion_is_no_loss() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 8, 9):
        playout.push(command(k))
    ids = [played.number for _ in range(3) if (played := playout.take(by_one_step).command) is not None]
    assert ids == [5, 8, 9]
    assert playout.lost == 0


def test_a_command_that_was_overtaken_is_put_back_in_its_place() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 6, 9, 8, 7, 10):
        playout.push(command(k))
    assert take_ids(playout, 6) == [5, 6, 7, 8, 9, 10]
    assert (playout.late, playout.lost) == (0, 0)


def test_a_command_that_was_overtaken_in_a_burst_is_put_back_in_its_place_also_near_standstill() -> None:
    """There a command after a gap continues the motion by one step as well as by the gap."""
    playout = JitterBuffer(prefill=0)
    for k in (0, *range(2, 60), 1):
        playout.push(command(k))
    played = [playout.take(by_one_step).command for _ in range(60)]
    assert [found.number for found in played if found is not None] == list(range(60))


def test_an_overtaken_command_whose_cycle_has_passed_is_dropped() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5, 7, 8):
        playout.push(command(k))
    assert take_ids(playout, 2) == [5, "lost"]
    playout.push(command(6))
    assert take_ids(playout, 2) == [7, 8]
    assert playout.late == 1


@pytest.mark.parametrize("order", [(0, 0, 1, 1, 2, 2), (0, 1, 0, 2, 1, 2), (0, 1, 2, 0, 1, 2)])
def test_a_copy_made_by_the_network_is_dropped(order: tuple[int, ...]) -> None:
    playout = JitterBuffer(prefill=0)
    commands = [command(k) for k in (5, 6, 7)]
    for k in order:
        playout.push(commands[k])
    assert take_ids(playout, 3) == [5, 6, 7]
    assert (len(playout), playout.duplicates, playout.lost) == (0, 3, 0)


def test_a_late_copy_of_a_played_command_is_a_copy() -> None:
    playout = JitterBuffer(prefill=0)
    commands = [command(k) for k in (5, 6)]
    for each in commands:
        playout.push(each)
    assert take_ids(playout, 2) == [5, 6]
    assert not playout.push(commands[0])
    assert (len(playout), playout.duplicates, playout.late) == (0, 1, 0)


def test_copies_are_found_at_any_distance_and_of_late_commands_too() -> None:
    playout = JitterBuffer(prefill=0)
    commands = [command(k) for k in range(1, 40)]
    for each in commands:
        playout.push(each)
    assert not playout.push(commands[0])
    assert not playout.push(commands[29])
    assert take_ids(playout, 39) == list(range(1, 40))
    assert take_ids(playout, 3) == ["lost"] * 3
    late = command(41)
    assert playout.push(late)
    assert not playout.push(late)
    assert (playout.late, playout.duplicates) == (1, 3)


def test_a_copy_in_a_pause_does_not_shorten_it_for_late_commands() -> None:
    playout = JitterBuffer(prefill=0)
    last = command(100)
    playout.push(last)
    assert take_ids(playout, 1) == [100]
    take_ids(playout, 20)
    playout.push(last)
    take_ids(playout, 5)
    for number in range(101, 127):
        playout.push(command(number))
    assert take_ids(playout, 2) == [125, 126], "one cycle was bridged by the copy, 24 were lost"
    assert playout.late == 24


def test_who_says_the_same_again_has_nothing_new_but_is_not_lost() -> None:
    playout = JitterBuffer(prefill=0)
    first = command(5)
    playout.push(first)
    playout.take(by_whole_gap)
    for _ in range(3):
        playout.push(first)
        assert playout.take(by_whole_gap).command is None
    assert (playout.lost, playout.consecutive_lost, playout.success_rate) == (0, 0, 1.0)
    playout.push(command(9))  # The states 6 to 8 never came; their cycles were spent on what it said again.
    assert take_ids(playout, 1) == [9]


def test_more_commands_than_cycles_are_worked_off_but_jitter_is_not() -> None:
    playout = JitterBuffer(prefill=3)
    ids = itertools.count()

    def live(commands: list[int]) -> int:
        extra = 0
        for count in commands:
            for _ in range(count):
                playout.push(command(next(ids)))
            playout.take(by_whole_gap)
            if playout.pop_extra_cycle():
                playout.take(by_whole_gap)
                extra += 1
        return extra

    assert live([1] * 3 + [0, 0, 3] * 200) == 0
    assert live([2] * SLACK + [1] * 400) == 0  # A first answer that was late, say: not worth a leap.
    assert live([2] + [1] * 400) == SLACK + 1
    assert live([2] * 20 + [1] * 400) == 20
    assert len(playout) == 3
    assert playout.lost == 0


def test_commands_that_close_a_loop_are_fresh() -> None:
    playout = JitterBuffer(prefill=10)
    playout.begin(max_queued=2)
    ids, played = itertools.count(), []
    for k in range(20):
        for _ in range(3 if k < 8 else 1):  # For a while three a cycle.
            playout.push(command(next(ids)))
        played += [playout.take(by_whole_gap)]
    assert [playback.command is None for playback in played[:3]] == [True, True, False]
    assert all(playback.command is not None for playback in played[2:])
    assert len(playout) <= 2
    assert sum(playback.skipped for playback in played) >= 10
    assert playout.lost == 0


def test_a_torque_that_is_skipped_has_no_extra_cycle() -> None:
    """The vendor's client repeated the id of the last state: with a cycle for each, the next answer would be late."""
    playout = JitterBuffer(prefill=0)
    playout.begin(max_queued=0)
    for k in (5, 5):
        playout.push(command(k))
    assert playout.backlog == 0
    assert take_ids(playout, 1) == [5]
    playout.push(command(6))
    assert take_ids(playout, 1) == [6]
    assert (playout.late, playout.lost) == (0, 0)


def test_a_delay_of_torques_that_was_asked_for_is_no_backlog() -> None:
    playout = JitterBuffer(prefill=0)
    playout.begin(max_queued=2 * SLACK)
    for k in range(400):
        playout.push(command(k))
        playout.take(by_whole_gap)
        assert not playout.pop_extra_cycle()
    assert len(playout) == 2 * SLACK


def test_ids_that_begin_again_are_another_numbering() -> None:
    playout = JitterBuffer(prefill=0)
    for k in (5000, 5001, 3, 4):
        playout.push(command(k))
    assert take_ids(playout, 4) == [5000, 5001, 3, 4]


def test_the_newest_commands_win_when_the_queue_is_full() -> None:
    playout = JitterBuffer(prefill=0)
    for k in range(CAPACITY + 10):
        playout.push(command(k))
    assert (len(playout), playout.dropped) == (CAPACITY, 10)
    assert take_ids(playout, 1) == [10]


def test_nothing_is_lost_after_the_last_command() -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(1, finished=True))
    assert take_ids(playout, 4) == [1, "wait", "wait", "wait"]


def test_a_command_after_the_last_one_does_not_count() -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(1, finished=True))
    take_ids(playout, 1)
    assert not playout.push(command(2, finished=True))
    assert (playout.arrived, playout.late, playout.duplicates, len(playout)) == (1, 0, 0, 0)


@pytest.mark.parametrize("lost", [1, 100, 400])
def test_the_success_rate_forgets_what_is_older_than_its_window(lost: int) -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(0))
    take_ids(playout, 1 + lost)
    assert playout.success_rate == 1 / (1 + lost)
    for k in range(1001):
        playout.push(command(10_000 + k))
        take_ids(playout, 1)
    assert playout.success_rate == 1.0


def test_the_window_of_the_success_rate_is_the_makers() -> None:
    playout = JitterBuffer(prefill=0, window=100)
    for k in range(150):
        playout.push(command(k))
    take_ids(playout, 150)
    take_ids(playout, 25)
    assert playout.success_rate == 0.75


def test_commands_that_come_now_and_then_are_played_at_once_and_nothing_is_lost() -> None:
    playout = JitterBuffer(prefill=10)
    playout.begin(max_queued=0, is_streamed=False)
    assert take_ids(playout, 6000) == ["wait"] * 6000  # Longer than a stream may keep the controller waiting.
    for number in (7, 8, 20, 100):
        playout.push(command(number))
        assert [playout.take(by_one_step).command.number, *take_ids(playout, 3)] == [number, *["wait"] * 3]  # type: ignore[union-attr]
        assert not playout.is_starved
    playout.push(command(110))
    playout.push(command(111))
    assert take_ids(playout, 2) == [111, "wait"]
    assert (playout.lost, playout.success_rate) == (0, 1.0)


def test_a_buffer_is_behind_while_a_lost_cycle_comes_before_the_next_command() -> None:
    playout = JitterBuffer(prefill=0)
    playout.push(command(7))
    assert not playout.is_behind(by_whole_gap)  # Not playing yet.
    take_ids(playout, 1)
    assert not playout.is_behind(by_whole_gap)  # Nothing is known of a later cycle.
    playout.push(command(10))
    assert not playout.is_behind(by_one_step)
    assert playout.is_behind(by_whole_gap)
    assert take_ids(playout, 1) == ["lost"]
    assert playout.is_behind(by_whole_gap)
    assert take_ids(playout, 1) == ["lost"]
    assert not playout.is_behind(by_whole_gap)
    assert take_ids(playout, 1) == [10]
