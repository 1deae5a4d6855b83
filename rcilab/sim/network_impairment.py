"""A bad network, as pure functions of what is sent, when, and a seed: no sockets, no clock.

Every fault is drawn for each datagram on its own, in this order: loss, corruption, duplication, and for each copy its
delay. Delays keep the order of the datagrams, except of those that `reorder` holds back.
"""

from __future__ import annotations

import heapq
from collections import deque
from itertools import count
from random import Random

from rcilab.sim.api import NetworkFaults

__all__ = ["HOLD_TIME", "PIECE_GAP", "DelayedDatagrams", "Impairment", "NetworkFaults", "SlowStream"]

HOLD_TIME = 0.0025  # [s] By which a reordered datagram is late: two others of a 1 kHz stream overtake it.
PIECE_GAP = 0.002  # [s] Between the pieces of a split answer, so that they arrive as pieces.
MOST_HELD = 4096  # Datagrams on their way at once, four times what a delay of 1 s needs; more are lost, as in a router.


class Impairment:
    """What a bad network makes of the datagrams of one direction.

    Args:
        faults: What is wrong with it.
        stream: Name of the direction; both draw different random numbers from one seed.
    """

    def __init__(self, faults: NetworkFaults, stream: str = "") -> None:
        self._faults = faults
        self._random = Random(f"{faults.seed} {stream}")
        self._last_due = float("-inf")

    def apply(self, datagram: bytes, now: float) -> list[tuple[bytes, float]]:
        """Returns what arrives of a datagram sent `now`, [s], and when: nothing, once, or twice."""
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
        spoiled = bytearray(datagram)
        bit = self._random.randrange(8 * len(spoiled))
        spoiled[bit // 8] ^= 1 << bit % 8
        return bytes(spoiled)


class DelayedDatagrams:
    """One direction of a bad network with the datagrams that are on their way in it.

    Args:
        faults: What is wrong with it.
        stream: Name of the direction.
    """

    def __init__(self, faults: NetworkFaults, stream: str) -> None:
        self._stream = stream
        self.replace(faults)
        self._waiting: list[tuple[float, int, bytes]] = []
        self._order = count()

    @property
    def next_due(self) -> float:
        """When the next datagram arrives, [s]; infinity: none is on its way."""
        return self._waiting[0][0] if self._waiting else float("inf")

    @property
    def is_clean(self) -> bool:
        """Whether there is no fault and no datagram on its way, so that datagrams may pass directly."""
        return self._spares and not self._waiting

    def put(self, datagram: bytes, now: float) -> bool:
        """Sends a datagram on its way; returns whether it will arrive, be it spoiled."""
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
        """Changes the faults; datagrams already on their way arrive as they would have."""
        self.faults = faults
        self._spares = faults.spares_datagrams
        self._impairment = Impairment(faults, self._stream)


class SlowStream:
    """The answers of one TCP connection on their way through a bad network.

    Args:
        faults: What is wrong with it.
    """

    def __init__(self, faults: NetworkFaults) -> None:
        self.faults = faults
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._sent = 0

    @property
    def next_due(self) -> float:
        """When the next piece has to go out, [s]; infinity: none waits."""
        return self._pieces[0][0] if self._pieces else float("inf")

    @property
    def is_clean(self) -> bool:
        """Whether nothing is wrong and nothing waits, so that answers may take the direct way."""
        return not self._pieces and self.faults.spares_tcp

    @property
    def is_broken(self) -> bool:
        """Whether the connection has carried as many bytes as it ever will."""
        return self.faults.tcp_break is not None and self._sent >= self.faults.tcp_break

    def put(self, frame: bytes, now: float) -> None:
        """Sends an answer on its way."""
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
