"""Simulated network faults as pure functions of the data, the time and a seed: no sockets, no clock.

Every fault is drawn for each datagram separately, in this order: loss, corruption, duplication, and the delay of each
copy. Delays keep the order of the datagrams, except for those that `reorder` holds back.
"""

from __future__ import annotations

import heapq
from collections import deque
from itertools import count
from random import Random

from rcilab.sim.api import NetworkFaults

__all__ = ["HOLD_TIME", "PIECE_GAP", "DelayedDatagrams", "Impairment", "NetworkFaults", "SlowStream"]

HOLD_TIME = 0.0025  # [s] Delay of a reordered datagram: two others of a 1 kHz stream overtake it.
PIECE_GAP = 0.002  # [s] Between the pieces of a split response, so that they arrive separately.
MOST_HELD = 4096  # Datagrams in transit, four times the need of a delay of 1 s; further ones are lost, as in a router.


class Impairment:
    """Applies network faults to the datagrams of one direction.

    Args:
        faults: The simulated faults.
        stream: Name of the direction; each draws its own random numbers from one seed.
    """

    def __init__(self, faults: NetworkFaults, stream: str = "") -> None:
        self._faults = faults
        self._random = Random(f"{faults.seed} {stream}")
        self._last_due = float("-inf")

    def apply(self, datagram: bytes, now: float) -> list[tuple[bytes, float]]:
        """Returns the copies of a datagram sent `now`, [s], that arrive, and their times: none, one or two."""
        faults, draw = self._faults, self._random.random
        if draw() < faults.loss:
            return []
        if draw() < faults.corrupt and datagram:
            datagram = self._flip_one_bit(datagram)
        copies = 2 if draw() < faults.duplicate else 1
        return [(datagram, self._due(now)) for _ in range(copies)]

    def _due(self, now: float) -> float:
        faults, draw = self._faults, self._random.random
        due = now + faults.delay + faults.jitter * draw()
        if draw() < faults.reorder:
            return due + HOLD_TIME
        self._last_due = max(due, self._last_due)
        return self._last_due

    def _flip_one_bit(self, datagram: bytes) -> bytes:
        corrupted = bytearray(datagram)
        bit = self._random.randrange(8 * len(corrupted))
        corrupted[bit // 8] ^= 1 << bit % 8
        return bytes(corrupted)


class DelayedDatagrams:
    """One direction of a faulty network with the datagrams in transit.

    Args:
        faults: The simulated faults.
        stream: Name of the direction.
    """

    def __init__(self, faults: NetworkFaults, stream: str) -> None:
        self._stream = stream
        self.replace(faults)
        self._waiting: list[tuple[float, int, bytes]] = []
        self._order = count()

    @property
    def next_due(self) -> float:
        """When the next datagram arrives, [s]; infinity: none is in transit."""
        return self._waiting[0][0] if self._waiting else float("inf")

    @property
    def is_clean(self) -> bool:
        """Whether there is no fault and no datagram in transit, so that datagrams may be sent directly."""
        return self._has_no_faults and not self._waiting

    def put(self, datagram: bytes, now: float) -> bool:
        """Sends a datagram; returns whether it will arrive, possibly corrupted."""
        arrives = False
        for copy, due in self._impairment.apply(datagram, now):
            if len(self._waiting) < MOST_HELD:
                heapq.heappush(self._waiting, (due, next(self._order), copy))
                arrives = True
        return arrives

    def take(self, now: float) -> list[bytes]:
        """Returns the datagrams that have arrived by `now`, [s], in their order of arrival."""
        arrived: list[bytes] = []
        while self._waiting and self._waiting[0][0] <= now:
            arrived.append(heapq.heappop(self._waiting)[2])
        return arrived

    def replace(self, faults: NetworkFaults) -> None:
        """Changes the faults; datagrams in transit are not affected."""
        self.faults = faults
        self._has_no_faults = faults.is_udp_clean
        self._impairment = Impairment(faults, self._stream)


class SlowStream:
    """The responses of one TCP connection in transit through a faulty network.

    Args:
        faults: The simulated faults.
    """

    def __init__(self, faults: NetworkFaults) -> None:
        self.faults = faults
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._sent = 0

    @property
    def next_due(self) -> float:
        """When the next piece must be sent, [s]; infinity: none is queued."""
        return self._pieces[0][0] if self._pieces else float("inf")

    @property
    def is_clean(self) -> bool:
        """Whether there is no fault and nothing is queued, so that responses may be sent directly."""
        return not self._pieces and self.faults.is_tcp_clean

    @property
    def is_broken(self) -> bool:
        """Whether the byte limit is reached."""
        return self.faults.tcp_break is not None and self._sent >= self.faults.tcp_break

    def put(self, frame: bytes, now: float) -> None:
        """Queues a response."""
        size = self.faults.tcp_split or max(len(frame), 1)
        due = max(now + self.faults.tcp_delay, self._pieces[-1][0] if self._pieces else now)
        for start in range(0, len(frame), size):
            self._pieces.append((due, frame[start : start + size]))
            due += PIECE_GAP

    def take(self, now: float) -> list[bytes]:
        """Returns the pieces to send by `now`, [s]; the last one is cut off where the connection breaks."""
        pieces: list[bytes] = []
        while self._pieces and self._pieces[0][0] <= now and not self.is_broken:
            piece = self._pieces.popleft()[1]
            if self.faults.tcp_break is not None:
                piece = piece[: self.faults.tcp_break - self._sent]
            self._sent += len(piece)
            pieces.append(piece)
        return pieces
