"""How far changes of a velocity go, compared with the profiles themselves."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.motion import _ruckig
from rcilab.sim.planner.path_law import PathLaw, Stretch
from rcilab.sim.planner.velocity_change import change_distance, fastest_after, fastest_before, slowest_after

A, J = 2.0, 15.0


@pytest.mark.parametrize("seed", range(20))
def test_a_change_goes_as_far_as_its_profile(seed: int) -> None:
    random = np.random.default_rng(seed)
    v, w, a = float(random.uniform(0.0, 1.0)), float(random.uniform(0.0, 1.0)), float(random.uniform(-A, A))
    # Standstill is the change to velocity zero of the motion relative to a frame that moves with w.
    curve = _ruckig.plan_standstill(np.zeros(1), np.array([v - w]), np.array([a]), np.array([A]), np.array([J]))
    distance = float(curve.at_end()[0][0]) + w * curve.duration
    assert change_distance(v, a, w, A, J) == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_the_extreme_velocities_take_exactly_the_distance(seed: int) -> None:
    random = np.random.default_rng(seed)
    w, distance = float(random.uniform(0.0, 0.5)), float(random.uniform(1e-4, 0.5))
    fastest = fastest_before(w, distance, A, J)
    assert change_distance(fastest, 0.0, w, A, J) == pytest.approx(distance, rel=1e-9)
    assert change_distance(w, 0.0, fastest, A, J) == pytest.approx(distance, rel=1e-9)
    assert fastest_after(w, 0.0, distance, 100.0, A, J) == pytest.approx(fastest, rel=1e-9)
    slowest = slowest_after(fastest, 0.0, 0.5 * distance, w, A, J)
    assert w < slowest < fastest
    assert change_distance(fastest, 0.0, slowest, A, J) == pytest.approx(0.5 * distance, rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_a_law_keeps_the_bounds_of_every_stretch(seed: int) -> None:
    random = np.random.default_rng(seed)
    ends = np.cumsum(random.uniform(0.002, 0.2, 8))
    stretches = [
        Stretch(float(end), float(random.uniform(0.02, 0.5)), float(random.uniform(0.5, 3.0)), 20.0) for end in ends
    ]
    law = PathLaw()
    law.set_stretches(stretches[:3])
    rows = [(0.0, 0.0, 0.0)]
    while not law.is_at_end:
        if len(rows) == 40:
            law.set_stretches([s for s in stretches if s.end > law.s])
        law.step()
        rows.append((law.s, law.ds, law.dds))
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
