"""Each mode does today what it did when its golden log was written. `python -m tests.peers.golden` writes them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.peers import golden

TOLERANCE = 1e-9  # Of what is large for a field; processors differ in the last digits only.


@pytest.mark.parametrize("name", golden.RUNS)
def test_a_run_is_its_golden_log(name: str) -> None:
    found, expected = golden.record(name), golden.load(name)
    worst = golden.difference(found, expected)
    assert max(worst.values()) < TOLERANCE, worst


@pytest.mark.parametrize("name", golden.RUNS)
def test_a_golden_log_is_a_motion(name: str) -> None:
    log = golden.load(name)
    assert np.ptp(log["q"], axis=0).max() > 1e-3
    assert all(np.isfinite(values).all() for values in log.values())


def test_golden_logs_stay_small() -> None:
    assert sum(path.stat().st_size for path in golden.FOLDER.iterdir()) < 200_000
