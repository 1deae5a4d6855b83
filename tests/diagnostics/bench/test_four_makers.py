from __future__ import annotations

import pytest

from rcilab.diagnostics.bench import four_makers
from rcilab.diagnostics.bench.four_makers import ARMS, bench_four_makers, drive_together
from rcilab.diagnostics.bench.measure import Absent


def test_four_makers_are_driven_at_the_same_time() -> None:
    """The short version of `tests/endurance`, which also asks for memory and lost cycles."""
    for library in ("pylibfranka", "xarm", "Robotic_Arm"):
        pytest.importorskip(library)
    found = drive_together(3.0, warm_up=1.5)
    assert [arm.name for arm in found] == list(ARMS)
    for arm in found:
        assert arm.motions > 0
        assert arm.cpu > 0.0


def test_the_row_says_which_extra_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(four_makers, "_LIBRARIES", {"no_such_library": "xarm"})
    found = bench_four_makers()
    assert isinstance(found, Absent)
    assert found.note == "this row needs no_such_library, which is not installed: pip install 'rcilab[xarm]'"
