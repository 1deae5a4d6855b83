"""Ten thousand frames and a hundred thousand datagrams for the controllers of Panda and FR3."""

from __future__ import annotations

import pytest

from tests.peers.arena import PLANTS
from tests.peers.franka import fuzz
from tests.peers.franka.wire import VERSIONS

pytestmark = [pytest.mark.endurance, pytest.mark.parametrize("version", VERSIONS)]


@pytest.mark.parametrize("plant", PLANTS)
def test_the_next_client_works_after_ten_thousand_fuzzed_frames(version: int, plant: str) -> None:
    fuzz.fuzz_frames(version, plant, 10_000, 100 + version)


def test_a_hundred_thousand_fuzzed_datagrams_change_nothing(version: int) -> None:
    fuzz.fuzz_datagrams(version, 100_000, 200 + version)
