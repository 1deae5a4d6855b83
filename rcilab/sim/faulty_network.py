"""The sockets of a virtual controller behind a simulated network that loses, delays and corrupts data.

Without faults all data passes directly. Delays are in real time, also in lock-step: a cycle waits for a delayed
command, but not for one that is known to be lost.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence

from rcilab.core.clock import Clock
from rcilab.sim.api import Direction, NetworkFaults
from rcilab.sim.arrivals import Arrival, ClientDisconnected, DatagramArrived
from rcilab.sim.channels import Peer
from rcilab.sim.endpoint import Endpoint
from rcilab.sim.network_impairment import DelayedDatagrams, SlowStream


class FaultyNetwork:
    """The simulated network between a controller and its sockets: a maker's `ClientLink`. Owned by the server's thread.

    Attributes:
        has_lost: Whether the newest state, or a command since then, is lost: this state may never be answered.
        log: Receives the events of a maker's controller; see `ClientLink.log`.

    Args:
        endpoint: The sockets.
        clock: Clock for the delays.
        commands: Faults towards the controller.
        states: Faults towards the client; they apply to TCP, too.
        log: As the attribute.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        clock: Clock,
        commands: NetworkFaults,
        states: NetworkFaults,
        log: Callable[..., None] = lambda *_, **__: None,
    ) -> None:
        self._endpoint = endpoint
        self._clock = clock
        self.log = log
        self._commands = DelayedDatagrams(commands, "commands")
        self._states = DelayedDatagrams(states, "states")
        self._tcp_faults = states
        self._answers: dict[Peer, SlowStream] = {}  # Clients with delayed responses.
        self._drop_reasons: dict[Peer, str] = {}  # Connections that end, after their last response.
        self.has_lost = False

    @property
    def faults(self) -> tuple[NetworkFaults, NetworkFaults]:
        """The faults in effect: towards the controller, towards the client."""
        return self._commands.faults, self._states.faults

    def replace(self, faults: NetworkFaults, direction: Direction) -> None:
        """Replaces the faults. A connection whose byte limit is exceeded breaks at once."""
        if direction != "states":
            self._commands.replace(faults)
        if direction != "commands":
            self._states.replace(faults)
            self._tcp_faults = faults
            for answers in self._answers.values():
                answers.faults = faults
            self._answers = {peer: answers for peer, answers in self._answers.items() if not answers.is_clean}

    def poll(self, timeout: float, extra_sockets: Sequence[socket.socket] = ()) -> list[Arrival]:
        """Returns the arrivals that passed the network; see `Endpoint.poll`. Delayed data is sent meanwhile."""
        if self.is_clean:
            arrivals = self._endpoint.poll(timeout, extra_sockets)
            if self._drop_reasons:
                self._forget_disconnected(arrivals)
            return arrivals
        deadline = self._clock.now() + timeout
        had_lost = self.has_lost
        while True:
            self._send_due()
            now = self._clock.now()
            answers = (stream.next_due for stream in self._answers.values())
            due = min(deadline, self._commands.next_due, self._states.next_due, *answers)
            arrivals = self._pass_through(self._endpoint.poll(due - now, extra_sockets))
            if arrivals or self.has_lost is not had_lost or self._clock.now() >= deadline:
                self._send_due()
                return arrivals

    def send_datagram(self, datagram: bytes, peer: Peer | None = None) -> None:
        """Sends a datagram; the faults apply to states alone."""
        if peer is not None:
            self._endpoint.send_datagram(datagram, peer)
        elif self._states.is_clean:
            self.has_lost = False
            self._endpoint.send_datagram(datagram)
        else:
            self.has_lost = not self._states.put(datagram, self._clock.now())
            self._send_due()

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        """Sends a response, with the faults."""
        if self._is_tcp_clean:
            self._endpoint.send_frame(peer, frame)
        else:
            self._answers_to(peer).put(frame, self._clock.now())
            self._send_due()

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        """Directs datagrams to a port of this client; returns False for a port that is not allowed."""
        return self._endpoint.direct_datagrams(peer, port)

    def drop(self, peer: Peer, reason: str) -> None:
        """Ends a connection after its last response; the next `poll` reports it."""
        self._drop_reasons[peer] = reason
        if self._is_tcp_clean:
            self._endpoint.drop(peer, reason)
        else:
            self._answers_to(peer)
            self._send_due()

    def has_dropped(self, peer: Peer) -> bool:
        """Returns whether a connection was ended by `drop`: frames that have arrived with its last one are void."""
        return peer in self._drop_reasons

    @property
    def is_clean(self) -> bool:
        """Whether no fault is in effect."""
        return self._commands.is_clean and self._states.is_clean and self._is_tcp_clean

    @property
    def _is_tcp_clean(self) -> bool:
        return self._tcp_faults.is_tcp_clean and (
            not self._answers or all(stream.is_clean for stream in self._answers.values())
        )

    def _answers_to(self, peer: Peer) -> SlowStream:
        if peer not in self._answers:
            self._answers[peer] = SlowStream(self._tcp_faults)
        return self._answers[peer]

    def _send_due(self) -> None:
        now = self._clock.now()
        for datagram in self._states.take(now):
            self._endpoint.send_datagram(datagram)
        for peer in self._endpoint.peers:
            stream = self._answers_to(peer)
            for piece in stream.take(now):
                self._endpoint.send_frame(peer, piece)
            if stream.is_broken:
                self._endpoint.drop(peer, "lost its connection: a network fault")
            elif peer in self._drop_reasons and stream.next_due == float("inf"):
                self._endpoint.drop(peer, self._drop_reasons[peer])

    def _pass_through(self, arrivals: list[Arrival]) -> list[Arrival]:
        """Returns the arrivals without datagrams that are delayed, and with delayed ones that are due."""
        now = self._clock.now()
        self._forget_disconnected(arrivals)
        passed: list[Arrival] = []
        for arrival in arrivals:
            if isinstance(arrival, DatagramArrived):
                self.has_lost |= not self._commands.put(arrival.datagram, now)
                continue
            passed.append(arrival)
        return [*map(DatagramArrived, self._commands.take(now)), *passed]

    def _forget_disconnected(self, arrivals: list[Arrival]) -> None:
        for arrival in arrivals:
            if isinstance(arrival, ClientDisconnected):
                self._answers.pop(arrival.peer, None)
                self._drop_reasons.pop(arrival.peer, None)
