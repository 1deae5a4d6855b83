"""Whose turn it is on a connection, without one."""

from __future__ import annotations

import threading

import pytest

from rcilab.core.errors import UsageError
from rcilab.execution.session_lock import SessionLock
from tests.waiting import wait_for


def test_a_request_waits_for_another_threads_turn() -> None:
    turns, seen = SessionLock(lambda: None), []

    def ask() -> None:
        with turns.acquire("a question"):
            seen.append("asked")

    asker = threading.Thread(target=ask)
    with turns.begin_motion("a motion"):
        asker.start()
        with turns.acquire("its own question"):  # Who sets out may still ask.
            assert seen == []
    asker.join(5.0)
    assert seen == ["asked"]


def test_a_request_is_refused_while_a_motion_runs_in_its_own_thread_too() -> None:
    turns = SessionLock(lambda: None)
    with turns.begin_motion("a motion"), turns.move():
        with pytest.raises(UsageError, match="question is not possible"), turns.acquire("question"):
            pass
    with turns.acquire("question"):
        assert not turns.is_moving


def test_a_stop_counts_from_setting_out_on_and_for_one_motion() -> None:
    turns = SessionLock(lambda: None)
    turns.stop("too early")
    with turns.begin_motion("a motion"):
        assert turns.reason_to_stop(0.0) is None
        turns.stop("now")
        turns.stop("later")
        with turns.move():
            assert turns.reason_to_stop(0.0) == "now"
    with turns.begin_motion("the next one"):
        assert turns.reason_to_stop(0.0) is None


def test_a_motion_that_closes_its_own_connection_comes_to_its_end_first() -> None:
    said: list[str] = []
    turns = SessionLock(lambda: said.append("disconnected"))
    with turns.begin_motion("a motion"), turns.move():
        turns.close()
        assert turns.reason_to_stop(0.0) is not None
        assert said == []
    assert said == ["disconnected"]
    with pytest.raises(UsageError, match="closed"), turns.acquire("question"):
        pass


def test_another_thread_that_closes_waits_for_the_motion() -> None:
    said: list[str] = []
    turns = SessionLock(lambda: said.append("disconnected"))
    closer = threading.Thread(target=turns.close)
    with turns.begin_motion("a motion"):
        with turns.move():
            closer.start()
            wait_for(lambda: turns.is_closing)
            assert said == []
        assert said == ["disconnected"]
    closer.join(5.0)
    assert not closer.is_alive()


def test_a_motion_that_the_controller_plans_is_stopped_by_stop_and_by_close() -> None:
    stops: list[str] = []
    turns = SessionLock(lambda: None)
    with turns.acquire("a planned motion"), turns.move(lambda: stops.append("stop")):
        assert turns.is_moving
        turns.stop("on request")
        closer = threading.Thread(target=turns.close)
        closer.start()
        wait_for(lambda: len(stops) == 2)
        with pytest.raises(UsageError), turns.acquire("another"):
            pass
    closer.join(5.0)
    assert not closer.is_alive()
