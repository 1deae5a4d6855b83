"""The short versions of what `tests/endurance` runs for long."""

from __future__ import annotations

import pytest

from tests.peers.arena import PLANTS
from tests.peers.franka import fuzz
from tests.peers.franka.wire import VERSIONS


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("version", VERSIONS)
def test_the_next_client_works_after_fuzzed_frames(version: int, plant: str) -> None:
    fuzz.fuzz_frames(version, plant, 400, 11)


@pytest.mark.parametrize("version", VERSIONS)
def test_fuzzed_datagrams_change_nothing(version: int) -> None:
    fuzz.fuzz_datagrams(version, 5_000, 13)
