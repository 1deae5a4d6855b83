"""How a virtual controller is configured."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.sim.api import NetworkFaults, Stall
from rcilab.sim.streamed_motion import PREFILL

PlantKind: TypeAlias = Literal["ideal", "mujoco"]
PLANT_KINDS: tuple[PlantKind, ...] = get_args(PlantKind)

DEFAULT_HOST = "127.0.0.2"
"""Loopback, but not the client's own address: a vendor's client may bind the UDP port of every address of its machine,
as that of the RCI does, and would otherwise receive its own commands as states."""

SUPERVISED_PREFILL = 40
"""`prefill` of the page's own controller, [cycles]: an open browser causes pauses of tens of ms. Beside `PREFILL` and
`TORQUE_PREFILL`, which are for a client alone."""
MODE_DELAY = 0.2
"""From StartMove to the requested modes, [s]; by then a vendor client's buffer is full of idle states, which it
skips."""
LOCKSTEP_MODE_DELAY = 0.02  # [s]
VENDOR_MODE_DELAY = 1.05
"""For a vendor's client with any buffer, [s]: it sleeps for 1 s after StartMove, then answers the states in it."""

FEWEST_LOST, MOST_LOST = 10, 20  # Manual 4.6: the packet-loss threshold is usually 10 to 20.


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerConfig:
    """Everything about a virtual controller that can be chosen.

    Raises:
        InvalidValueError: A value is out of range; the message says which and why.
    """

    model: str
    """Name of the arm, such as xMatePro7."""
    host: str = DEFAULT_HOST
    """Address to listen on."""
    port: int | None = None
    """TCP port; 0 takes any free one; None: the one that the maker's clients expect."""
    udp_port: int | None = None
    """UDP port for commands; None: the same number as the TCP port, as the vendor's client expects it; 0: any."""
    client_host: str | None = None
    """Where states go from power-up on; None: to the client that connects, from then on."""
    client_port: int | None = None
    """UDP port where states go; None: the number of our TCP port, as the vendor's client expects it."""
    plant: PlantKind = "ideal"
    """What moves: an arm that follows exactly, or a simulated one."""
    lockstep: bool = False
    """Whether a motion advances only when the command for the current state has come, instead of at 1 kHz."""
    mode_delay: float | None = None
    """From StartMove to the requested modes, [s]; None: 0.2, or 0.02 in lock-step."""
    prefill: int | None = None
    """Cycles by which commands are played late, to absorb jitter; None: 10, and 2 for torques, or 0 in lock-step."""
    patience: float | None = None
    """How long lock-step waits for a command before it counts as lost, [s]; None: 60, so that a client may stand still
    for a while, or 0.05 while the network spoils datagrams on purpose."""
    lost_limit: int | None = MOST_LOST
    """Lost cycles in a row that are an instability, 10 to 20; None: any number is bridged."""
    auto_limit: bool = False
    """Whether commanded joint angles are led to rest inside the soft limits, instead of raising a fault beyond them."""
    loop_back: bool = False
    """Whether every digital output is wired to the input of the same number."""
    limit_table: str = "manual"
    """Whose Cartesian limits commands are checked against: the manual's, or those of the vendor's SDK."""
    network: NetworkFaults = field(default_factory=NetworkFaults)
    """What is wrong with the network, from power-up on."""
    states_network: NetworkFaults | None = None
    """The same for the way to the client alone, states and TCP; None: as `network`, which is for commands then."""
    stalls: tuple[Stall, ...] = ()
    """Pauses of the controller's clock; their `after` counts from the beginning of `run`."""
    world_port: int | None = 0
    """TCP port on loopback through which things happen to the robot from outside; 0: any free one, None: there is
    none."""
    realtime: bool = True
    """Whether to ask for SCHED_FIFO and locked memory; never done in lock-step, where nothing is late."""
    parent_pid: int | None = None
    """Process without which this one shall end, its parent; None: it lives by itself."""

    def __post_init__(self) -> None:
        """Checks every value."""
        for name in ("port", "udp_port", "client_port", "world_port"):
            port = getattr(self, name)
            lowest = 1 if name == "client_port" else 0
            if port is not None and not lowest <= port <= 65535:
                raise InvalidValueError(name, port, f"is no port; needs {lowest} to 65535")
        if not self.host:
            raise InvalidValueError("host", self.host, "is no address; use 127.0.0.2 for this machine only")
        if self.plant not in PLANT_KINDS:
            raise InvalidValueError("plant", self.plant, f"is unknown; known: {', '.join(PLANT_KINDS)}")
        if self.mode_delay is not None and not 0.0 <= self.mode_delay <= 5.0:
            raise InvalidValueError("mode_delay", self.mode_delay, "needs 0 to 5 s")
        if self.patience is not None and not 0.01 <= self.patience <= 3600.0:
            raise InvalidValueError("patience", self.patience, "needs 0.01 to 3600 s")
        if self.prefill is not None and not 0 <= self.prefill <= 100:
            raise InvalidValueError("prefill", self.prefill, "needs 0 to 100 cycles")
        if self.lost_limit is not None and not FEWEST_LOST <= self.lost_limit <= MOST_LOST:
            raise InvalidValueError(
                "lost_limit",
                self.lost_limit,
                f"needs {FEWEST_LOST} to {MOST_LOST} cycles; None, or 0 on the command line, is no limit",
            )

    @property
    def mode_delay_cycles(self) -> int:
        """Cycles from StartMove to the requested modes."""
        delay = self.mode_delay if self.mode_delay is not None else LOCKSTEP_MODE_DELAY if self.lockstep else MODE_DELAY
        return round(delay / CYCLE_TIME)

    @property
    def prefill_cycles(self) -> int:
        """Cycles by which commands are played late."""
        return self.prefill if self.prefill is not None else 0 if self.lockstep else PREFILL
