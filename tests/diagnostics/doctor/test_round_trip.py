from __future__ import annotations

import socket
import struct

import pytest

from rcilab.diagnostics.doctor import round_trip
from rcilab.diagnostics.doctor.round_trip import check_controller


def test_this_machine_answers_itself_or_says_why_not() -> None:
    finding = round_trip.check_round_trip("127.0.0.1")
    if finding.figures:
        assert finding.figures["count"] == round_trip.ECHOES
        assert 0.0 < finding.figures["median_ms"] <= finding.figures["p99_ms"] <= finding.figures["max_ms"]
    else:
        assert "no permission to send echoes" in finding.value


def test_an_echo_is_a_state_long_and_sums_to_zero() -> None:
    packet = round_trip.build_echo(0x1234, 7)
    assert len(packet) == 8 + 1247
    total = sum(struct.unpack("!628H", packet + b"\0"))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    assert total == 0xFFFF  # RFC 1071: with its checksum in place, a message sums to all ones.


def test_a_silent_host_is_given_up_early_and_is_no_error() -> None:
    asked: list[int] = []
    times = round_trip.measure_round_trips(lambda number: asked.append(number), interval=0.0)
    assert asked == [0, 1, 2]
    finding = round_trip.evaluate_round_trips("192.0.2.1", times)
    assert finding.verdict == "note"
    assert "did not answer 3 echoes" in finding.value


@pytest.mark.parametrize(
    ("times", "verdict"),
    [([2e-4] * 100, "ok"), ([2e-4] * 99 + [None], "note"), ([2e-4] * 90 + [9e-4] * 10, "note"), ([None, 1e-4], "note")],
)
def test_a_quick_way_that_loses_nothing_is_good(times: list[float | None], verdict: str) -> None:
    finding = round_trip.evaluate_round_trips("192.168.0.160", times)
    assert finding.verdict == verdict
    assert finding.figures["lost"] == times.count(None)
    assert ("RCI manual 2.5" in finding.advice) is (verdict == "note")


def test_a_controller_on_this_machine_is_connected_to_and_no_other() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        place = listener.getsockname()
        assert check_controller(place, is_here=True).verdict == "ok"
    finding = check_controller(place, is_here=True)
    assert finding.verdict == "bad"
    assert f"--port {place[1]}" in finding.advice
    assert "not connected to" in check_controller(("192.0.2.1", 1337), is_here=False).value
