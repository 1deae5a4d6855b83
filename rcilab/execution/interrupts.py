"""Ctrl-C during a motion: handled between two cycles, where the loop knows what the arm was commanded last."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any

_Handler = Callable[[int, FrameType | None], Any]


class DeferredInterrupts:
    """Defers SIGINT while it is entered.

    Python would raise KeyboardInterrupt between any two instructions, also after a command was sent and before it is
    recorded: a stop from there would not continue smoothly. Without effect outside the main thread, which
    alone gets signals, and where SIGINT is ignored.

    Attributes:
        is_allowed: Whether an interrupt is handled at once: in the caller's code.
        is_pending: Whether one waits for `deliver`.
    """

    def __init__(self) -> None:
        self.is_allowed = False
        self.is_pending = False
        self._previous: _Handler | None = None

    def __enter__(self) -> None:
        """Takes over SIGINT."""
        previous = signal.getsignal(signal.SIGINT)
        if threading.current_thread() is threading.main_thread() and callable(previous):
            self._previous = previous
            signal.signal(signal.SIGINT, self._on_signal)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Restores the previous handler, and calls it for an interrupt that came last."""
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)
            self.deliver()
            self._previous = None

    def deliver(self) -> None:
        """Calls the previous handler, which usually raises KeyboardInterrupt, if an interrupt is pending."""
        if self.is_pending and self._previous is not None:
            self.is_pending = False
            self._previous(signal.SIGINT, None)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.is_allowed and self._previous is not None:
            self.is_allowed = False
            self._previous(number, frame)
        else:
            self.is_pending = True
