"""Which row of the record a client's command gets, whatever numbers it has: without sockets, one cycle at a time."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rcilab.core.cycle_ring import CycleRing
from rcilab.core.state import ControllerMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import load_model
from rcilab.sim.cycle_capture import CycleCapture
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm
from tests.peers import wire

MODEL = load_model("xMatePro7")


class Bench:
    """A controller whose motion has begun, with its record."""

    def __init__(self, controller_mode: int = 0, motion_mode: int = 1) -> None:
        arm = VirtualArm(MODEL, build_plant("ideal", MODEL), prefill=0, lost_limit=None)
        self.controller = RciController(arm, mode_delay=0)
        facts = {"model": "xMatePro7", "plant": "ideal", "url": "rci://127.0.0.1", "realtime": False}
        self.ring = CycleRing.create(7, facts)
        self.capture = CycleCapture(self.ring, self.controller)
        self.reader = self.ring.open_reader()
        self.sent: list[float] = []
        self.controller.handle(rci.SetMotorPower(1))
        self.cycles(1500)
        self.start(controller_mode, motion_mode)

    def start(self, controller_mode: int = 0, motion_mode: int = 1) -> None:
        self.controller.handle(rci.StartMove(controller_mode, motion_mode))
        while self.controller.state.controller_mode is ControllerMode.OTHER:
            self.cycles(1)

    @property
    def number(self) -> int:
        """The number of the last state."""
        return self.controller.state.message_id

    def cycles(self, count: int) -> None:
        for _ in range(count):
            self.controller.step()
            self.capture.write()

    def send(self, number: int) -> None:
        """Sends the next command; joint 1 of each is larger by 1 nrad."""
        angle = 1e-9 * (len(self.sent) + 1)
        self.sent.append(angle)
        q = (angle, *MODEL.home.tolist()[1:])
        self.controller.receive(rci.decode_command(wire.pack_command(number, q), 7))

    def end(self) -> dict[str, Any]:
        """Ends the motion and returns its event."""
        self.controller.handle(rci.StopMove())
        self.cycles(1000)
        return self.ring.events(0)[0][-1]

    def rows(self) -> NDArray[np.void]:
        return self.reader.drain()


@pytest.fixture
def bench() -> Iterator[Bench]:
    found = Bench()
    yield found
    found.ring.close()


def in_time(bench: Bench, count: int) -> None:
    for _ in range(count):
        bench.send(bench.number)
        bench.cycles(1)


def recorded(rows: NDArray[np.void]) -> list[float]:
    """Joint 1 of the commands, by row."""
    return rows["command"][np.isfinite(rows["command"]).all(axis=1), 0].tolist()


def played(rows: NDArray[np.void]) -> list[float]:
    """Joint 1 of the played commands."""
    at = np.flatnonzero(rows["played"])
    return rows["command"][at - rows["age"][at].astype(int), 0].tolist()


def test_a_burst_that_answers_the_newest_state_first_is_recorded_as_played(bench: Bench) -> None:
    newest = bench.number
    for number in (newest, *range(newest - 20, newest)):
        bench.send(number)
    bench.cycles(25)
    assert played(bench.rows()) == bench.sent


def test_repeated_answers_that_come_late_have_the_rows_without_a_command(bench: Bench) -> None:
    """A client that was stopped for 30 ms answers the last state again, then the states that it finds."""
    in_time(bench, 50)
    stopped = bench.number
    bench.cycles(30)
    for _ in range(4):
        bench.send(stopped)
    for number in range(stopped + 1, bench.number + 1):
        bench.send(number)
    for _ in range(50):
        bench.cycles(1)
        bench.send(bench.number)
    bench.cycles(60)
    rows = bench.rows()
    end = bench.end()
    assert bench.controller.playout.late > 30
    assert recorded(rows) == [angle for angle in bench.sent if angle in set(recorded(rows))]
    assert len(bench.sent) - len(recorded(rows)) == end["unrecorded"]
    assert set(played(rows)) <= set(recorded(rows))
    at = np.flatnonzero(rows["played"])
    assert (rows["age"][at[-50:]] == 1).all(), "after the pause each command is in the row of its state"


@pytest.mark.parametrize("pause", [30, 400])
@pytest.mark.parametrize("counts_on_its_own", [False, True])
def test_a_pause_costs_no_command_of_a_client(bench: Bench, pause: int, counts_on_its_own: bool) -> None:
    """It answers every state that it finds afterwards, with the number of the state or by its own count."""
    first = bench.number

    def number_of(state: int) -> int:
        return state - first + 1 if counts_on_its_own else state

    for _ in range(100):
        bench.send(number_of(bench.number))
        bench.cycles(1)
    stopped = bench.number
    bench.cycles(pause)
    for state in range(stopped, bench.number):
        bench.send(number_of(state))
    for _ in range(100):
        bench.send(number_of(bench.number))
        bench.cycles(1)
    rows = bench.rows()
    assert recorded(rows) == bench.sent
    at = np.flatnonzero(rows["played"])
    assert (rows["age"][at[-50:]] == 1).all()


def test_torques_that_are_skipped_leave_the_others_in_their_order() -> None:
    """A client that answers a state twice: the newer torque is played."""
    bench = Bench(4, 0)
    for k in range(200):
        for _ in range(2 if k % 20 == 10 else 1):
            bench.sent.append(1e-3 * len(bench.sent))
            packet = rci.CommandPacket(bench.number, tau_c=(bench.sent[-1], *[0.0] * 6))
            bench.controller.receive(packet)
        bench.cycles(1)
    end = bench.end()
    rows = bench.rows()
    tau = rows["command_tau"][:, 0]
    at = np.flatnonzero(rows["played"])
    assert len(at) == 200
    assert np.isfinite(tau[at - rows["age"][at].astype(int)]).all(), "every played command is recorded"
    found = tau[np.isfinite(tau)]
    assert (np.diff(found) > 0.0).all()
    assert len(bench.sent) - len(found) == end["unrecorded"]
    bench.ring.close()


def test_a_stop_with_very_many_violations_has_an_event(bench: Bench) -> None:
    in_time(bench, 20)
    bench.controller.receive(rci.decode_command(wire.pack_command(bench.number, (-12345678.912,) * 7), 7))
    bench.cycles(2)
    end = bench.end()
    assert end["event"] == "end"
    assert end["stopped"]["said"].count("passes") == 28
    assert len(json.dumps(end)) > 8192


def test_a_repeated_answer_in_a_pause_is_not_a_missed_cycle(bench: Bench) -> None:
    in_time(bench, 50)
    q = (bench.sent[-1], *MODEL.home.tolist()[1:])
    for _ in range(5):
        bench.controller.receive(rci.decode_command(wire.pack_command(bench.number - 1, q), 7))
        bench.cycles(1)
    bench.cycles(3)
    assert bench.rows()["missed"].sum() == bench.controller.playout.lost


def test_a_count_that_begins_again_at_the_number_of_an_early_state_is_recorded(bench: Bench) -> None:
    in_time(bench, 100)
    for number in range(bench.number - 700, bench.number - 600):
        bench.send(number)
        bench.cycles(1)
    bench.cycles(30)
    rows = bench.rows()
    at = np.flatnonzero(rows["played"])
    assert (rows["age"][at] < 20).all()
    assert recorded(rows) == bench.sent


def test_a_client_that_counts_ahead_leaves_the_row_of_a_lost_command_empty(bench: Bench) -> None:
    """It sends one command for every state, four of them late and at once, and number 60 is lost."""
    bench.cycles(3)
    for number in range(10_000_000, 10_000_100):
        if number != 10_000_060:
            bench.send(number)
        bench.cycles(number >= 10_000_003)
    bench.cycles(10)
    rows = bench.rows()
    assert recorded(rows) == bench.sent
    answered = np.flatnonzero(np.isfinite(rows["command"]).all(axis=1))
    assert np.diff(answered).tolist() == [1] * 59 + [2] + [1] * 38


def test_commands_that_wait_for_a_row_at_the_end_are_counted(bench: Bench) -> None:
    in_time(bench, 50)
    bench.controller.receive(rci.decode_command(wire.pack_command(10**6, (1.0,) * 7), 7))  # It stops the arm.
    for number in range(10**6 + 1, 10**6 + 30):
        bench.send(number)
    bench.cycles(1000)
    rows, end = recorded(bench.rows()), bench.ring.events(0)[0][-1]
    assert end["received"] == len(rows) + end["unrecorded"] == 80
    assert end["unrecorded"] > 10
