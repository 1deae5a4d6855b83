"""Ten minutes of four controllers on one machine, each driven by a client library of its own at the same time."""

from __future__ import annotations

import pytest

from rcilab.diagnostics.bench.four_makers import drive_together
from tests.peers.endurance import GROWTH

pytestmark = pytest.mark.endurance

SECONDS, WARM_UP = 600.0, 60.0  # [s]


def test_ten_minutes_of_four_makers_lose_nothing_and_leave_memory_flat() -> None:
    for library in ("pylibfranka", "xarm", "Robotic_Arm"):
        pytest.importorskip(library)
    found = drive_together(SECONDS, WARM_UP)
    assert {arm.name: arm.lost for arm in found} == {arm.name: 0 for arm in found}
    for arm in found:
        assert arm.motions > SECONDS / 10.0
        assert arm.growth < GROWTH, f"the controller of the {arm.name} grew by {arm.growth} bytes"
