"""Waiting for what happens in other threads and processes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, TypeVar

SOON = 20.0  # [s] Generous: the machine may be busy.

T = TypeVar("T")


def wait_for(
    condition: Callable[[], T], timeout: float = SOON, what: str | Callable[[], str] = "it", tab: Any = None
) -> T:
    """Returns the value of a condition once it is true.

    Args:
        condition: What to poll.
        timeout: How long it may take, [s]; the test fails after that.
        what: What is waited for, for the message.
        tab: Page of playwright, which handles that page's events meanwhile.
    """
    deadline = time.monotonic() + timeout
    while not (found := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"{what() if callable(what) else what} did not happen within {timeout:g} s")
        if tab is None:
            time.sleep(0.01)
        else:
            tab.wait_for_timeout(50)
    return found
