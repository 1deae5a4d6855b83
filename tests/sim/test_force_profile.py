"""A push comes and goes as its rise and its duration say."""

from __future__ import annotations

import pytest

from rcilab.sim.api import Push
from rcilab.sim.force_profile import ForceProfile

DOWN = (0.0, 0.0, -20.0, 0.0, 0.0, 0.0)
UP = (0.0, 0.0, 10.0, 0.0, 0.0, 0.0)


def forces(profile: ForceProfile, count: int) -> list[float]:
    """The force along z of the next cycles."""
    found = []
    for _ in range(count):
        found.append(profile.wrench[2])
        profile.step()
    return found


def test_a_push_comes_and_fades_in_its_rise():
    profile = ForceProfile()
    profile.begin(Push(DOWN, rise_time=0.004))
    assert forces(profile, 6) == [-5.0, -10.0, -15.0, -20.0, -20.0, -20.0]
    profile.release()
    assert not profile.is_on
    assert forces(profile, 6) == [-15.0, -10.0, -5.0, 0.0, 0.0, 0.0]


def test_a_blow_is_there_and_gone_at_once():
    profile = ForceProfile()
    profile.begin(Push(DOWN, duration=0.003, rise_time=0.0))
    assert forces(profile, 5) == [-20.0, -20.0, -20.0, 0.0, 0.0]
    profile.begin(Push(DOWN, rise_time=0.0))
    profile.step()
    profile.release()
    assert profile.wrench[2] == 0.0


@pytest.mark.parametrize("cycles", [1, 2, 3, 10, 60, 200])
def test_a_push_of_a_given_time_acts_in_exactly_so_many_cycles(cycles):
    profile = ForceProfile()
    profile.begin(Push(DOWN, duration=0.001 * cycles))
    acting = forces(profile, 300)
    assert [force != 0.0 for force in acting] == [True] * cycles + [False] * (300 - cycles)
    steps = [abs(after - before) for before, after in zip([0.0, *acting], acting, strict=False)]
    assert max(steps) <= 20.0 / min(50, max(1, cycles // 2)) + 1e-12


def test_a_new_push_takes_over_where_the_one_before_is_and_elsewhere_begins_from_nothing():
    profile = ForceProfile()
    profile.begin(Push(DOWN, rise_time=0.0))
    profile.step()
    profile.begin(Push(UP, rise_time=0.003))
    assert forces(profile, 4) == pytest.approx([-10.0, 0.0, 10.0, 10.0])
    profile.begin(Push(UP, link=4, rise_time=0.002))
    assert forces(profile, 3) == [5.0, 10.0, 10.0]
    profile.begin(Push(UP, link=4, duration=0.5, rise_time=0.002))  # The page renews what is held.
    assert forces(profile, 3) == [10.0, 10.0, 10.0]
