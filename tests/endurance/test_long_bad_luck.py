"""Half an hour of motions with a page, and bad luck of all sorts, on both plants."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.workbench import starved

pytestmark = [pytest.mark.endurance, pytest.mark.parametrize("plant", ["ideal", "mujoco"])]


def test_half_an_hour_of_motions_with_a_page_leaves_memory_flat(plant: str) -> None:
    starved.stream_with_a_page(plant, 1800.0, 60.0)


def test_processes_that_stood_still_for_ten_seconds(plant: str) -> None:
    starved.stop_everything(plant, 10.0)


def test_a_page_that_never_reads_for_a_minute(plant: str) -> None:
    starved.open_and_never_read(plant, 60.0)


def test_an_upload_of_50_mb(plant: str) -> None:
    starved.upload(plant, 50)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can mount a small disk")
def test_a_full_disk(plant: str, tmp_path: Path) -> None:
    starved.fill_the_disk(plant, tmp_path)


def test_a_clock_that_jumps(plant: str, tmp_path: Path) -> None:
    starved.jump_the_clock(plant, 50, tmp_path)
