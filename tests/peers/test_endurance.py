"""The short versions of what `tests/endurance` runs for long."""

from __future__ import annotations

import pytest

from tests.peers import endurance
from tests.peers.arena import PLANTS


@pytest.mark.parametrize("plant", PLANTS)
def test_streaming_loses_nothing_and_leaves_memory_flat(plant: str) -> None:
    endurance.stream(plant, 3.0, lockstep=True)


@pytest.mark.parametrize("plant", PLANTS)
def test_motion_after_motion_leaves_no_trace(plant: str) -> None:
    endurance.run_motions(plant, 40)


def test_fuzzed_frames_do_not_end_the_command() -> None:
    endurance.fuzz_frames(500, 11)


def test_the_next_client_works_after_fuzzed_frames() -> None:
    endurance.fuzz_frames_then_work(100, 12)


def test_fuzzed_datagrams_change_nothing() -> None:
    endurance.fuzz_datagrams(10_000, 13)
