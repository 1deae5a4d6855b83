"""Reports of a controller as they arrive, read without the client library: its reader keeps the newest one only."""

from __future__ import annotations

import select
import socket
import threading
import time
from collections import deque
from collections.abc import Sequence

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.ufactory.driver.links import Endpoint
from rcilab.makers.ufactory.wire.reports import HIGH_RATE, ReportLayout

_MS = 1000.0
_BUFFER = 1 << 16
_KEPT = 100  # Reports while none is read: those of half a second.
_UNREAD = 0.05  # [s] A controller ends a connection whose reports are not read.


class ReportReceiver:
    """A connection to a report port. Owned by one thread; while that does not ask, another keeps the newest reports.

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
        self._kept: deque[bytes] = deque(maxlen=_KEPT)
        self._failure = ""  # Why the connection is lost.
        self._polled = time.monotonic()
        self._ready = select.poll()
        self._ready.register(link, select.POLLIN)
        self._reading = threading.Lock()
        self._is_closed = threading.Event()
        self._keeper = threading.Thread(target=self._keep, name="reports", daemon=True)
        self._keeper.start()

    def poll(self, timeout: float) -> Sequence[bytes]:
        """Returns every report that has arrived, oldest first; waits up to a timeout, [s], for the first.

        Raises:
            ConnectionLostError: The controller has closed the connection, or sends something else.
        """
        self._polled = time.monotonic()
        deadline = self._polled + timeout
        while True:
            left = deadline - time.monotonic()
            if self._kept or self._failure or self._ready.poll(max(0.0, left) * _MS):
                with self._reading:
                    self._receive()
                    reports = tuple(self._kept)
                    self._kept.clear()
                if reports:
                    self._polled = time.monotonic()
                    return reports
            if left <= 0.0:
                return ()

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._is_closed.set()
        self._keeper.join()
        self._link.close()

    def _keep(self) -> None:
        while not self._is_closed.wait(_UNREAD):
            if time.monotonic() - self._polled > _UNREAD:
                try:
                    with self._reading:
                        self._receive()
                except ConnectionLostError:  # The next poll raises it again.
                    return

    def _receive(self) -> None:
        """Reads what has arrived."""
        if self._failure:
            raise ConnectionLostError(self._failure)
        try:
            received = self._link.recv(_BUFFER)
        except BlockingIOError:
            return
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error
        if not received:
            raise self._lost("it closed the connection")
        self.received_ns = time.monotonic_ns()
        self._buffer += received
        size = self.layout.size
        whole = len(self._buffer) // size * size
        for start in range(0, whole, size):
            report = bytes(self._buffer[start : start + size])
            if int.from_bytes(report[:4], "big") != size:
                raise self._lost(f"the reports of port {self.layout.port} have another size than {size} bytes")
            self._kept.append(report)
        del self._buffer[:whole]

    def _lost(self, reason: str) -> ConnectionLostError:
        self._failure = (
            f"{self._name}: the connection is lost ({reason}); look whether the controller runs, and connect again"
        )
        return ConnectionLostError(self._failure)


def open_receiver(endpoint: Endpoint, name: str, timeout: float) -> ReportReceiver:
    """Returns the receiver of a controller's reports in real time.

    Args:
        endpoint: Where it listens.
        name: Name of the controller in errors.
        timeout: For the connection, [s].

    Raises:
        ConnectionLostError: It has none.
    """
    try:
        return ReportReceiver(endpoint.connect(HIGH_RATE.port, timeout), HIGH_RATE, name)
    except OSError as error:
        raise ConnectionLostError(
            f"{name}: the controller sends no reports at port {HIGH_RATE.port} ({error.strerror or error}), which has "
            "those at 200 Hz; its firmware may be too old: update it"
        ) from error
