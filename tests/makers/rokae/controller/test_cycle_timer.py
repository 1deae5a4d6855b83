"""Pauses of the client alone, whose commands are then lost, and of the whole machine, which loses none."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.rokae.faults import Fault
from rcilab.sim.cycle_timer import MAX_CATCH_UP, CycleTimer
from tests.makers.rokae.controller.conftest import Hand
from tests.manual_clock import ManualClock

START = 0.1  # [s] into the motion, when the pause begins.


def run_torques(hand: Hand, *, ours: float, clients: float, seconds: float = 1.0) -> CycleTimer:
    """Streams torques on a machine that takes the controller its core for a while, and the client its own."""
    clock, answered = ManualClock(), 0
    timer, has_stopped = CycleTimer(clock.now()), False
    hand.start(4, 0)
    while clock.now() < seconds and not hand.state.faults:
        if clock.now() >= START and not has_stopped:
            has_stopped = True
            clock.advance(ours)
        clock.sleep_until(timer.next(clock.now()))
        is_client_away = START <= clock.now() < START + clients
        if hand.state.message_id != answered and not is_client_away:
            answered = hand.state.message_id
            hand.torque_only([0.0] * 7)
        if not timer.postpones(hand.cycle.is_starved):
            hand.step()
    return timer


@pytest.fixture
def torque_hand(make_hand: Callable[..., Hand]) -> Hand:
    return make_hand(prefill=10)


@pytest.mark.parametrize("later", [0.0, 0.005, 0.04, 0.1])
def test_a_client_that_stood_still_with_us_has_lost_no_commands(torque_hand: Hand, later: float) -> None:
    timer = run_torques(torque_hand, ours=0.143, clients=0.143 + later)
    assert torque_hand.state.faults == ()
    assert torque_hand.cycle.playout.lost == 0
    assert 1000 * (0.143 + later) - 5 <= timer.missed <= 1000 * (0.143 + later) + 1


def test_a_client_that_stands_still_alone_loses_its_commands(torque_hand: Hand) -> None:
    timer = run_torques(torque_hand, ours=0.0, clients=0.04)
    assert torque_hand.state.faults == (Fault.INSTABILITY_DETECTION,)
    assert timer.missed == 0


def test_a_client_that_does_not_come_back_is_waited_for_as_long_as_we_were_away(torque_hand: Hand) -> None:
    timer = run_torques(torque_hand, ours=0.05, clients=10.0)
    assert torque_hand.state.faults == (Fault.INSTABILITY_DETECTION,)
    assert 95 <= timer.missed <= 101


def test_cycles_are_postponed_for_the_length_of_a_pause_only() -> None:
    timer = CycleTimer(0.0)
    assert timer.next(0.031) == pytest.approx(0.031)
    assert timer.missed == 30
    for k in range(30):
        assert timer.postpones(is_starved=True)
        timer.next(0.032 + k * CYCLE_TIME)
    assert not timer.postpones(is_starved=True)
    assert timer.missed == 60


def test_catching_up_begins_with_a_pause_and_ends() -> None:
    timer = CycleTimer(0.0)
    timer.next(0.0)
    assert not timer.postpones(is_starved=True)
    timer.next(1000.0)
    assert not timer.postpones(is_starved=False)
    count = 0
    while timer.postpones(is_starved=True):
        count += 1
        timer.next(timer.deadline)
    assert count == MAX_CATCH_UP


def test_the_grid_has_the_period_of_the_maker() -> None:
    timer = CycleTimer(0.0, period=0.004)
    assert timer.next(0.0) == pytest.approx(0.004)
    assert timer.next(0.017) == pytest.approx(0.016)
    assert timer.missed == 2
