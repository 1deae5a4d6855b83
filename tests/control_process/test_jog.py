"""Jogging through the control process: moves while it is held, rests inside the limits when it is not."""

from __future__ import annotations

import itertools
import math
import os
import signal
import threading
import time

import numpy as np
import pytest

from rcilab.control_process import Supervisor
from rcilab.control_process.jog_record import HOLD_TIMEOUT, read_jog, write_jog
from rcilab.control_process.launch import start_controller
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.spatial import Pose
from rcilab.execution.jog import JogCommand
from rcilab.model.robot_model import load_model
from tests.waiting import SOON, wait_for

TOOL = Pose([0.0, 0.0, 0.1])
MODEL = load_model("xMatePro7", tool=TOOL)


@pytest.fixture(scope="module")
def shared():
    with Supervisor(MODEL) as supervisor:
        supervisor.power_on().wait(SOON)
        yield supervisor


@pytest.fixture
def supervisor(shared):
    wait_for(lambda: shared.status().phase == "idle")
    shared.drain()
    return shared


def hold(supervisor, kind, values, until, timeout=SOON):
    """Holds a jog until something has happened, and returns its ticket."""
    deadline = time.monotonic() + timeout
    while not until(supervisor.status()):
        ticket = supervisor.jog(kind, values)
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.05)
    return ticket


def differences(supervisor):
    """Returns velocity, acceleration and jerk of what was commanded, from whole rows of cycles."""
    rows = supervisor.drain()
    rows = rows[np.isfinite(rows["t"])]
    assert len(rows) > 100
    whole = np.flatnonzero(np.diff(rows["message_id"].astype(int)) != 1)
    starts = [0, *(whole + 1), len(rows)]
    parts = [rows["q_c"][a:b] for a, b in itertools.pairwise(starts) if b - a > 10]
    return [np.concatenate([np.diff(part, n=order, axis=0) for part in parts]) / 1e-3**order for order in (1, 2, 3)]


def require_inside(supervisor):
    limits = MODEL.limits.joint
    for values, bound in zip(differences(supervisor), (limits.velocity, limits.acceleration, limits.jerk), strict=True):
        assert (np.abs(values).max(axis=0) < bound).all()


def test_a_joint_moves_while_it_is_held_and_comes_to_rest_when_it_is_not(supervisor):
    start = supervisor.status().q_c.copy()
    ticket = hold(supervisor, "joint", [0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0], lambda s: s.q_c[1] < start[1] - 0.15)
    assert (supervisor.status().phase, supervisor.status().code) == ("moving", "moving.jog")
    supervisor.release_jog()
    ticket.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.jogged", ())
    moved = status.q_c - start
    assert -0.6 < moved[1] < -0.15
    assert np.abs(np.delete(moved, 1)).max() < 1e-12
    require_inside(supervisor)


def test_nobody_renews_it_so_it_was_let_go(supervisor):
    start = supervisor.status().q_c.copy()
    ticket = hold(supervisor, "joint", [0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], lambda s: s.q_c[0] > start[0] + 0.02)
    there = supervisor.status().q_c[0]
    ticket.wait(SOON)
    way = supervisor.status().q_c[0] - there
    assert 0.0 < way < 0.3 * (HOLD_TIMEOUT + 0.7)  # On a busy machine the look at the status is some time ago.


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_the_tool_goes_along_its_axes(supervisor, frame):
    before = MODEL.forward(supervisor.status().q_c)

    def way(status):
        moved = MODEL.forward(status.q_c).position - before.position
        return moved if frame == "base" else before.rotation.T @ moved

    ticket = hold(supervisor, frame, [0.0, 0.0, -0.1, 0.0, 0.0, 0.0], lambda s: way(s)[2] < -0.03)
    supervisor.release_jog()
    ticket.wait(SOON)
    status = supervisor.status()
    x, y, z = way(status)
    assert z < -0.03
    assert math.hypot(x, y) < 0.01 * abs(z) + 1e-4
    after = MODEL.forward(status.q_c)
    assert np.abs(after.rotation - before.rotation).max() < 1e-3
    require_inside(supervisor)


def test_the_direction_may_change_without_a_stop_and_one_ticket_serves(supervisor):
    start = supervisor.status().q_c[3]
    first = hold(supervisor, "joint", [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0], lambda s: s.q_c[3] > start + 0.05)
    second = hold(supervisor, "joint", [0.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0], lambda s: s.q_c[3] < start)
    assert first is second
    supervisor.stop().wait(SOON)
    assert first.done
    assert first.error is not None  # It was stopped: the way of every motion.
    require_inside(supervisor)


def test_another_request_ends_a_jog_that_nobody_holds(supervisor):
    ticket = hold(
        supervisor, "joint", [-0.3, 0, 0, 0, 0, 0, 0], lambda s: s.code == "moving.jog" and abs(s.dq[0]) > 0.1
    )
    supervisor.release_jog()
    supervisor.power_on().wait(SOON)
    assert ticket.done
    assert ticket.error is None
    assert supervisor.status().phase == "idle"


def test_what_cannot_be_jogged_is_refused_in_words(supervisor):
    for kind, values, said in (
        ("joint", [0.0] * 6, "needs (7,)"),
        ("base", [0.0, 0.0, math.nan, 0.0, 0.0, 0.0], "finite"),
        ("sideways", [0.0] * 6, "not a kind of jog"),
    ):
        with pytest.raises(InvalidValueError, match=said.replace("(", r"\(").replace(")", r"\)")):
            supervisor.jog(kind, values)
    assert supervisor.status().phase == "idle"


def test_without_anybody_at_the_controls_it_stops_and_does_not_begin() -> None:
    with Supervisor(MODEL) as supervisor:
        supervisor.power_on().wait(SOON)
        supervisor.set_operator_present(True)
        ticket = hold(supervisor, "joint", [0.2, 0, 0, 0, 0, 0, 0], lambda s: s.code == "moving.jog")
        with pytest.raises(UsageError, match="the operator's page does not respond"):  # It is held, but by nobody.
            wait_for(lambda: supervisor.jog("joint", [0.2, 0, 0, 0, 0, 0, 0]).done)
        assert supervisor.status().code == "idle.operator"
        assert ticket.done


def test_the_program_that_held_it_is_gone_and_the_arm_comes_to_rest() -> None:
    # Its connection ends when the system has taken down the killed process, on a busy machine after 0.1 s: by then
    # 20 commands in a row would be lost, which is a fault, and another way to rest.
    controller = start_controller(MODEL.name, options=["--lost-limit", "0"])
    try:
        with Supervisor(MODEL, controller.address) as supervisor:
            supervisor.power_on().wait(SOON)
            ticket = hold(
                supervisor, "joint", [0.3, 0, 0, 0, 0, 0, 0], lambda s: s.dq is not None and abs(s.dq[0]) > 0.1
            )
            os.kill(supervisor.status().worker_pid, signal.SIGKILL)
            wait_for(lambda: ticket.done)
            status = wait_for(lambda: s if (s := supervisor.status()).phase == "idle" else None)
            assert np.abs(status.dq).max() < 1e-9
            assert status.faults == ()
    finally:
        controller.end()


def test_a_jog_is_read_as_a_whole_or_not_at_all() -> None:
    memory, words = memoryview(bytearray(4096)), memoryview(bytearray(512)).cast("Q")
    ending = threading.Event()
    sides = [JogCommand("joint", (1.0,) * 7), JogCommand("tool", (2.0,) * 6)]
    write_jog(memory, words, sides[0])

    def write() -> None:
        while not ending.is_set():
            for side in sides:
                write_jog(memory, words, side)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        seen = {read_jog(memory, words) for _ in range(20_000)}
        wait_for(lambda: seen.update({read_jog(memory, words)}) or seen >= set(sides))
    finally:
        ending.set()
        writer.join()
    assert seen - {None} == set(sides)
