"""Time laws along a path: against formulas where there are some, and against their own bounds where there are none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.motion.time_law import PathBounds, _least_lines, duration_of, fastest_squares, smooth_law

KNOTS = 400


def straight(length: float, velocity: float, acceleration: float) -> PathBounds:
    return PathBounds(
        first=np.full((KNOTS + 1, 1), length),
        second=np.zeros((KNOTS + 1, 1)),
        velocity=np.array([velocity]),
        acceleration=np.array([acceleration]),
    )


def wavy(seed: int) -> PathBounds:
    """Three rows that are sums of a line and a wave."""
    rng = np.random.default_rng(seed)
    u = np.linspace(0.0, 1.0, KNOTS + 1)[:, np.newaxis]
    slope, size, rate, phase = rng.uniform(-2, 2, 3), rng.uniform(0, 0.5, 3), rng.uniform(1, 9, 3), rng.uniform(0, 6, 3)
    return PathBounds(
        first=slope + size * rate * np.cos(rate * u + phase),
        second=-size * rate**2 * np.sin(rate * u + phase),
        velocity=rng.uniform(0.5, 2.0, 3),
        acceleration=rng.uniform(2.0, 10.0, 3),
    )


@given(st.floats(0.01, 5.0), st.floats(0.1, 3.0), st.floats(0.5, 20.0))
def test_on_a_straight_way_it_is_the_trapezoid(length, velocity, acceleration):
    ramp = velocity / acceleration
    exact = 2.0 * math.sqrt(length / acceleration) if length < ramp * velocity else length / velocity + ramp
    assert duration_of(fastest_squares(straight(length, velocity, acceleration))) == pytest.approx(exact, rel=5e-3)


@given(st.integers(0, 2**32))
def test_every_bound_is_kept_and_one_of_them_is_always_reached(seed):
    bounds = wavy(seed)
    x = fastest_squares(bounds)
    assert x[0] == x[-1] == 0.0
    ddu = np.diff(x) * KNOTS / 2.0
    speed = np.abs(bounds.first) * np.sqrt(x)[:, np.newaxis] / bounds.velocity
    assert speed.max() <= 1.0 + 1e-9
    pull = np.abs(bounds.first[:-1] * ddu[:, np.newaxis] + bounds.second[:-1] * x[:-1, np.newaxis])
    pull = pull / bounds.acceleration
    assert pull.max() <= 1.0 + 1e-6
    used = np.maximum(np.maximum(speed[:-1], speed[1:]).max(axis=1), pull.max(axis=1))
    # Where two rows bound each other nothing else may be reached: there x is on its own ceiling.
    assert np.median(used) > 0.999
    assert (used > 0.9).mean() > 0.9


@given(st.integers(0, 2**32), st.integers(1, 12))
def test_smoothing_keeps_the_ends_and_bounds_the_jerk(seed, cycles):
    squares = fastest_squares(wavy(seed))
    law = smooth_law(squares, cycles)
    assert law.u[0] == law.du[0] == law.ddu[0] == 0.0
    assert law.u[-1] == pytest.approx(1.0, abs=1e-12)
    assert law.du[-1] == pytest.approx(0.0, abs=1e-9)
    assert law.ddu[-1] == pytest.approx(0.0, abs=1e-9)
    assert (np.diff(law.u) > 0.0).all()
    assert len(law.u) - 1 == math.ceil(1000.0 * duration_of(squares) - 1e-9) + cycles
    largest = np.abs(np.diff(squares)).max() * KNOTS / 2.0
    assert np.abs(np.diff(law.ddu)).max() <= 2.0 * largest / cycles * 1.01
    # The share is the exact integral of an acceleration that is straight between the cycles.
    third = np.diff(law.u, 3) / 1e-9
    assert np.abs(third).max() <= np.abs(np.diff(law.ddu)).max() / 1e-3 * (1.0 + 1e-6) + 1e-4


def test_a_knot_that_is_slowed_is_passed_slower_and_the_rest_as_fast():
    bounds = straight(1.0, 1.0, 10.0)
    factor = np.ones(KNOTS + 1)
    factor[200] = 2.0
    x = fastest_squares(bounds.slowed(factor))
    assert math.sqrt(x[200]) == pytest.approx(0.5, rel=1e-6)
    assert math.sqrt(x[100]) == pytest.approx(1.0, rel=1e-6)


@given(st.integers(0, 2**32), st.integers(1, 9))
def test_the_lines_that_are_kept_are_the_least_ones_of_all(seed, count):
    rng = np.random.default_rng(seed)
    at_zero, slope, longest = rng.uniform(0, 2, (30, count)), rng.uniform(-2, 3, (30, count)), rng.uniform(0, 3, 30)
    for part in (0.0, 0.3, 0.8, 1.0):
        x = part * longest
        least = (at_zero + slope * x[:, np.newaxis]).min(axis=1)
        kept = [
            min(c + h * x[k] for c, h in (first, last, *more))
            for k, (first, last, more) in enumerate(_least_lines(at_zero, slope, longest.tolist()))
        ]
        assert np.allclose(kept, least, rtol=0.0, atol=1e-11)
