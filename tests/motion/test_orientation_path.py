"""How the tool turns: through what was asked for, evenly where that is possible, and without a jump of acceleration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rcilab.core.spatial import rotation_between, rotation_from_wxyz
from rcilab.motion.orientation_path import Slerp, turn_through, turn_to, turns_between
from rcilab.motion.path import slerp

EPS = 1e-4  # Share over which differences are formed: their errors are about EPS^2, and 1e-16 / EPS^2 of rounding.
places = st.floats(0.1, 0.9)
quaternions = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01)
rotations = quaternions.map(rotation_from_wxyz)
angles = st.floats(-2.5, 2.5)


def about(angle: float) -> tuple[float, ...]:
    """A turn about one slanting axis."""
    return rotation_from_wxyz((math.cos(angle / 2), *(math.sin(angle / 2) * np.array((2.0, -1.0, 2.0)) / 3.0)))


def at(turning, share: float) -> np.ndarray:
    return turning.sample(np.array([share]))[0]


@given(rotations, rotations, rotations, places)
@example(*(rotation_from_wxyz(q) for q in ((0, 0, 0, 1), (0, 0, 0.75, 6e-8), (0, 1, 0, 1))), 0.5)
def test_all_three_orientations_are_passed_exactly(start, middle, goal, place):
    turning = turn_through(start, middle, goal, place)
    for share, wanted in ((0.0, start), (place, middle), (1.0, goal)):
        assert np.abs(at(turning, share).ravel() - wanted).max() < 1e-12


@given(rotations, rotations, rotations, places)
def test_angular_velocity_and_acceleration_are_continuous_at_the_middle(start, middle, goal, place):
    turning = turn_through(start, middle, goal, place)
    turns = turns_between(turning.sample(place + EPS * np.arange(-3, 4))) / EPS
    rates, bends = turns, np.diff(turns, axis=0) / EPS
    # In steps of EPS a jump would stand beside a difference of the order of EPS times the next derivative.
    third = max(np.linalg.norm(turning.before) / place**3, np.linalg.norm(turning.after) / (1 - place) ** 3)
    scale = 1.0 + 30.0 * third
    assert np.abs(rates[3] - rates[2]).max() < scale * EPS
    assert np.abs(bends[4] - bends[0]).max() < 4.0 * scale * EPS


@given(rotations, rotations, places)
def test_what_a_slerp_passes_in_proportion_is_that_slerp(start, goal, place):
    if np.linalg.norm(rotation_between(start, goal)) > 3.1:  # About half a turn there are two shorter ways.
        return
    turning = turn_through(start, slerp(start, goal, place), goal, place)
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        assert np.abs(at(turning, share).ravel() - slerp(start, goal, share)).max() < 1e-9


@given(angles, angles, places)
def test_about_one_axis_it_never_overshoots(first, second, place):
    turning = turn_through(about(0.0), about(first), about(first + second), place)
    shares = np.linspace(0.0, 1.0, 301)
    axis = np.array((2.0, -1.0, 2.0)) / 3.0
    steps = turns_between(turning.sample(shares)) @ axis
    parts = (steps[shares[1:] <= place], first), (steps[shares[:-1] >= place], second)
    for part, whole in parts:
        assert (part * math.copysign(1.0, whole) > -1e-9).all()


def test_the_whole_may_turn_further_than_half_round():
    turning = turn_through(about(0.0), about(2.0), about(4.0), 0.5)
    whole = turns_between(turning.sample(np.linspace(0.0, 1.0, 101))).sum(axis=0)
    assert np.linalg.norm(whole) == pytest.approx(4.0, abs=1e-9)
    assert turning.max_rate == pytest.approx(4.0, abs=1e-3)


@given(rotations, rotations, st.floats(0.0, 1.0))
def test_a_steady_turn_between_two_orientations_is_their_slerp(start, goal, share):
    if np.linalg.norm(rotation_between(start, goal)) > 3.1:
        return
    assert np.abs(at(turn_to(start, goal), share).ravel() - slerp(start, goal, share)).max() < 1e-9


def test_a_steady_turn_may_go_round_and_round():
    turning = Slerp(about(0.3), (0.0, 0.0, 4.0 * math.pi))
    assert np.abs(at(turning, 0.5) - at(turning, 0.0)).max() < 1e-12
    assert np.abs(at(turning, 1.0) - at(turning, 0.0)).max() < 1e-12
    assert np.abs(at(turning, 0.25) - at(turning, 0.0)).max() > 1.0


@given(rotations, st.tuples(*[st.floats(-0.8, 0.8)] * 3))
def test_the_turn_from_row_to_row_is_in_base_axes(start, turn):
    rows = np.stack((np.array(start).reshape(3, 3), at(Slerp(start, turn), 1.0)))
    expected = rotation_between(start, rows[1].ravel().tolist())
    assert np.abs(turns_between(rows)[0] - expected).max() < 1e-9
