"""Others beside us: rows for those who are here, advice for those who are not, and honest marks."""

from __future__ import annotations

import json
import math
import tomllib
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.cli import main
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.compare import comparison, peer, timing
from rcilab.diagnostics.bench.compare.inverse import Tally, compare_inverse, pose_errors
from rcilab.diagnostics.bench.compare.peer import absent
from rcilab.diagnostics.bench.cpu_speed_monitor import CpuSpeedMonitor
from rcilab.diagnostics.bench.measure import Absent, Measurement
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")
PEERS = {"ssik": "ssik", "pink": "pink", "toppra": "toppra"}


def rows(found):
    return {row.name: row for row in found}


def test_everybody_has_a_row_and_those_who_are_missing_say_what_to_install():
    found = rows(compare_inverse(MODEL, 12)) | rows(timing.compare_timing(MODEL, 1))
    tasks = [f"{task}/{who}" for task in ("home", "near") for who in ("rcilab", "ssik", "pinocchio", "pink")]
    assert list(found) == [*tasks, "branches/rcilab", "branches/ssik", "branches/batch", "line/rcilab", "line/toppra"]
    for name, row in found.items():
        package = PEERS.get(name.partition("/")[2])
        if package is not None and find_spec(package) is None:
            assert isinstance(row, Absent)
            assert "pip install" in row.note
        else:
            assert isinstance(row, Measurement)
            assert 0.0 < row.median <= row.p99
    for task in ("home", "near", "branches"):
        assert "12 of 12 solved" in found[f"{task}/rcilab"].note
    assert "CLIK" in found["home/pinocchio"].note


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-12, 1e-6, 1e-3, 1.0, 3.14]))
def test_errors_are_the_distance_and_the_angle_between_poses(seed, turn):
    random = np.random.default_rng(seed)
    T = MODEL.forward(random.uniform(-3, 3, 7))
    axis, shift = random.normal(size=3), turn * random.normal(size=3)
    about = Pose((0.0, 0.0, 0.0), (math.cos(turn / 2), *(math.sin(turn / 2) * axis / np.linalg.norm(axis))))
    moved = Pose(T.position + shift, T.wxyz) @ about
    position, rotation = pose_errors(moved.matrix[np.newaxis], T.matrix)
    assert position[0] == pytest.approx(np.linalg.norm(shift), abs=1e-12)
    assert rotation[0] == pytest.approx(turn, abs=1e-9)


def test_only_answers_that_reach_the_pose_inside_the_limits_count():
    q, tally = MODEL.home, Tally()
    T = MODEL.forward(q).matrix
    beyond, astray = q + [0, 0, 0, 0, 0, 0, 4 * math.tau], q + 0.01
    tally.score(MODEL, T, [])
    tally.score(MODEL, T, [astray])
    tally.score(MODEL, T, [beyond])
    assert (tally.solved, tally.outside, tally.answers) == (0, 1, 2)
    tally.score(MODEL, T, [beyond, astray, q])
    assert (tally.solved, tally.outside, tally.answers) == (1, 1, 5)
    assert max(tally.position_error, tally.rotation_error) < 1e-12


def test_what_is_no_peers_package_is_no_reason_to_skip_a_row():
    with pytest.raises(ModuleNotFoundError, match="numpy_of_tomorrow"):
        absent("home/pink", ModuleNotFoundError("no numpy_of_tomorrow", name="numpy_of_tomorrow"))
    assert absent("home/ssik", ModuleNotFoundError(name="ssik.cli")).note.startswith("not installed: pip install 'ssik")


def test_peers_are_an_extra_of_their_own_and_nothing_that_rcilab_or_its_tests_need():
    text = (Path(__file__).parents[4] / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    extras = project["optional-dependencies"]
    needed = {word.strip("'") for advice in peer._REQUIREMENTS.values() for word in advice.split()}
    assert {line.partition(">")[0] for line in extras["compare"]} == needed
    others = [*project["dependencies"], *extras["test"], *extras["lab"]]
    assert not [line for line in others if line.partition(">")[0] in needed]


def test_the_command_prints_rows_for_all_and_nulls_for_the_absent(monkeypatch, capsys):
    missing = Absent(name="home/ssik", note="not installed: pip install x")
    here = Measurement(name="home/rcilab", median=1.0, p99=2.0, unit="us", target=None, ok=None, note="ours")

    def compare():
        print("a library talks")
        yield here
        yield missing

    monkeypatch.setattr(comparison, "compare", compare)
    monkeypatch.setattr(CpuSpeedMonitor, "slowness", 1.0)  # A busy machine adds a word to each note.
    assert main(["bench", "compare", "--json"]) == 0
    machine, first, second = json.loads(capsys.readouterr().out)
    assert machine["name"] == "machine"
    assert first.keys() == second.keys()
    assert (first["median"], second["median"], second["note"]) == (1.0, None, missing.note)
    assert main(["bench", "compare"]) == 0
    printed = capsys.readouterr().out
    assert "a library talks" not in printed
    assert "pip install x" in printed


def test_comparing_is_no_part_of_the_benches_that_run_by_default():
    from rcilab.cli.bench import BENCHES, COMPARE

    assert COMPARE not in BENCHES
