"""Reports of a controller as they arrive, read without the client library: its reader keeps the newest one only."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Sequence

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.ufactory.driver.links import Place
from rcilab.makers.ufactory.wire.reports import HIGH_RATE, ReportLayout

_MS = 1000.0
_BUFFER = 1 << 16


class ReportReceiver:
    """A connection to a report port. Owned by one thread.

    Attributes:
        layout: Layout of the reports.
        received_ns: When the newest one arrived, monotonic, [ns].

    Args:
        link: Connected to the port.
        layout: As the attribute.
        name: Name of the controller in errors.
    """

    def __init__(self, link: socket.socket, layout: ReportLayout, name: str) -> None:
        link.setblocking(False)
        self.layout = layout
        self.received_ns = time.monotonic_ns()
        self._link, self._name = link, name
        self._buffer = bytearray()
        self._ready = select.poll()
        self._ready.register(link, select.POLLIN)

    def poll(self, timeout: float) -> Sequence[bytes]:
        """Returns every report that has arrived, oldest first; waits up to a timeout, [s], for the first.

        Raises:
            ConnectionLostError: The controller has closed the connection, or sends something else.
        """
        deadline = time.monotonic() + timeout
        while True:
            left = deadline - time.monotonic()
            if not self._ready.poll(max(0.0, left) * _MS):
                return ()
            reports = self._receive()
            if reports or left <= 0.0:
                return reports

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._link.close()

    def _receive(self) -> Sequence[bytes]:
        try:
            received = self._link.recv(_BUFFER)
        except BlockingIOError:
            return ()
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error
        self.received_ns = time.monotonic_ns()
        if not received:
            raise self._lost("it closed the connection")
        self._buffer += received
        size = self.layout.size
        whole = len(self._buffer) // size * size
        reports = [bytes(self._buffer[start : start + size]) for start in range(0, whole, size)]
        del self._buffer[:whole]
        if any(int.from_bytes(report[:4], "big") != size for report in reports):
            raise self._lost(f"the reports of port {self.layout.port} have another size than {size} bytes")
        return reports

    def _lost(self, reason: str) -> ConnectionLostError:
        return ConnectionLostError(
            f"{self._name}: the connection is lost ({reason}); look whether the controller runs, and connect again"
        )


def open_receiver(place: Place, name: str, timeout: float) -> ReportReceiver:
    """Returns the receiver of a controller's reports in real time.

    Args:
        place: Where it listens.
        name: Name of the controller in errors.
        timeout: For the connection, [s].

    Raises:
        ConnectionLostError: It has none.
    """
    try:
        return ReportReceiver(place.connect(HIGH_RATE.port, timeout), HIGH_RATE, name)
    except OSError as error:
        raise ConnectionLostError(
            f"{name}: the controller sends no reports at port {HIGH_RATE.port} ({error.strerror or error}), which has "
            "those at 200 Hz; its firmware may be too old: update it"
        ) from error
