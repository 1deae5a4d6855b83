"""Simulated faults of network and clock."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Literal, TypeAlias, get_args

from rcilab.sim.api.fields import as_float, as_integer

Direction: TypeAlias = Literal["both", "commands", "states"]
"""Affected UDP datagrams: commands (to the controller), states (from it), or both."""
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)

LONGEST_DELAY = 1.0  # [s] A thousand datagrams in transit; a larger delay is not realistic.
LONGEST_TCP_DELAY = 10.0  # [s] Longer than any client waits.
LONGEST_STALL = 5.0  # [s] Longer than any client waits for a state.
LONGEST_TIME = 86400.0  # [s] Largest delay of a scheduled event: a day.


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkFaults:
    """Faults of the network between client and virtual controller. The default has none.

    Raises:
        InvalidValueError: A value is out of range; the message says which.
    """

    loss: float = 0.0
    """Share of the datagrams that never arrive, 0 to 1."""
    delay: float = 0.0
    """Minimum delay of a datagram, [s]."""
    jitter: float = 0.0
    """Largest random delay in addition, uniformly distributed, [s]. The order is kept."""
    reorder: float = 0.0
    """Share of the datagrams that are held back until later ones have overtaken them, 0 to 1."""
    duplicate: float = 0.0
    """Share of the datagrams that arrive twice, 0 to 1."""
    corrupt: float = 0.0
    """Share of the datagrams in which one bit is flipped, 0 to 1. Real networks drop most of these (checksum)."""
    tcp_delay: float = 0.0
    """Additional delay of a TCP response, [s]."""
    tcp_split: int = 0
    """TCP responses arrive in pieces of so many bytes, some time apart; 0: in one piece."""
    tcp_break: int | None = None
    """The TCP connection breaks after so many bytes of responses; None: never."""
    seed: int = 0
    """Of the random numbers: equal seeds and equal traffic give equal faults."""

    def __post_init__(self) -> None:
        """Checks every value."""
        for name in ("loss", "reorder", "duplicate", "corrupt"):
            _put(self, name, as_float(getattr(self, name), name, "", 0.0, 1.0))
        for name in ("delay", "jitter"):
            _put(self, name, as_float(getattr(self, name), name, "s", 0.0, LONGEST_DELAY))
        _put(self, "tcp_delay", as_float(self.tcp_delay, "tcp_delay", "s", 0.0, LONGEST_TCP_DELAY))
        _put(self, "tcp_split", as_integer(self.tcp_split, "tcp_split", 0, 65535))
        if self.tcp_break is not None:
            _put(self, "tcp_break", as_integer(self.tcp_break, "tcp_break", 0, 2**31))
        _put(self, "seed", as_integer(self.seed, "seed", 0, 2**32 - 1))

    @property
    def is_udp_clean(self) -> bool:
        """Whether UDP is not affected."""
        return not (self.loss or self.delay or self.jitter or self.reorder or self.duplicate or self.corrupt)

    @property
    def is_tcp_clean(self) -> bool:
        """Whether TCP is not affected."""
        return not (self.tcp_delay or self.tcp_split) and self.tcp_break is None

    def as_dict(self) -> dict[str, Any]:
        """Returns every field by its name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Stall:
    """A pause of the controller's clock: no motion, no reception, no states meanwhile.

    Raises:
        InvalidValueError: A value is out of range, or the pauses would leave no time between them.
    """

    duration: float
    """Duration of the pause, [s]."""
    after: float = 0.0
    """Time of the first pause after the request, or after the start of the controller, [s]."""
    period: float | None = None
    """Time from the start of one pause to the start of the next, [s]; None: once."""

    def __post_init__(self) -> None:
        """Checks every value."""
        _put(self, "duration", as_float(self.duration, "duration", "s", 0.001, LONGEST_STALL))
        _put(self, "after", as_float(self.after, "after", "s", 0.0, LONGEST_TIME))
        if self.period is not None:
            _put(self, "period", as_float(self.period, "period", "s", self.duration + 0.001, LONGEST_TIME))


def _put(owner: object, name: str, value: object) -> None:
    object.__setattr__(owner, name, value)
