from __future__ import annotations

import sys

import numpy as np
import pytest

from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.doctor import jitter
from rcilab.diagnostics.doctor.system import System

PUNCTUAL = np.full(10_000, 60e-6)


def late_once(by: float) -> np.ndarray:
    late = PUNCTUAL.copy()
    late[1234] = by
    return late


def test_every_cycle_is_measured_and_progress_is_told_each_second() -> None:
    told: list[tuple[float, float]] = []
    late = jitter.measure_jitter(1.2, lambda spent, worst: told.append((spent, worst)))
    assert late.shape == (1200,)
    assert (late > 0.0).mean() > 0.99  # Nobody wakes up before the time; a clock that is read late is no exception.
    assert [spent for spent, _ in told] == pytest.approx([1.0, 1.2])
    assert told[-1][1] == late.max()


@pytest.mark.parametrize(
    ("longest", "is_for_real", "verdict"),
    [(9e-4, True, "ok"), (2e-3, True, "note"), (12e-3, False, "note"), (12e-3, True, "bad")],
)
def test_a_pause_is_judged_by_what_it_does_to_an_arm(longest: float, is_for_real: bool, verdict: str) -> None:
    finding = jitter.evaluate_jitter(late_once(longest), 0.0, is_for_real=is_for_real)
    assert finding.verdict == verdict
    assert finding.figures["max_us"] == pytest.approx(1e6 * longest)
    assert finding.figures["late_cycles"] == (verdict != "ok")
    assert ("can stop a real arm" in finding.advice) is (longest > 10e-3)


def test_what_the_hypervisor_took_is_not_laid_at_our_door() -> None:
    finding = jitter.evaluate_jitter(late_once(2e-3), 0.31)
    assert "the hypervisor took 0.31 s" in finding.value
    assert "hypervisor" in finding.advice
    assert finding.figures["stolen_s"] == 0.31


def test_the_figures_are_those_of_the_cycles() -> None:
    finding = jitter.evaluate_jitter(np.arange(1.0, 1001.0) * 1e-6, None)
    assert finding.figures["median_us"] == pytest.approx(500.5)
    assert finding.figures["p99_us"] == pytest.approx(990.01)
    assert finding.figures["late_cycles"] == 0
    assert "stolen_s" not in finding.figures


def test_a_loop_that_dies_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(DeadlineError, match="ended after 0 of 500 cycles"):
        jitter.measure_jitter(0.5, lambda spent, worst: None)
    assert jitter.check_jitter(0.5, System(), lambda spent, worst: None).verdict == "bad"
