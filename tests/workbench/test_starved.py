"""Bad luck in short; the long versions are in tests/endurance."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rcilab.app.autosave import Autosave
from rcilab.recording.folder import keep_newest, stored_runs
from tests.workbench import starved
from tests.workbench.test_autosave import MODEL, state_with_all

PLANTS = ("ideal", "mujoco")


def test_motions_with_a_page_leave_memory_flat() -> None:
    starved.stream_with_a_page("ideal", 18.0, 10.0)


def test_processes_that_stood_still_leave_an_arm_at_rest_and_work_goes_on() -> None:
    starved.stop_everything("ideal", 3.0)


def test_a_page_that_never_reads_costs_little() -> None:
    starved.open_and_never_read("ideal", 5.0)


def test_an_upload_that_is_too_large_is_dropped_as_it_comes() -> None:
    starved.upload("ideal", 50)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can mount a small disk")
def test_a_full_disk_loses_the_recording_and_not_the_motion(tmp_path: Path) -> None:
    starved.fill_the_disk("ideal", tmp_path)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_clock_that_jumps_moves_no_arm_otherwise(plant: str, tmp_path: Path) -> None:
    starved.jump_the_clock(plant, 3, tmp_path)


def test_links_in_the_folder_of_runs_and_of_what_is_kept_lead_nowhere(tmp_path: Path) -> None:
    other, runs = tmp_path / "other.txt", tmp_path / "runs"
    other.write_text("mine")
    runs.mkdir()
    (runs / "a.rcirun").symlink_to(other)
    (runs / "b.rcirun").symlink_to(runs / "b.rcirun")
    (runs / "c.rcirun").symlink_to(tmp_path)
    (runs / "d.rcirun").write_bytes(b"x")
    assert stored_runs(runs).count == 1
    assert keep_newest(runs, 0).count == 1
    assert other.read_text() == "mine"
    assert len(list(runs.iterdir())) == 3
    kept = tmp_path / "kept.json"
    kept.symlink_to(other)
    Autosave(kept).keep(state_with_all())
    assert Autosave(kept).recall(MODEL) is not None
    assert other.read_text() == "mine" or kept.is_symlink()
