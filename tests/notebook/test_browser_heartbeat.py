"""When missing answers mean that the page is gone: only while the listener is free."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest

from rcilab.notebook import browser_heartbeat, cells
from rcilab.notebook.browser_heartbeat import MAX_MISSED, BrowserHeartbeat


@pytest.fixture
def loop() -> Iterator[asyncio.AbstractEventLoop]:
    event_loop = asyncio.new_event_loop()
    yield event_loop
    event_loop.close()


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> BrowserHeartbeat:
    monkeypatch.setattr(browser_heartbeat, "INTERVAL", 0.0)  # Every beat is a question.
    return BrowserHeartbeat()


def answer(asked: BrowserHeartbeat, loop: asyncio.AbstractEventLoop) -> None:
    async def reply() -> None:
        asked._on_answer({})

    loop.run_until_complete(reply())


def listen(loop: asyncio.AbstractEventLoop) -> None:
    loop.run_until_complete(asyncio.sleep(0))


def test_a_page_that_never_answered_is_not_missed(asked: BrowserHeartbeat) -> None:
    for _ in range(2 * MAX_MISSED):
        asked.beat()
    assert not asked.was_seen
    assert not asked.is_gone


def test_a_page_is_gone_after_the_allowed_missed_heartbeats_and_back_with_an_answer(
    asked: BrowserHeartbeat, loop: asyncio.AbstractEventLoop
) -> None:
    answer(asked, loop)
    for count in range(MAX_MISSED):
        assert not asked.is_gone, count
        asked.beat()
        listen(loop)
    assert asked.is_gone
    answer(asked, loop)
    assert not asked.is_gone


def test_heartbeats_without_a_free_listener_count_once(
    asked: BrowserHeartbeat, loop: asyncio.AbstractEventLoop
) -> None:
    answer(asked, loop)
    for _ in range(10 * MAX_MISSED):
        asked.beat()
    listen(loop)
    assert not asked.is_gone


def test_a_listener_that_the_page_has_closed_counts_as_no_answer(asked: BrowserHeartbeat) -> None:
    loop = asyncio.new_event_loop()
    answer(asked, loop)
    loop.close()
    for _ in range(MAX_MISSED):
        asked.beat()
    assert asked.is_gone


def test_the_thread_of_cells_handles_no_answer_while_a_cell_runs(
    asked: BrowserHeartbeat, loop: asyncio.AbstractEventLoop
) -> None:
    running = cells.CellRegistry(None)
    running._running.set()
    asked.is_cell_running = lambda: running.is_running
    answer(asked, loop)
    for _ in range(2 * MAX_MISSED):
        asked.beat()
        listen(loop)  # As in a cell that awaits.
    assert not asked.is_gone
    running._running.clear()
    for _ in range(MAX_MISSED):
        asked.beat()
        listen(loop)
    assert asked.is_gone
