"""The operator's changes of the virtual controller: its network, its wiring, its buttons."""

from __future__ import annotations

from dataclasses import dataclass, field

from rcilab.sim.api import Direction, NetworkFaults, WorldStatus

CABLE_PULLED = NetworkFaults(loss=1.0, tcp_delay=10.0)
"""No datagram arrives, and TCP is silent."""
NETWORK_LAB: dict[str, tuple[float, str]] = {
    "loss": (0.3, "%"),
    "delay": (0.05, "ms"),
    "jitter": (0.05, "ms"),
    "reorder": (0.3, "%"),
    "duplicate": (0.3, "%"),
}
"""The sliders: largest value, [1] or [s], and the unit on the page. Tuning values: a larger one ends any motion."""


@dataclass(frozen=True, eq=False, kw_only=True)
class WorldState:
    """Settings of the virtual controller that is connected; another one has the defaults."""

    pulled: bool = False
    """Whether its network cable is pulled."""
    network: NetworkFaults = field(default_factory=NetworkFaults)
    direction: Direction = "both"
    loop_back: bool = False
    """Whether its outputs are wired to its inputs."""
    auto_limit: bool = False
    """Whether it stops commands inside the soft joint limits."""
    status: WorldStatus | None = None
    """The status that it reports; None: it is not a virtual controller of ours, or does not answer."""
