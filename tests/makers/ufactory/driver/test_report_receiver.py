"""The reports of a connection: cut from a stream, kept until they are read, and refused if they are not valid."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.ufactory.driver.report_receiver import ReportReceiver
from rcilab.makers.ufactory.wire.reports import HIGH_RATE


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, ReportReceiver]]:
    controller, client = socket.socketpair()
    receiver = ReportReceiver(client, HIGH_RATE, "arm")
    yield controller, receiver
    receiver.close()
    controller.close()


def report(number: int) -> bytes:
    return HIGH_RATE.encode({"microseconds": number})


def test_reports_are_cut_from_the_stream(ends):
    controller, receiver = ends
    controller.sendall(report(1) + report(2)[:100])
    assert receiver.poll(1.0) == (report(1),)
    assert receiver.poll(0.0) == ()
    controller.sendall(report(2)[100:] + report(3))
    assert receiver.poll(1.0) == (report(2), report(3))


def test_the_newest_are_kept_until_they_are_read(ends):
    """A controller ends the connection of a client that does not read."""
    controller, receiver = ends
    controller.settimeout(10.0)
    for number in range(3000):  # More than the buffers of the sockets hold.
        controller.sendall(report(number))
    found = list(receiver.poll(1.0))
    while found[-1] != report(2999):
        found += receiver.poll(1.0)
    assert len(found) < 3000
    assert found == [report(number) for number in range(3000 - len(found), 3000)]


@pytest.mark.parametrize(
    ("sent", "reason"),
    [(b"", "it closed the connection"), (b"HTTP" * 300, "another size than")],
    ids=["closed", "not reports"],
)
def test_the_end_of_a_connection_is_reported(ends, sent, reason):
    controller, receiver = ends
    controller.sendall(sent)
    controller.shutdown(socket.SHUT_WR)
    for _ in range(2):
        with pytest.raises(ConnectionLostError, match=rf"arm: the connection is lost \(.*{reason}"):
            receiver.poll(1.0)
