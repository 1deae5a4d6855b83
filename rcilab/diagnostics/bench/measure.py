"""A measurement: a named number and its target, or the reason why it is missing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.clock import CYCLE_TIME

Unit = Literal["us", "ms", "s", "times real time"]
UNIT_SECONDS: dict[str, float] = {"us": 1e-6, "ms": 1e-3, "s": 1.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """Result of one benchmark."""

    name: str
    median: float
    p99: float
    unit: Unit
    target: float | None
    """Target, in `unit`: the largest median, the smallest of a rate, or the mean of a period; None without a target."""
    ok: bool | None
    """Whether the target is met; None without a target."""
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """Returns the entry for `rcilab bench --json`."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Absent:
    """A row without a number."""

    name: str
    note: str
    """Reason and remedy."""
    ok: bool | None = None
    """False if the measurement failed; None if it is not possible on this machine."""

    def as_json(self) -> dict[str, Any]:
        """Returns an entry with the keys of a `Measurement`, its figures null."""
        return dict.fromkeys(("name", "median", "p99", "unit", "target", "ok")) | asdict(self)


def summarise(name: str, seconds: ArrayLike, unit: Unit, target: float | None, note: str = "") -> Measurement:
    """Returns median and 99th percentile of measured times; the target is for the median.

    Args:
        name: Name of the bench.
        seconds: Measured times, [s].
        unit: Unit to report in.
        target: Largest median, in `unit`.
        note: Further facts.
    """
    values = np.asarray(seconds, dtype=np.float64) / UNIT_SECONDS[unit]
    median, p99 = float(np.median(values)), float(np.percentile(values, 99))
    return Measurement(
        name=name, median=median, p99=p99, unit=unit, target=target, ok=None if target is None else median <= target,
        note=note,
    )  # fmt: skip


def summarise_rate(name: str, seconds: ArrayLike, target: float, note: str = "") -> Measurement:
    """Returns how much faster than real time cycles are: the median, and what 99 % of the measurements exceed.

    Args:
        name: Name of the bench.
        seconds: Mean duration of a cycle in each measurement, [s].
        target: Smallest median.
        note: Further facts.
    """
    rates = CYCLE_TIME / np.asarray(seconds, dtype=np.float64)
    median, p99 = float(np.median(rates)), float(np.percentile(rates, 1))
    return Measurement(
        name=name, median=median, p99=p99, unit="times real time", target=target, ok=median >= target, note=note
    )


def time_calls(call: Callable[[Any], object], arguments: Sequence[object], *, warm_up: int = 5) -> list[float]:
    """Returns the time of each call, [s], one per argument, after a few warm-up calls."""
    for argument in arguments[:warm_up]:
        call(argument)
    times: list[float] = []
    for argument in arguments:
        start = time.perf_counter_ns()
        call(argument)
        times.append((time.perf_counter_ns() - start) * 1e-9)
    return times


def cost_by_length(call: Callable[[Any], object], cases: Iterable[tuple[float, Sequence[object]]]) -> str:
    """Returns the cost of a call by the length of the motion that it plans or checks, as text.

    Args:
        call: The call.
        cases: For each length, [s], the arguments of its calls, of which the median is taken.
    """
    costs = [
        f"{plain(length)} s {plain(1e3 * float(np.median(time_calls(call, arguments, warm_up=0))))} ms"
        for length, arguments in cases
    ]
    return f"by length of the motion: {', '.join(costs)}"


def plain(value: float) -> str:
    """Returns a number with three digits and without an exponent."""
    return f"{value:.0f}" if abs(value) >= 999.5 else f"{value:.3g}"
