"""The time law of a path: its bounds, whatever happens along it."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.sim.planner.path_time_law import PathTimeLaw, Stretch


@pytest.mark.parametrize("seed", range(20))
def test_a_time_law_keeps_the_bounds_of_every_stretch(seed: int) -> None:
    random = np.random.default_rng(seed)
    ends = np.cumsum(random.uniform(0.002, 0.2, 8))
    stretches = [
        Stretch(float(end), float(random.uniform(0.02, 0.5)), float(random.uniform(0.5, 3.0)), 20.0) for end in ends
    ]
    time_law = PathTimeLaw()
    time_law.set_stretches(stretches[:3])
    rows = [(0.0, 0.0, 0.0)]
    while not time_law.is_at_end:
        if len(rows) == 40:
            time_law.set_stretches([s for s in stretches if s.end > time_law.s])
        time_law.step()
        rows.append((time_law.s, time_law.ds, time_law.dds))
        assert len(rows) < 100_000
    s, ds, dds = np.array(rows).T
    assert (np.diff(s) >= 0.0).all(), "it never goes back"
    assert s[-1] == pytest.approx(ends[-1 if len(rows) > 40 else 2], abs=1e-12)
    k = np.minimum(np.searchsorted(ends, s, side="left"), len(ends) - 1)
    before = np.maximum(k - 1, 0)
    velocity = np.array([x.velocity for x in stretches])
    acceleration = np.array([x.acceleration for x in stretches])
    assert (ds <= np.maximum(velocity[k], velocity[before]) * (1.0 + 1e-9)).all()
    inside = (s - np.concatenate(([0.0], ends))[k]) > 1e-3
    assert (ds[inside] <= velocity[k][inside] * (1.0 + 1e-6)).all()
    assert (np.abs(dds) <= np.maximum(acceleration[k], acceleration[before]) * (1.0 + 1e-9)).all()
    assert (np.abs(np.diff(dds)) <= 20.0 * 1e-3 * (1.0 + 1e-6)).all()


@pytest.mark.parametrize("seed", range(20))
def test_pauses_and_overrides_at_any_time_keep_bounds_and_end(seed: int) -> None:
    random = np.random.default_rng(seed)
    ends = np.cumsum(10.0 ** random.uniform(-3.0, -0.5, 6))
    stretches = [
        Stretch(float(end), float(10.0 ** random.uniform(-1.5, 0.0)), float(10.0 ** random.uniform(0.0, 1.0)), 30.0)
        for end in ends
    ]
    time_law = PathTimeLaw()
    time_law.set_stretches(stretches)
    rows = [(0.0, 0.0, 0.0)]
    while not time_law.is_at_end:
        action = random.random()
        if action < 0.004:
            time_law.pause()
        elif action < 0.012:
            time_law.resume()
        elif action < 0.017:
            time_law.set_override(float(random.choice([0.1, 0.5, 1.0])))
        time_law.step()
        rows.append((time_law.s, time_law.ds, time_law.dds))
        assert len(rows) < 200_000
    s, ds, dds = np.array(rows).T
    assert s.max() == pytest.approx(ends[-1], abs=1e-7)
    assert np.diff(s).min() > -1e-4  # A pause at the begin of a stretch with a smaller acceleration may swing back.
    assert ds.max() <= max(x.velocity for x in stretches) * (1.0 + 1e-6)
    assert np.abs(dds).max() <= max(x.acceleration for x in stretches) * (1.0 + 1e-6)
    assert np.abs(np.diff(dds)).max() <= 30.0 * 1e-3 * (1.0 + 1e-6)
