"""A workbench that is open, and what a test asks of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.waiting import wait_for


def wait(condition: Callable[[], bool], what: str, timeout: float = 30.0) -> None:
    wait_for(condition, timeout, what)


def told(bench: Workbench) -> str | None:
    """The code of the notice that is shown."""
    notice = bench.store.state.notice
    return None if notice is None else notice.text.code


def all_told(bench: Workbench) -> set[str]:
    """The codes of all notices that are kept."""
    return {notice.text.code for notice in bench.store.state.notices}


@contextmanager
def opened() -> Iterator[Workbench]:
    """A workbench with an idle arm; no error of ours may have been swallowed by the end."""
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
        wait(lambda: bench.session.status().phase == "idle" and bool(bench.session.status().powered), "an idle arm")
        yield bench
        assert bench.dispatcher.errors == []
        assert bench.renderer.errors == []
