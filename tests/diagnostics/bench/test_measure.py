from __future__ import annotations

import re

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.diagnostics.bench.compute import motion_of
from rcilab.diagnostics.bench.measure import cost_by_length, plain, summarise, summarise_rate, time_calls
from rcilab.model.robot_model import load_model


@pytest.mark.parametrize(("unit", "factor"), [("us", 1e6), ("ms", 1e3), ("s", 1.0)])
def test_times_are_reported_in_the_unit_that_is_named(unit: str, factor: float) -> None:
    found = summarise("x", [0.001, 0.002, 0.003], unit, None)  # type: ignore[arg-type]
    assert found.median == pytest.approx(0.002 * factor)
    assert found.ok is None


@pytest.mark.parametrize(("target", "ok"), [(2.0, True), (1.9, False)])
def test_the_promise_is_about_the_median(target: float, ok: bool) -> None:
    assert summarise("x", [0.001, 0.002, 0.9], "ms", target).ok is ok


def test_the_99th_percentile_is_not_the_largest() -> None:
    times = np.arange(1, 1001) / 1e6
    assert summarise("x", times, "us", None).p99 == pytest.approx(990.0, abs=0.1)


def test_every_argument_is_timed_once_after_the_warm_up() -> None:
    called: list[object] = []
    times = time_calls(called.append, [1, 2, 3], warm_up=2)
    assert called == [1, 2, 1, 2, 3]
    assert len(times) == 3
    assert min(times) > 0.0


@pytest.mark.parametrize(("target", "ok"), [(4.0, True), (4.1, False)])
def test_a_rate_is_how_much_faster_than_real_time_its_cycles_are(target: float, ok: bool) -> None:
    found = summarise_rate("x", [250e-6] * 99 + [500e-6] * 2, target)
    assert (found.median, found.p99, found.unit) == (pytest.approx(4.0), pytest.approx(2.0), "times real time")
    assert found.ok is ok


@pytest.mark.parametrize("duration", [0.8, 3.0, 10.0, 30.0])
def test_a_motion_to_stream_takes_as_long_as_asked_and_conforms(duration: float) -> None:
    model = load_model("xMatePro7")
    motion = motion_of(model, duration, model.home)
    assert motion.duration == pytest.approx(duration, rel=0.25)
    assert check(motion, model).ok


def test_a_motion_from_the_far_end_leads_back_home() -> None:
    model = load_model("xMatePro7")
    there = motion_of(model, 6.0, model.home)
    back = motion_of(model, 6.0, there.goal)
    assert back.goal == pytest.approx(model.home)
    assert back.duration == pytest.approx(there.duration)
    assert check(back, model).ok


def test_the_cost_by_length_names_every_length_beside_the_median_of_its_calls() -> None:
    called: list[object] = []
    words = cost_by_length(called.append, [(1.0, ["a"]), (97.16, ["b", "c", "d"])])
    assert called == ["a", "b", "c", "d"]
    assert re.fullmatch(r"by length of the motion: 1 s [\d.e-]+ ms, 97\.2 s [\d.e-]+ ms", words)


@pytest.mark.parametrize(("value", "words"), [(0.0123, "0.0123"), (7.0, "7"), (999.6, "1000"), (123456.7, "123457")])
def test_a_large_number_is_written_without_an_exponent(value: float, words: str) -> None:
    assert plain(value) == words
