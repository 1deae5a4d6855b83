"""Measurement of the jitter of a 1 kHz loop on this machine.

`python -m rcilab.diagnostics.doctor.jitter SECONDS` is that loop.

It only wakes up, with the priority of the control process and on cores that do not sleep, so that its lateness is that
of the machine. Once per second it prints the lateness of that second's cycles, [ns], as one JSON list.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.processor import read_ticks
from rcilab.diagnostics.doctor.system import System
from rcilab.realtime.cpu_latency import awake_cores
from rcilab.realtime.scheduling import PRIORITY, enter_realtime

_STOPPING_PAUSE = 0.010  # [s] Ten cycles: the smallest number of lost commands for which a motion may be stopped.
_CYCLES_PER_LINE = 1000


def check_jitter(
    seconds: float, system: System, progress: Callable[[float, float], None], *, is_for_real: bool = False
) -> Finding:
    """Does an empty loop wake up in time?

    Args:
        seconds: Duration of the measurement, [s].
        system: Reports the time taken by the hypervisor.
        is_for_real: Whether this machine is to control a real arm, which does not wait for a stalled machine.
        progress: Called about once per second with the elapsed time and the largest lateness so far, [s].
    """
    before = read_ticks(system)
    try:
        late = measure_jitter(seconds, progress)
    except DeadlineError as error:
        return Finding("jitter", "bad", str(error), "python -m rcilab.diagnostics.doctor.jitter 2 shows why")
    after = read_ticks(system)
    stolen = (after[0] - before[0]) / 100.0 if before and after else None
    return evaluate_jitter(late, stolen, is_for_real=is_for_real)


def measure_jitter(seconds: float, progress: Callable[[float, float], None]) -> Array:
    """Returns the lateness of each cycle of an empty 1 kHz loop in a separate process, shape (cycles,), [s].

    Raises:
        DeadlineError: The loop ended before its time.
    """
    rows: list[Array] = []
    worst = 0.0
    loop = subprocess.Popen(
        [sys.executable, "-P", "-m", "rcilab.diagnostics.doctor.jitter", repr(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,  # Ctrl-C does not reach the loop, which is ended below.
    )
    with loop:
        assert loop.stdout is not None
        try:
            for line in loop.stdout:
                rows.append(1e-9 * np.array(json.loads(line), dtype=np.float64))
                worst = max(worst, float(rows[-1].max()))
                progress(CYCLE_TIME * sum(map(len, rows)), worst)
        finally:
            loop.kill()
    late = np.concatenate([np.empty(0), *rows])
    expected = _cycles(seconds)
    if len(late) < expected:
        raise DeadlineError(f"the measuring loop ended after {len(late)} of {expected} cycles")
    return readonly_copy(late)


def evaluate_jitter(late: Array, stolen: float | None, *, is_for_real: bool = False) -> Finding:
    """Evaluates the lateness of cycles for a control loop.

    Args:
        late: Lateness per cycle, shape (cycles,), [s].
        stolen: Time for which the hypervisor took the cores during the measurement, sum over all, [s]; None: unknown.
        is_for_real: Whether this machine is to control a real arm.
    """
    median, p99, p999, worst = (1e6 * float(np.percentile(late, part)) for part in (50, 99, 99.9, 100))
    missed = int((late > CYCLE_TIME).sum())
    figures = {
        "seconds": CYCLE_TIME * len(late), "median_us": median, "p99_us": p99, "p99.9_us": p999, "max_us": worst,
        "late_cycles": float(missed), **({} if stolen is None else {"stolen_s": stolen}),
    }  # fmt: skip
    found = (
        f"over {CYCLE_TIME * len(late):g} s median {median:.0f} us, p99 {p99:.0f} us, p99.9 {p999:.0f} us, longest "
        f"{worst:.0f} us; {missed} of {len(late)} cycles late by more than 1 ms"
    )
    if stolen:
        found += f"; the hypervisor took {stolen:.2f} s"
    if not missed:
        return Finding("jitter", "ok", found, figures=figures)
    advice = "close other programs, and apply the remedies above"
    if stolen:
        advice += "; only the owner of a hypervisor can change its share: use a dedicated machine"
    if worst * 1e-6 >= _STOPPING_PAUSE:
        advice = f"a pause of {1e3 * _STOPPING_PAUSE:g} ms can stop a real arm's motion: {advice}"
        return Finding("jitter", "bad" if is_for_real else "note", found, advice, figures)
    return Finding("jitter", "note", found, advice, figures)


def _cycles(seconds: float) -> int:
    return max(1, round(seconds / CYCLE_TIME))


def _run(seconds: float) -> None:
    left = _cycles(seconds)
    enter_realtime(PRIORITY)
    deadline = time.monotonic_ns()
    while left:
        late = [0] * min(left, _CYCLES_PER_LINE)
        for cycle in range(len(late)):
            deadline += round(1e9 * CYCLE_TIME)
            remaining = deadline - time.monotonic_ns()
            if remaining > 0:
                time.sleep(1e-9 * remaining)
            late[cycle] = time.monotonic_ns() - deadline
        left -= len(late)
        print(json.dumps(late), flush=True)


if __name__ == "__main__":
    with awake_cores():
        _run(float(sys.argv[1]))
