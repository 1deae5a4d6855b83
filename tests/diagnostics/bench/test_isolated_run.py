"""A row that hangs, fails or dies says so and takes no other row with it: real processes, scripted."""

from __future__ import annotations

import json
from importlib import import_module

import pytest

from rcilab.cli import main
from rcilab.diagnostics.bench import isolated_run as apart
from rcilab.diagnostics.bench.isolated_run import measure_isolated
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.diagnostics.bench.rows import ROWS

SCRIPT = """
import json, os, sys, time
name, seconds, file = sys.argv[1:]
if name == "forward": time.sleep(600)
if name == "check": sys.exit("Traceback\\nDeadlineError: the browser did not start\\n\\n")
if name == "jog": os._exit(247)
open(file, "w").write(json.dumps(dict(name=name, median=None if name == "drag" else 1.0, p99=2.0, unit="ms",
    target=float(seconds), ok=None if name == "drag" else True, note="as it is")))
"""


@pytest.fixture(autouse=True)
def scripted(monkeypatch):
    monkeypatch.setattr(apart, "_MEASURE", ("-c", SCRIPT))


def test_what_was_found_comes_back_whole():
    found = Measurement(name="inverse", median=1.0, p99=2.0, unit="ms", target=0.1, ok=True, note="as it is")
    assert measure_isolated("inverse", 0.1) == found
    assert measure_isolated("drag", 0.1) == Absent(name="drag", note="as it is")


@pytest.mark.parametrize(
    ("name", "reason"), [("check", "DeadlineError: the browser did not start"), ("jog", "exit code 247")]
)
def test_a_row_that_fails_gives_its_last_word(name, reason):
    assert measure_isolated(name, 0.1) == Absent(name=name, ok=False, note=f"NO NUMBER: {reason}")


def test_a_row_that_hangs_is_ended_and_the_next_one_measured(monkeypatch, capsys):
    monkeypatch.setattr(apart, "_TIMEOUT", 0.5)
    assert main(["bench", "forward", "inverse", "--json", "--seconds", "0.5"]) == 1
    _, hung, found = json.loads(capsys.readouterr().out)
    assert (hung["name"], hung["median"], hung["ok"]) == ("forward", None, False)
    assert "ended after 2 s" in hung["note"]
    assert (found["name"], found["ok"]) == ("inverse", True)


def test_the_table_tells_failed_from_slow(capsys):
    main(["bench", "check"])
    rows = [line.split()[:2] for line in capsys.readouterr().out.splitlines()]
    assert ["FAIL", "check"] in rows


def test_every_row_has_its_function():
    for name, module in ROWS.items():
        assert callable(getattr(import_module(f"rcilab.diagnostics.bench.{module}"), f"bench_{name}"))


def test_a_measurement_survives_its_way_through_json():
    found = summarise("x", [0.1], "ms", 5.0, "a note")
    assert Measurement(**json.loads(json.dumps(found.as_json()))) == found
