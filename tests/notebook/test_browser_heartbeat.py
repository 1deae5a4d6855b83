"""When silence means that nobody is there: only where somebody listens for the answer."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest

from rcilab.notebook import browser_heartbeat as heart
from rcilab.notebook import cells
from rcilab.notebook.browser_heartbeat import PATIENCE, BrowserHeartbeat


@pytest.fixture
def ear() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    yield loop
    loop.close()


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> BrowserHeartbeat:
    monkeypatch.setattr(heart, "INTERVAL", 0.0)  # Every beat is a question.
    return BrowserHeartbeat()


def answer(asked: BrowserHeartbeat, ear: asyncio.AbstractEventLoop) -> None:
    async def say() -> None:
        asked._on_answer({})

    ear.run_until_complete(say())


def listen(ear: asyncio.AbstractEventLoop) -> None:
    ear.run_until_complete(asyncio.sleep(0))


def test_a_page_that_never_answered_is_not_missed(asked: BrowserHeartbeat) -> None:
    for _ in range(2 * PATIENCE):
        asked.beat()
    assert not asked.was_seen
    assert not asked.is_gone


def test_a_page_is_gone_after_as_many_questions_as_patience_has_and_back_with_an_answer(
    asked: BrowserHeartbeat, ear: asyncio.AbstractEventLoop
) -> None:
    answer(asked, ear)
    for count in range(PATIENCE):
        assert not asked.is_gone, count
        asked.beat()
        listen(ear)
    assert asked.is_gone
    answer(asked, ear)
    assert not asked.is_gone


def test_what_is_asked_while_nobody_listens_counts_once(
    asked: BrowserHeartbeat, ear: asyncio.AbstractEventLoop
) -> None:
    answer(asked, ear)
    for _ in range(10 * PATIENCE):
        asked.beat()
    listen(ear)
    assert not asked.is_gone


def test_an_ear_that_the_page_has_taken_along_is_silence(asked: BrowserHeartbeat) -> None:
    ear = asyncio.new_event_loop()
    answer(asked, ear)
    ear.close()
    for _ in range(PATIENCE):
        asked.beat()
    assert asked.is_gone


def test_the_thread_of_cells_hears_nothing_while_a_cell_runs(
    asked: BrowserHeartbeat, ear: asyncio.AbstractEventLoop
) -> None:
    running = cells.CellRegistry(None)
    running._running.set()
    asked.is_cell_running = lambda: running.is_running
    answer(asked, ear)
    for _ in range(2 * PATIENCE):
        asked.beat()
        listen(ear)  # As in a cell that awaits.
    assert not asked.is_gone
    running._running.clear()
    for _ in range(PATIENCE):
        asked.beat()
        listen(ear)
    assert asked.is_gone
