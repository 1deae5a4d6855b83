"""Time laws along a path: against formulas where there are some, and against their own bounds where there are none."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rcilab.core.arrays import Array
from rcilab.motion.path_bounds import PathBounds, path_bounds
from rcilab.motion.time_parametrization import FastestLaw, smooth_law

KNOTS = 400


def bounds_of(first: Array, second: Array, velocity: Array, acceleration: Array) -> PathBounds:
    fastest = (velocity[:, np.newaxis] / np.abs(first)).min(axis=0)
    return path_bounds(np.linspace(0.0, 1.0, KNOTS + 1), first, second, acceleration[:, np.newaxis], fastest)


def straight(length: float, velocity: float, acceleration: float) -> PathBounds:
    first = np.full((1, KNOTS + 1), length)
    return bounds_of(first, np.zeros_like(first), np.array([velocity]), np.array([acceleration]))


@dataclass
class Wavy:
    """Three rows that are sums of a line and a wave."""

    first: Array
    second: Array
    velocity: Array
    acceleration: Array

    @property
    def bounds(self) -> PathBounds:
        return bounds_of(self.first, self.second, self.velocity, self.acceleration)


def wavy(seed: int) -> Wavy:
    rng = np.random.default_rng(seed)
    u = np.linspace(0.0, 1.0, KNOTS + 1)
    slope, size, rate, phase = (rng.uniform(*ends, (3, 1)) for ends in ((-2, 2), (0, 0.5), (1, 9), (0, 6)))
    return Wavy(
        first=slope + size * rate * np.cos(rate * u + phase),
        second=-size * rate**2 * np.sin(rate * u + phase),
        velocity=rng.uniform(0.5, 2.0, 3),
        acceleration=rng.uniform(2.0, 10.0, 3),
    )


def duration_of(knots: np.ndarray, squares: np.ndarray) -> float:
    """Returns how long the law with these squares of s' lasts, s'' constant from knot to knot, [s]."""
    speed = np.sqrt(squares)
    return float((2.0 * np.diff(knots) / (speed[:-1] + speed[1:])).sum())


def fastest_squares(bounds: PathBounds) -> np.ndarray:
    return FastestLaw(bounds).slowed(np.ones(len(bounds.knots)))


def lasts(bounds: PathBounds) -> float:
    return duration_of(bounds.knots, fastest_squares(bounds))


@given(st.floats(0.01, 5.0), st.floats(0.1, 3.0), st.floats(0.5, 20.0))
def test_on_a_straight_way_it_is_the_trapezoid(length, velocity, acceleration):
    ramp = velocity / acceleration
    exact = 2.0 * math.sqrt(length / acceleration) if length < ramp * velocity else length / velocity + ramp
    assert lasts(straight(length, velocity, acceleration)) == pytest.approx(exact, rel=5e-3)


@given(st.integers(0, 2**32))
@example(
    224
)  # A row hardly depends on s'' at a knot: x came to rest there, and took 1.15 times the acceleration for it.
@example(10000)
def test_every_bound_is_kept_and_one_of_them_is_always_reached(seed):
    path = wavy(seed)
    x = fastest_squares(path.bounds)
    assert x[0] == x[-1] == 0.0
    dds = np.diff(x) * KNOTS / 2.0
    speed = (np.abs(path.first) * np.sqrt(x)).T / path.velocity
    assert speed.max() <= 1.0 + 1e-9
    pull = np.abs(path.first[:, :-1] * dds + path.second[:, :-1] * x[:-1]).T / path.acceleration
    assert pull.max() <= 1.0 + 1e-6
    used = np.maximum(np.maximum(speed[:-1], speed[1:]).max(axis=1), pull.max(axis=1))
    # Where two rows bound each other nothing else may be reached: there x is on its own ceiling.
    assert np.median(used) > 0.999
    assert (used > 0.9).mean() > 0.9


@given(st.integers(0, 2**32), st.integers(1, 12))
def test_smoothing_keeps_the_ends_and_bounds_the_jerk(seed, cycles):
    bounds = wavy(seed).bounds
    squares = fastest_squares(bounds)
    law = smooth_law(bounds.knots, squares, cycles)
    assert law.s[0] == law.ds[0] == law.dds[0] == 0.0
    assert law.s[-1] == pytest.approx(1.0, abs=1e-12)
    assert law.ds[-1] == pytest.approx(0.0, abs=1e-9)
    assert law.dds[-1] == pytest.approx(0.0, abs=1e-9)
    assert (np.diff(law.s) > 0.0).all()
    assert len(law.s) - 1 == math.ceil(1000.0 * duration_of(bounds.knots, squares) - 1e-9) + cycles
    largest = np.abs(np.diff(squares)).max() * KNOTS / 2.0
    assert np.abs(np.diff(law.dds)).max() <= 2.0 * largest / cycles * 1.01
    # The share is the exact integral of an acceleration that is straight between the cycles.
    third = np.diff(law.s, 3) / 1e-9
    assert np.abs(third).max() <= np.abs(np.diff(law.dds)).max() / 1e-3 * (1.0 + 1e-6) + 1e-4


def test_a_knot_that_is_slowed_is_passed_slower_and_the_rest_as_fast():
    bounds = straight(1.0, 1.0, 10.0)
    factor = np.ones(KNOTS + 1)
    factor[200] = 2.0
    x = fastest_squares(bounds.slowed(factor))
    assert math.sqrt(x[200]) == pytest.approx(0.5, rel=1e-6)
    assert math.sqrt(x[100]) == pytest.approx(1.0, rel=1e-6)


@settings(max_examples=25)
@given(st.integers(0, 2**32))
def test_a_law_slowed_down_in_places_step_by_step_is_the_one_computed_at_once(seed):
    rng = np.random.default_rng(seed)
    bounds = wavy(seed).bounds
    law, factor = FastestLaw(bounds), np.ones(len(bounds.knots))
    for _ in range(4):
        np.testing.assert_allclose(law.slowed(factor), fastest_squares(bounds.slowed(factor)), rtol=1e-12)
        place = int(rng.integers(len(factor)))
        factor[place : place + int(rng.integers(1, 6))] *= rng.uniform(1.0, 2.0)
