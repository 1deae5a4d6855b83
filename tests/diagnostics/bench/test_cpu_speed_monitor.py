"""How fast the machine is while something is measured."""

from __future__ import annotations

import pytest

from rcilab.cli.bench import _with_slowdown
from rcilab.diagnostics.bench import cpu_speed_monitor as pace_watch


@pytest.fixture
def takes(monkeypatch):
    """What the fixed piece of Python takes from now on, [s]."""
    now = [0.001]
    monkeypatch.setattr(pace_watch, "_time_loop", lambda: now[0])
    monkeypatch.setattr(pace_watch, "_PERIOD", 0.001)
    return now


def watch(pace):
    """Measures something that takes three samples."""
    with pace:
        while len(pace._samples) < 4:
            pass


def test_a_slow_phase_is_seen_and_said_beside_the_row_and_the_best_is_remembered(takes):
    pace = pace_watch.CpuSpeedMonitor()
    watch(pace)
    assert pace.slowness == 1.0
    assert _with_slowdown("a note", pace) == "a note"
    takes[0] = 0.0017
    watch(pace)
    assert pace.slowness == pytest.approx(1.7)
    word = "during this measurement the machine took 1.7 times as long for the same Python as at its best"
    assert (_with_slowdown("a note", pace), _with_slowdown("", pace)) == (f"a note; {word}", word)
    takes[0] = 0.0005
    watch(pace)
    assert pace.slowness == 1.0
    takes[0] = 0.001
    watch(pace)
    assert pace.slowness == pytest.approx(2.0)


def test_the_fixed_piece_takes_processor_time():
    assert 0.0 < pace_watch._time_loop() < 1.0
