import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.motion import PiecewisePolynomial
from rcilab.motion.piecewise import join_pieces


def random_curve(seed: int, pieces: int = 6, n: int = 3, k: int = 5) -> PiecewisePolynomial:
    rng = np.random.default_rng(seed)
    breaks = np.concatenate(([0.0], np.cumsum(rng.uniform(0.01, 1.0, pieces))))
    return PiecewisePolynomial(breaks, rng.normal(size=(pieces, n, k)))


@pytest.mark.parametrize("derivative", range(4))
def test_every_derivative_is_that_of_the_polynomial_piece(derivative):
    curve = random_curve(1)
    for t in np.random.default_rng(2).uniform(0.0, curve.duration, 50):
        piece = np.searchsorted(curve.breaks, t, side="right") - 1
        powers = np.polynomial.polynomial.polyder(curve.coefficients[piece].T, derivative)
        expected = np.polynomial.polynomial.polyval(t - curve.breaks[piece], powers)
        assert np.allclose(curve.sample([t], derivative)[0], expected, rtol=1e-12, atol=1e-12)


def test_one_time_and_many_times_agree_to_the_last_bit():
    curve = random_curve(3)
    times = np.random.default_rng(4).uniform(-0.5, curve.duration + 0.5, 200)
    for derivative in range(4):
        rows = curve.sample(times, derivative)
        assert all(np.array_equal(row, curve.at(t)[derivative]) for t, row in zip(times, rows, strict=True))


@pytest.mark.parametrize("factor", [0.3, 1.0, 7.7])
def test_a_slowed_curve_has_the_same_values_later_and_smaller_derivatives(factor):
    curve = random_curve(5)
    slowed = curve.slowed(factor)
    assert slowed.duration == pytest.approx(factor * curve.duration, rel=1e-15)
    times = np.random.default_rng(6).uniform(0.0, curve.duration, 50)
    for derivative in range(4):
        expected = curve.sample(times, derivative) / factor**derivative
        assert np.allclose(slowed.sample(factor * times, derivative), expected, rtol=1e-9, atol=1e-9)


def test_at_a_break_the_later_piece_counts():
    curve = PiecewisePolynomial([0.0, 1.0, 2.0], [[[0.0, 1.0]], [[5.0, 0.0]]])
    assert curve.at(1.0)[0][0] == 5.0
    assert curve.at(np.nextafter(1.0, 0.0))[0][0] < 1.0


def test_at_end_is_the_limit_from_the_left():
    curve = PiecewisePolynomial([0.0, 1.0, 3.0], [[[0.0, 1.0]], [[1.0, 2.0]]])
    q, dq, ddq, jerk = curve.at_end()
    assert (q[0], dq[0], ddq[0], jerk[0]) == (5.0, 2.0, 0.0, 0.0)


def test_joined_pieces_follow_each_joints_own_pieces():
    rng = np.random.default_rng(5)
    starts = np.concatenate((np.zeros((4, 1)), np.cumsum(rng.uniform(0.1, 0.5, (4, 5)), axis=1)), axis=1)
    coefficients = rng.normal(size=(4, 6, 5))
    duration = float(starts.max()) + 0.25
    curve = join_pieces(starts, coefficients, duration)
    assert curve.duration == duration
    for t in rng.uniform(0.0, duration, 200):
        for joint in range(4):
            piece = np.searchsorted(starts[joint], t, side="right") - 1
            expected = np.polynomial.polynomial.polyval(t - starts[joint, piece], coefficients[joint, piece])
            assert curve.at(t)[0][joint] == pytest.approx(expected, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(
    ("breaks", "coefficients", "word"),
    [
        ([0.0, 1.0], [[1.0, 2.0]], "shapes"),
        ([0.0], np.zeros((0, 2, 1)), "shapes"),
        ([0.0, 1.0, 2.0], np.zeros((1, 2, 1)), "shapes"),
        ([0.0, np.nan], np.zeros((1, 2, 1)), "finite"),
        ([0.0, 1.0], np.full((1, 2, 1), np.inf), "finite"),
        ([0.5, 1.0], np.zeros((1, 2, 1)), "begin at 0"),
        ([0.0, 2.0, 1.0], np.zeros((2, 2, 1)), "never decrease"),
        ([0.0, 1.0], np.zeros((1, 0, 1)), "one joint and one power"),
    ],
)
def test_unsound_pieces_are_refused_in_words(breaks, coefficients, word):
    with pytest.raises(InvalidValueError, match=word):
        PiecewisePolynomial(breaks, coefficients)


def test_its_arrays_are_copies_that_nobody_can_change():
    source = np.zeros((1, 2, 1))
    curve = PiecewisePolynomial([0.0, 1.0], source)
    source[0, 0, 0] = 9.0
    assert curve.at(0.0)[0][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        curve.coefficients[0, 0, 0] = 1.0


@pytest.mark.parametrize("k", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(5))
def test_the_extremes_are_those_of_a_dense_sampling(seed, k):
    curve = random_curve(seed, k=k)
    times = np.union1d(np.linspace(0.0, curve.duration, 20001), curve.breaks)
    q = np.concatenate((curve.sample(times), curve.sample(np.nextafter(curve.breaks[1:], 0.0))))
    (lowest, low_times), (highest, high_times) = curve.extremes()
    # A parabola's vertex between two samples 1e-4 s apart lies beyond them by about the second derivative times 1e-9.
    assert np.allclose(lowest, q.min(axis=0), atol=1e-6)
    assert np.allclose(highest, q.max(axis=0), atol=1e-6)
    assert (lowest <= q.min(axis=0) + 1e-12).all()
    assert (highest >= q.max(axis=0) - 1e-12).all()
    assert ((low_times >= 0.0) & (high_times <= curve.duration)).all()


def test_a_joint_that_turns_is_caught_at_its_turn():
    curve = PiecewisePolynomial([0.0, 2.0], [[[1.0, 1.0, -0.5]]])
    _, (highest, times) = curve.extremes()
    assert (highest[0], times[0]) == (1.5, 1.0)
