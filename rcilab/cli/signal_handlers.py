"""Handlers of signals that are in force while a command runs, and not for its caller afterwards."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any

Handler = Callable[[int, FrameType | None], Any] | signal.Handlers


@contextmanager
def handled_signals(handlers: Mapping[int, Handler]) -> Iterator[None]:
    """Installs handlers by the number of their signal, and restores the previous ones; only in the main thread."""
    previous = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
