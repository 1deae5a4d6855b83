"""A bad network is a pure function of traffic, time and seed, and does what its numbers say."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError
from rcilab.sim.api import Stall
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.network_impairment import HOLD_TIME, DelayedDatagrams, Impairment, NetworkFaults, SlowStream

N = 20_000
STREAM = [k.to_bytes(4, "big") for k in range(N)]


def through(faults: NetworkFaults, stream: str = "commands") -> list[tuple[float, bytes]]:
    """What arrives of a 1 kHz stream, and when, in the order of arrival."""
    line = DelayedDatagrams(faults, stream)
    arrived: list[tuple[float, bytes]] = []
    for k, datagram in enumerate(STREAM):
        line.put(datagram, k * 1e-3)
        while line.next_due < (k + 1) * 1e-3:
            due = line.next_due
            arrived += [(due, one) for one in line.take(due)]
    return [*arrived, *((float("inf"), one) for one in line.take(float("inf")))]


def numbers(arrived: list[tuple[float, bytes]]) -> list[int]:
    return [int.from_bytes(one, "big") for _, one in arrived]


def test_a_perfect_network_hands_everything_on_at_once() -> None:
    assert Impairment(NetworkFaults()).apply(b"abc", 5.0) == [(b"abc", 5.0)]
    line = DelayedDatagrams(NetworkFaults(), "states")
    assert line.is_clean
    assert line.next_due == float("inf")


def test_loss_takes_its_share_and_leaves_the_rest_in_order() -> None:
    found = numbers(through(NetworkFaults(loss=0.1, seed=4)))
    assert len(found) == pytest.approx(0.9 * N, rel=0.02)  # Five standard deviations are 0.012.
    assert found == sorted(found)


def test_delay_and_jitter_lie_in_their_range_and_keep_the_order() -> None:
    faults = NetworkFaults(delay=0.005, jitter=0.004, seed=1)
    impairment = Impairment(faults)
    delays = [impairment.apply(one, k * 1e-3)[0][1] - k * 1e-3 for k, one in enumerate(STREAM)]
    assert min(delays) == pytest.approx(0.005, abs=1e-4)
    assert max(delays) == pytest.approx(0.009, abs=1e-4)
    assert numbers(through(faults)) == list(range(N))


def test_reordered_datagrams_are_overtaken_and_nothing_is_lost() -> None:
    found = numbers(through(NetworkFaults(reorder=0.05, seed=2)))
    assert sorted(found) == list(range(N))
    overtaken = sum(later < earlier for earlier, later in pairwise(found))
    assert overtaken > 0.02 * N
    assert max(abs(place - number) for place, number in enumerate(found)) <= 1 + HOLD_TIME / 1e-3


def test_duplicates_arrive_twice() -> None:
    found = numbers(through(NetworkFaults(duplicate=0.2, seed=3)))
    assert set(found) == set(range(N))
    assert len(found) == pytest.approx(1.2 * N, rel=0.02)


def test_a_corrupt_datagram_differs_in_one_bit_and_keeps_its_length() -> None:
    impairment = Impairment(NetworkFaults(corrupt=1.0))
    for original in STREAM[:500]:
        ((spoiled, _),) = impairment.apply(original, 0.0)
        assert len(spoiled) == len(original)
        assert sum((a ^ b).bit_count() for a, b in zip(original, spoiled, strict=True)) == 1
    assert impairment.apply(b"", 0.0) == [(b"", 0.0)]


@given(
    st.builds(
        NetworkFaults,
        loss=st.floats(0, 1),
        delay=st.floats(0, 1),
        jitter=st.floats(0, 1),
        reorder=st.floats(0, 1),
        duplicate=st.floats(0, 1),
        corrupt=st.floats(0, 1),
        seed=st.integers(0, 2**32 - 1),
    ),
    st.lists(st.binary(max_size=8), max_size=20),
)
def test_equal_seeds_and_traffic_give_equal_faults(faults: NetworkFaults, traffic: list[bytes]) -> None:
    runs = []
    for _ in range(2):
        impairment = Impairment(faults, "states")
        runs.append([impairment.apply(one, k * 1e-3) for k, one in enumerate(traffic)])
    assert runs[0] == runs[1]
    for k, copies in enumerate(runs[0]):
        for _, due in copies:
            assert due >= k * 1e-3


def test_the_two_directions_draw_different_numbers() -> None:
    faults = NetworkFaults(loss=0.5, seed=9)
    assert numbers(through(faults, "commands")) != numbers(through(faults, "states"))


def test_what_is_under_way_when_the_faults_end_still_arrives() -> None:
    line = DelayedDatagrams(NetworkFaults(delay=0.1), "commands")
    line.put(b"late", 0.0)
    line.replace(NetworkFaults())
    assert not line.is_clean
    assert line.take(0.0999) == []
    assert line.take(0.1) == [b"late"]
    assert line.is_clean


def test_a_split_answer_comes_in_pieces_some_time_apart() -> None:
    stream = SlowStream(NetworkFaults(tcp_split=4, tcp_delay=0.5))
    stream.put(b"0123456789", 1.0)
    stream.put(b"ab", 1.0)
    times, pieces = [], []
    while stream.next_due < float("inf"):
        times.append(stream.next_due)
        pieces.append(stream.take(stream.next_due))
    assert pieces == [[b"0123"], [b"4567"], [b"89"], [b"ab"]] or pieces == [[b"0123"], [b"4567"], [b"89", b"ab"]]
    assert times[0] == 1.5
    assert times == sorted(times)
    assert stream.is_clean is False  # The fault is still there; only nothing waits.


def test_a_connection_breaks_after_exactly_so_many_bytes() -> None:
    stream = SlowStream(NetworkFaults(tcp_break=15))
    stream.put(bytes(11), 0.0)
    assert stream.take(0.0) == [bytes(11)]
    assert not stream.is_broken
    stream.put(bytes(11), 0.0)
    assert stream.take(0.0) == [bytes(4)]
    assert stream.is_broken
    assert not SlowStream(stream.faults).is_broken  # The next connection has a stream of its own.


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("loss", 1.1),
        ("loss", float("nan")),
        ("delay", -0.1),
        ("jitter", 2.0),
        ("reorder", "0.1"),
        ("corrupt", True),
        ("tcp_delay", 11.0),
        ("tcp_split", 1.5),
        ("tcp_break", -1),
        ("seed", -1),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InvalidValueError, match=name):
        NetworkFaults(**{name: value})  # type: ignore[arg-type]


def test_a_clock_stalls_once_at_its_time() -> None:
    plan = StallSchedule([Stall(duration=0.05, after=2.0)], now=10.0)
    assert [plan.pop(now) for now in (10.0, 11.999, 12.0, 12.1, 99.0)] == [0.0, 0.0, 0.05, 0.0, 0.0]
    assert plan.count == 1


def test_a_periodic_stall_comes_again_and_is_not_made_up_for() -> None:
    plan = StallSchedule([Stall(duration=0.5, period=1.0), Stall(duration=0.1, after=0.7)])
    found = [(now / 10, plan.pop(now / 10)) for now in range(40)]
    assert [entry for entry in found if entry[1]] == [(0.0, 0.5), (0.7, 0.1), (1.0, 0.5), (2.0, 0.5), (3.0, 0.5)]
    plan.replace([], 4.0)
    assert not any(plan.pop(now) for now in (4.0, 5.0, 6.0))


def test_a_stall_longer_than_its_period_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="period"):
        Stall(duration=0.5, period=0.5)
