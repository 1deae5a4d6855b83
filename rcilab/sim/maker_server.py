"""What a maker brings of its virtual controller: the arm's behaviour, and a server for its wire. No sockets, no clock.

`ArmServer` opens the channels, hands over what arrives, and calls `step`, `send_states` and `settle` once a cycle. A
maker's server answers through the `Link`; what it finds out about the arm it has from `VirtualArm.step`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rcilab.core.fault import FaultCode
from rcilab.core.safety_box import SafetyBox
from rcilab.i18n.translator import Remark
from rcilab.sim.api import SafetyButton
from rcilab.sim.channels import Channel, Link, Peer
from rcilab.sim.virtual_arm import VirtualArm


class SimulatedController(Protocol):
    """A controller of any maker without its wire, as its surroundings and the clock see it."""

    ignored: int
    """Commands that came while none was expected."""

    @property
    def loop_back(self) -> bool:
        """Whether every digital output is wired to the input of the same number."""
        ...

    @loop_back.setter
    def loop_back(self, on: bool) -> None: ...

    @property
    def auto_limit(self) -> bool:
        """Whether commanded joint angles are stopped inside the soft limits instead of raising a fault."""
        ...

    @auto_limit.setter
    def auto_limit(self, on: bool) -> None: ...

    @property
    def limit_table(self) -> str:
        """Whose limits of the tool's motion apply: "manual", or another of the maker's tables."""
        ...

    @limit_table.setter
    def limit_table(self, table: str) -> None: ...

    @property
    def arm(self) -> VirtualArm:
        """What moves, with its sensors and the queue of commands."""
        ...

    @property
    def cycle_number(self) -> int:
        """The number of the last state."""
        ...

    @property
    def phase_name(self) -> str:
        """What the robot is doing, such as "idle"."""
        ...

    @property
    def faults(self) -> tuple[FaultCode, ...]:
        """The faults that are set."""
        ...

    @property
    def reason(self) -> Remark:
        """Why the last fault was raised."""
        ...

    @property
    def safety_box(self) -> SafetyBox | None:
        """The safety box that is configured."""
        ...

    @property
    def button(self) -> SafetyButton:
        """Which emergency stop is pressed."""
        ...

    def press_button(self, button: SafetyButton) -> None:
        """Presses an emergency stop, or releases it."""
        ...

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input."""
        ...

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves, or follows commands that would move it."""
        ...

    @property
    def wants_commands(self) -> bool:
        """Whether a motion of the client's is in progress that needs a command a cycle; never for planned motions."""
        ...

    @property
    def is_starved(self) -> bool:
        """Whether such a motion is in progress and its next command is not there."""
        ...

    @property
    def lacks_commands(self) -> bool:
        """Whether a fault is set that a lack of commands raises."""
        ...


class MakerServer(Protocol):
    """The virtual side of a maker's wire. Owned by the loop of `ArmServer`."""

    @property
    def scheme(self) -> str:
        """URL scheme of its address."""
        ...

    @property
    def channels(self) -> Sequence[Channel]:
        """What it listens on: at least one TCP channel, the main one first."""
        ...

    @property
    def controller(self) -> SimulatedController:
        """The arm's controller."""
        ...

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves and no answer waits: a cycle may then be computed early, and answers come late."""
        ...

    def attach(self, link: Link) -> None:
        """Takes what it sends with; called once, before anything else."""
        ...

    def connect(self, peer: Peer) -> None:
        """Takes a new client."""
        ...

    def disconnect(self, peer: Peer) -> bool:
        """Takes that a client is gone; returns whether this ends a motion, or would have to."""
        ...

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Takes a frame, as the channel's framer cut it."""
        ...

    def receive_datagram(self, datagram: bytes) -> bool:
        """Takes a datagram of the client's; returns whether it is well formed."""
        ...

    def step(self, *, is_seen: bool = True) -> None:
        """Advances by one cycle.

        Args:
            is_seen: Whether its state is sent. One that is not has no number of its own.
        """
        ...

    def send_states(self) -> None:
        """Sends what is due in this cycle; called again in lock-step for a client that has not answered."""
        ...

    def settle(self) -> None:
        """Gives the answers that had to wait for the state just sent."""
        ...

    def begin_shutdown(self) -> int:
        """Stops the arm in a way that its client notices; returns for how many cycles states are still to be sent."""
        ...
