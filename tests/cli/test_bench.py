from __future__ import annotations

import json
from importlib import import_module

import numpy as np
import pytest

from rcilab.cli import main
from rcilab.cli.bench import BENCHES
from rcilab.diagnostics.bench.franka import summarise_period
from rcilab.diagnostics.bench.rows import ROWS

KEYS = {"name", "median", "p99", "unit", "target", "ok", "note"}


def test_an_unknown_bench_is_refused_with_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "forward", "speed_of_light"]) == 2
    said = capsys.readouterr().err
    assert "unknown bench 'speed_of_light'" in said
    assert all(name in said for name in BENCHES)


@pytest.mark.parametrize("name", BENCHES)
def test_every_row_has_its_function(name: str) -> None:
    assert callable(getattr(import_module(f"rcilab.diagnostics.bench.{ROWS[name]}"), f"bench_{name}"))


@pytest.mark.parametrize("seconds", ["0", "-3", "nan", "1e9"])
def test_a_streaming_time_that_is_none_is_refused(seconds: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "control_loop", "--seconds", seconds]) == 2
    assert "0.5 to 600 s" in capsys.readouterr().err


def test_json_is_one_list_with_the_machine_first(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["bench", "inverse", "forward", "feasible_arcs", "inverse_batch", "--json"])
    machine, *found = json.loads(capsys.readouterr().out)
    assert machine["name"] == "machine"
    assert {"cpu", "cores", "kernel", "python", "sched_fifo", "versions"} <= machine.keys()
    assert [bench["name"] for bench in found] == ["forward", "inverse", "inverse_batch", "feasible_arcs"]
    for bench in found:
        assert bench.keys() == KEYS
        assert 0.0 < bench["median"] <= bench["p99"]
        assert bench["ok"] is (bench["median"] <= bench["target"])
    assert "WITHOUT A SOLUTION" not in found[1]["note"]
    assert code == (0 if all(bench["ok"] for bench in found) else 1)


def test_the_table_names_machine_median_and_target(capsys: pytest.CaptureFixture[str]) -> None:
    main(["bench", "forward"])
    printed = capsys.readouterr().out
    assert "cores" in printed.splitlines()[0]
    assert "SCHED_FIFO" in printed.splitlines()[0]
    (row,) = [line for line in printed.splitlines() if "forward  " in line]
    assert row.split()[-1] == "us"
    assert row.split()[-2] == "10"


@pytest.mark.realtime
def test_the_loop_streams_and_reports_every_figure(capsys: pytest.CaptureFixture[str]) -> None:
    """Only that it runs and reports: how late this machine is on this day is no verdict on the code."""
    main(["bench", "control_loop", "--seconds", "0.5", "--json"])
    _, found = json.loads(capsys.readouterr().out)
    assert found["name"] == "control_loop"
    for figure in ("p50", "p99", "p99.9", "max", "late by more than 1 ms", "lost", "success rate"):
        assert figure in found["note"]


@pytest.mark.parametrize(
    ("mean", "latest", "is_ok"), [(1e-3, 1.05e-3, True), (1.002e-3, 1.05e-3, False), (1e-3, 1.2e-3, False)]
)
def test_the_period_of_an_fr3_has_targets_for_its_mean_and_its_latest_states(
    mean: float, latest: float, is_ok: bool
) -> None:
    periods = np.full(10_000, mean)
    periods[::500], periods[1::500] = latest, 2.0 * mean - latest
    found = summarise_period(periods, "a note")
    assert (found.target, found.ok) == (1000.0, is_ok)
    assert found.note.endswith("while moving; a note")
