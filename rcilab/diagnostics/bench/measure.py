"""A measurement: a named number and its target, or the reason why it is missing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

Unit = Literal["us", "ms", "s"]
UNIT_SECONDS: dict[Unit, float] = {"us": 1e-6, "ms": 1e-3, "s": 1.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """What one bench found."""

    name: str
    median: float
    p99: float
    unit: Unit
    target: float | None
    """What we promise, in `unit`; None when nothing is promised."""
    ok: bool | None
    """Whether the promise is kept; None when nothing is promised."""
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """Returns the entry that `rcilab bench --json` prints."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Absent:
    """A row without a number."""

    name: str
    note: str
    """The reason, and what to do."""
    ok: bool | None = None
    """False when it was tried and failed; None when it cannot be tried here."""

    def as_json(self) -> dict[str, Any]:
        """Returns an entry with the keys of a `Measurement`, its figures null."""
        return dict.fromkeys(("name", "median", "p99", "unit", "target", "ok")) | asdict(self)


def summarise(name: str, seconds: ArrayLike, unit: Unit, target: float | None, note: str = "") -> Measurement:
    """Returns the median and 99th percentile of measured times; the promise is about the median.

    Args:
        name: Name of the bench.
        seconds: Measured times, [s].
        unit: Unit to report in.
        target: Largest median, in `unit`.
        note: What else the reader should know.
    """
    values = np.asarray(seconds, dtype=np.float64) / UNIT_SECONDS[unit]
    median, p99 = float(np.median(values)), float(np.percentile(values, 99))
    return Measurement(
        name=name, median=median, p99=p99, unit=unit, target=target, ok=None if target is None else median <= target,
        note=note,
    )  # fmt: skip


def time_calls(call: Callable[[Any], object], arguments: Sequence[object], *, warm_up: int = 5) -> list[float]:
    """Returns the time of each call, [s], one a given argument, after a few that do not count."""
    for argument in arguments[:warm_up]:
        call(argument)
    times: list[float] = []
    for argument in arguments:
        start = time.perf_counter_ns()
        call(argument)
        times.append((time.perf_counter_ns() - start) * 1e-9)
    return times


def cost_by_length(call: Callable[[Any], object], cases: Iterable[tuple[float, Sequence[object]]]) -> str:
    """Returns as text how the cost of a call grows with the length of the motion that it plans or checks.

    Args:
        call: What to time.
        cases: For each length, [s], arguments to call with, once each; the median counts.
    """
    costs = [
        f"{plain(length)} s {plain(1e3 * float(np.median(time_calls(call, arguments, warm_up=0))))} ms"
        for length, arguments in cases
    ]
    return f"by length of the motion: {', '.join(costs)}"


def plain(value: float) -> str:
    """Returns a number to three digits and without an exponent, as a person reads it."""
    return f"{value:.0f}" if abs(value) >= 999.5 else f"{value:.3g}"
