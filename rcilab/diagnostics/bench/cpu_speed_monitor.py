"""How fast this machine computes while something is measured on it.

Other people's work on the same processor makes a virtual machine slower for seconds or minutes, without any sign inside
of it: neither load nor stolen time shows it. A fixed piece of Python that is timed now and then does.
"""

from __future__ import annotations

import statistics
import threading
import time

_ROUNDS = 20_000  # Some 1 ms of Python.
_PERIOD = 0.5  # [s] between two looks: 0.2 % of a core.
SLOW = 1.2  # Reported from here on: other rows vary by 10 % from run to run, so that less says nothing.


class CpuSpeedMonitor:
    """Looks again and again from `with` to its end. Use one for several things, one after the other."""

    def __init__(self) -> None:
        self._fastest = min(_look() for _ in range(50))
        self._looks: list[float] = []
        self._is_over = threading.Event()
        self._watcher: threading.Thread | None = None

    def __enter__(self) -> CpuSpeedMonitor:
        self._looks, self._is_over = [_look()], threading.Event()
        self._watcher = threading.Thread(target=self._watch, name="pace-watch", daemon=True)
        self._watcher.start()
        return self

    def __exit__(self, *exc_info: object) -> None:
        assert self._watcher is not None
        self._is_over.set()
        self._watcher.join()

    @property
    def slowness(self) -> float:
        """How many times as long as ever at best the piece has taken, in the median, since the last `with`."""
        looks = tuple(self._looks)
        self._fastest = min(self._fastest, *looks)
        return statistics.median(looks) / self._fastest

    def _watch(self) -> None:
        while not self._is_over.wait(_PERIOD):
            self._looks.append(_look())


def _look() -> float:
    """Returns what the piece takes, [s]: of processor time, so that waiting for a core does not count."""
    start, total = time.thread_time_ns(), 0
    for number in range(_ROUNDS):
        total += number * number
    return 1e-9 * (time.thread_time_ns() - start)
