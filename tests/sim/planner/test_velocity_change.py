"""How far changes of a velocity go, compared with the profiles themselves."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.motion import _ruckig
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
