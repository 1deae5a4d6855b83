"""Monitoring of the speed of this machine during a measurement.

Other virtual machines on the same processor can slow this one down for seconds or minutes, which neither its load nor
its stolen time shows. The time of a fixed Python loop, measured repeatedly, does.
"""

from __future__ import annotations

import statistics
import threading
import time

_ROUNDS = 20_000  # About 1 ms of Python.
_PERIOD = 0.5  # [s] Between two samples: 0.2 % of a core.
SLOW = 1.2  # Reported from this factor on: rows vary by 10 % from run to run, so smaller factors mean nothing.


class CpuSpeedMonitor:
    """Samples the speed inside its `with` block. Can be used for several measurements in sequence."""

    def __init__(self) -> None:
        self._fastest = min(_time_loop() for _ in range(50))
        self._samples: list[float] = []
        self._is_over = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> CpuSpeedMonitor:
        self._samples, self._is_over = [_time_loop()], threading.Event()
        self._thread = threading.Thread(target=self._run, name="cpu-speed-monitor", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *exc_info: object) -> None:
        assert self._thread is not None
        self._is_over.set()
        self._thread.join()

    @property
    def slowness(self) -> float:
        """Median time of the loop in the last `with` block, relative to the shortest time ever."""
        samples = tuple(self._samples)
        self._fastest = min(self._fastest, *samples)
        return statistics.median(samples) / self._fastest

    def _run(self) -> None:
        while not self._is_over.wait(_PERIOD):
            self._samples.append(_time_loop())


def _time_loop() -> float:
    """Returns the processor time of the loop, [s], which excludes waiting for a core."""
    start, total = time.thread_time_ns(), 0
    for number in range(_ROUNDS):
        total += number * number
    return 1e-9 * (time.thread_time_ns() - start)
