"""A held push lasts while it is held: silence, release and an error end it, and nobody who calls waits."""

from __future__ import annotations

import math
import threading
import time

import pytest

from rcilab.core.errors import ConnectionLostError, InvalidValueError
from rcilab.execution.external_force_hold import ExternalForceHold
from tests.waiting import wait_for


class FakeWorld:
    """Writes down what it is asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple] = []
        self.error: ConnectionLostError | None = None
        self.hangs = threading.Event()
        self.hangs.set()

    def push(self, wrench, link=None, point=None, duration=None) -> None:
        self.hangs.wait(5.0)
        if self.error is not None:
            raise self.error
        self.asked.append(("push", wrench[2], link, point, duration))

    def release(self) -> None:
        self.asked.append(("release",))

    def close(self) -> None:
        self.asked.append(("close",))


@pytest.fixture
def world():
    return FakeWorld()


@pytest.fixture
def push(world):
    with ExternalForceHold(world) as push:
        yield push


DOWN = [0.0, 0.0, -10.0, 0.0, 0.0, 0.0]


def test_it_is_renewed_while_it_is_held_and_always_with_an_end(push, world):
    while len(world.asked) < 3:
        push.hold(DOWN, link=4, point=[0.0, 0.0, 0.1])
        time.sleep(0.02)
    assert set(world.asked) == {("push", -10.0, 4, (0.0, 0.0, 0.1), 0.5)}


def test_silence_ends_it(push, world):
    push.hold(DOWN)
    wait_for(lambda: world.asked[-1:] == [("release",)])


def test_letting_go_ends_it(push, world):
    push.hold(DOWN)
    wait_for(lambda: len(world.asked) == 1)
    push.release()
    wait_for(lambda: world.asked[-1] == ("release",))


def test_a_controller_that_hangs_keeps_nobody_waiting(push, world):
    world.hangs.clear()
    for force in range(100):
        push.hold([0.0, 0.0, force, 0.0, 0.0, 0.0])
    world.hangs.set()
    wait_for(lambda: any(asked[1:2] == (99.0,) for asked in world.asked))
    assert len(world.asked) < 10  # Only the newest of what came meanwhile.


def test_a_lost_controller_is_told_once(push, world):
    world.error = ConnectionLostError("gone")
    push.hold(DOWN)
    errors = []
    wait_for(lambda: errors.append(push.pop_error()) or errors[-1] is not None)
    assert push.pop_error() is None
    assert world.asked == []


def test_a_force_that_is_no_number_is_refused_at_once(push, world):
    with pytest.raises(InvalidValueError):
        push.hold([0.0, 0.0, math.nan, 0.0, 0.0, 0.0])


def test_closing_lets_go(world):
    push = ExternalForceHold(world)
    push.hold(DOWN)
    wait_for(lambda: len(world.asked) == 1)
    push.close()
    push.close()
    assert world.asked[-2:] == [("release",), ("close",)]
