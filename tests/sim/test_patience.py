"""A controller with patience waits for the command of a cycle; by the clock of the machine, on real sockets.

The client computes its command from the number of the newest state, as the clients do that this is for.
"""

from __future__ import annotations

import time

import pytest

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae import wire as rci
from rcilab.model.robot_model import load_model
from rcilab.motion.joint import plan_joint
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.cycle_timer import CycleTimer
from tests.makers.rokae.controller.test_server import Peer, Running, running

MODEL = load_model("xMatePro7")
MOTION = plan_joint(MODEL, MODEL.home, MODEL.home + 0.05, speed=1.0)
OPTIONS = {"prefill": 0, "on_loss": "bridge", "lost_limit": None, "mode_delay": 0.05}


def stream(found: Running, peer: Peer, pauses: dict[int, float]) -> int:
    """Streams the motion; before the command for a cycle of it the client does nothing for a time, [s].

    Returns how many commands were lost before the first pause: states that were sent while the first command was on its
    way, and which the client skipped.
    """
    state = peer.start()
    first, left, lost = state.message_id, dict(pauses), 0
    time.sleep(0.005)  # The states of this time are not answered.
    while state.message_id - first < len(MOTION.q):
        k = state.message_id - first
        due = [cycle for cycle in left if cycle <= k]
        if due:
            lost = found.server.controller.playout.lost if len(left) == len(pauses) else lost
            time.sleep(left.pop(due[0]))
            state = peer.receive_newest_state() if found.server.controller.playout.lost > lost else state
            k = min(state.message_id - first, len(MOTION.q) - 1)
        peer.send(state.message_id, MOTION.q[k])
        state = peer.receive_newest_state()
        assert not state.faults
    return lost


def test_pauses_within_patience_lose_no_command() -> None:
    with running(patience=5.0, **OPTIONS) as found, Peer(found) as peer:
        lost = stream(found, peer, {20: 0.005, 60: 0.005, 100: 0.005, 140: 0.5})
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
        assert peer.receive_live_state().q_c == pytest.approx(MOTION.goal, abs=1e-12)
    assert found.server.controller.playout.lost == lost


def test_waiting_for_a_client_is_not_a_missed_cycle() -> None:
    with running(patience=5.0, **OPTIONS) as found, Peer(found) as peer:
        state = peer.run(MOTION.q[:20])
        before = found.server.missed
        time.sleep(0.5)
        assert found.server.missed - before < 250
        peer.send(state.message_id, MOTION.q[20])
        peer.receive_newest_state()
        assert found.server.missed - before < 250  # Half of the cycles that the clock alone would have gone on.


def test_a_longer_pause_loses_one_command_for_each_patience() -> None:
    with running(patience=0.02, **OPTIONS) as found, Peer(found) as peer:
        lost = stream(found, peer, {100: 0.1})
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert 1 <= found.server.controller.playout.lost - lost <= 15


def test_a_client_that_does_not_come_back_ends_the_motion() -> None:
    with running(patience=0.01, **{**OPTIONS, "lost_limit": 10}) as found, Peer(found) as peer:
        peer.run(MOTION.q[:50])
        while not peer.receive_state().faults:
            pass
    assert found.server.controller.playout.max_consecutive_lost == 10


@pytest.mark.parametrize("patience", [None, 0.0])
def test_without_patience_the_clock_goes_on(patience: float | None) -> None:
    with running(patience=patience, **OPTIONS) as found, Peer(found) as peer:
        peer.run(MOTION.q[:1])
        time.sleep(0.3)
        assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert found.server.controller.playout.lost >= 20


def test_lock_step_needs_patience() -> None:
    with pytest.raises(InvalidValueError, match="or 0 without lock-step"):
        ControllerConfig(model="xMatePro7", lockstep=True, patience=0.0)


def test_a_delayed_cycle_moves_the_grid_and_is_not_missed() -> None:
    timer = CycleTimer(0.0)
    due = timer.next(0.0)
    timer.delay(due - 1e-4)
    assert timer.deadline == due
    timer.delay(due + 0.1)
    assert timer.next(due + 0.1) == pytest.approx(due + 0.1 + CYCLE_TIME)
    assert timer.missed == 0
