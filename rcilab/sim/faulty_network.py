"""The sockets of a virtual controller behind a network with faults: it loses, delays and corrupts what passes.

Without faults everything passes directly. Time is the machine's own here, in lock-step too: the simulated
millisecond waits for a command, however late it is, but not for one that is known to be lost.
"""

from __future__ import annotations

import socket
from collections.abc import Sequence
from typing import Protocol

from rcilab.core.clock import Clock
from rcilab.sim.api import Direction, NetworkFaults
from rcilab.sim.arrivals import Arrival, ClientConnected, ClientDisconnected, DatagramArrived
from rcilab.sim.network_impairment import DelayedDatagrams, SlowStream


class Endpoint(Protocol):
    """The sockets: one TCP client at a time, and datagrams both ways."""

    @property
    def has_client(self) -> bool:
        """Whether a client is connected."""
        ...

    def poll(self, timeout: float, extra_sockets: Sequence[socket.socket] = ()) -> list[Arrival]:
        """Returns what has arrived; waits up to `timeout`, [s], for the first thing."""
        ...

    def send_state(self, datagram: bytes) -> None:
        """Sends a state."""
        ...

    def send_frame(self, frame: bytes) -> None:
        """Sends an answer."""
        ...

    def drop_client(self, reason: str) -> None:
        """Ends the connection; the next `poll` reports it."""
        ...


class FaultyNetwork:
    """Stands between a controller and its sockets. Owned by the thread that runs the controller.

    Attributes:
        has_lost: Whether the newest state, or a command since, is lost: this state may never be answered.

    Args:
        endpoint: The sockets.
        clock: What delays are measured with.
        commands: Faults towards the controller.
        states: Faults towards the client; they apply to TCP, too.
    """

    def __init__(self, endpoint: Endpoint, clock: Clock, commands: NetworkFaults, states: NetworkFaults) -> None:
        self._endpoint = endpoint
        self._clock = clock
        self._commands = DelayedDatagrams(commands, "commands")
        self._states = DelayedDatagrams(states, "states")
        self._answers = SlowStream(states)
        self._drop_reason: str | None = None
        self.has_lost = False

    @property
    def faults(self) -> tuple[NetworkFaults, NetworkFaults]:
        """The faults in effect: towards the controller, towards the client."""
        return self._commands.faults, self._states.faults

    def replace(self, faults: NetworkFaults, direction: Direction) -> None:
        """Changes the faults from now on. A connection whose byte budget is used up breaks at once."""
        if direction != "states":
            self._commands.replace(faults)
        if direction != "commands":
            self._states.replace(faults)
            self._answers.faults = faults

    def poll(self, timeout: float, extra_sockets: Sequence[socket.socket] = ()) -> list[Arrival]:
        """Returns what has come through; see `Endpoint.poll`. Delayed data is sent meanwhile."""
        if self.is_clean:
            return self._endpoint.poll(timeout, extra_sockets)
        deadline = self._clock.now() + timeout
        had_lost = self.has_lost
        while True:
            self._send_what_is_due()
            now = self._clock.now()
            due = min(deadline, self._commands.next_due, self._states.next_due, self._answers.next_due)
            arrivals = self._let_through(self._endpoint.poll(due - now, extra_sockets))
            if arrivals or self.has_lost is not had_lost or self._clock.now() >= deadline:
                self._send_what_is_due()
                return arrivals

    def send_state(self, datagram: bytes) -> None:
        """Sends a state on its way."""
        if self._states.is_clean:
            self.has_lost = False
            self._endpoint.send_state(datagram)
        else:
            self.has_lost = not self._states.put(datagram, self._clock.now())
            self._send_what_is_due()

    def send_frame(self, frame: bytes) -> None:
        """Sends an answer on its way."""
        if self._answers.is_clean:
            self._endpoint.send_frame(frame)
        else:
            self._answers.put(frame, self._clock.now())
            self._send_what_is_due()

    def drop_client(self, reason: str) -> None:
        """Ends the connection once its answers are out; the next `poll` reports it."""
        if self._answers.is_clean:
            self._endpoint.drop_client(reason)
        else:
            self._drop_reason = reason
            self._send_what_is_due()

    @property
    def is_clean(self) -> bool:
        """Whether there is no fault in effect."""
        return self._commands.is_clean and self._states.is_clean and self._answers.is_clean

    def _send_what_is_due(self) -> None:
        now = self._clock.now()
        for datagram in self._states.take(now):
            self._endpoint.send_state(datagram)
        for piece in self._answers.take(now):
            self._endpoint.send_frame(piece)
        if self._answers.is_broken and self._endpoint.has_client:
            self._endpoint.drop_client("lost its connection: a network fault")
        elif self._drop_reason is not None and self._answers.next_due == float("inf"):
            self._endpoint.drop_client(self._drop_reason)
            self._drop_reason = None

    def _let_through(self, arrivals: list[Arrival]) -> list[Arrival]:
        """Returns the arrivals without the datagrams that are not there yet, and with those that are now."""
        now = self._clock.now()
        passed: list[Arrival] = []
        for arrival in arrivals:
            if isinstance(arrival, DatagramArrived):
                self.has_lost |= not self._commands.put(arrival.datagram, now)
                continue
            if isinstance(arrival, ClientConnected | ClientDisconnected):
                self._answers.begin()
                self._drop_reason = None
            passed.append(arrival)
        return [*map(DatagramArrived, self._commands.take(now)), *passed]
