"""Waiting for what happens in other threads and processes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

SOON = 20.0  # [s] Generous: the machine may be busy.

T = TypeVar("T")


def wait_for(condition: Callable[[], T], timeout: float = SOON, what: str = "it") -> T:
    """Returns what the condition gives once that is true; fails when it is not within `timeout`, [s]."""
    deadline = time.monotonic() + timeout
    while not (found := condition()):
        assert time.monotonic() < deadline, f"{what} did not happen within {timeout:g} s"
        time.sleep(0.01)
    return found
