"""The maker's part of a virtual controller: its behaviour, and a server for its protocol, without sockets or clock.

`ArmServer` opens the channels, passes arrivals on, and calls `step`, `send_states` and `settle` once per cycle. A
maker's server sends through the `ClientLink`; `VirtualArm.step` returns the violations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rcilab.core.fault import FaultCode
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import RobotState
from rcilab.i18n.translator import Remark
from rcilab.sim.api import SafetyButton
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.channels import Channel, ClientLink, Peer
from rcilab.sim.virtual_arm import VirtualArm


class SimulatedController(Protocol):
    """A controller of any maker without its protocol, as used by the environment and the server."""

    ignored: int
    """Number of commands that arrived while none was expected."""

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
        """The arm, with its sensors and the queue of commands."""
        ...

    @property
    def state(self) -> RobotState:
        """The last state."""
        ...

    @property
    def cycle_number(self) -> int:
        """Number of the last state."""
        ...

    @property
    def phase_name(self) -> str:
        """Phase of the controller, such as "idle"."""
        ...

    @property
    def faults(self) -> tuple[FaultCode, ...]:
        """The faults that are set."""
        ...

    @property
    def reason(self) -> Remark:
        """Reason for the last fault."""
        ...

    @property
    def safety_box(self) -> SafetyBox | None:
        """The configured safety box."""
        ...

    @property
    def buttons(self) -> tuple[SafetyButton, ...]:
        """The emergency stops that it has."""
        ...

    @property
    def button(self) -> SafetyButton:
        """The pressed emergency stop."""
        ...

    def press_button(self, button: SafetyButton) -> None:
        """Presses or releases an emergency stop."""
        ...

    def guide(self, on: bool) -> None:
        """Begins or ends hand guiding by the buttons of the arm.

        Raises:
            UsageError: The arm has no such buttons, or cannot be guided now.
        """
        ...

    def set_up(self, setup: ArmSetup) -> None:
        """Sets the arm up as on its teach pendant; a reboot keeps it.

        Raises:
            InvalidValueError: A value is out of its bounds, or the arm cannot stand at the joint angles.
            UsageError: The arm moves, follows commands or is guided.
        """
        ...

    @property
    def inputs(self) -> tuple[int, ...]:
        """Numbers of the digital inputs that are high."""
        ...

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input."""
        ...

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves or follows commands."""
        ...

    @property
    def is_between_motions(self) -> bool:
        """Whether the arm stands after a motion that the controller planned, though it may still follow the planner."""
        ...

    @property
    def wants_commands(self) -> bool:
        """Whether a motion is in progress that needs one command per cycle; False for planned motions."""
        ...

    @property
    def awaits_start(self) -> bool:
        """Whether such a motion has begun for its client, which may still read states before its first command."""
        ...

    @property
    def is_starved(self) -> bool:
        """Whether such a motion is in progress and its next command has not arrived."""
        ...

    @property
    def lacks_commands(self) -> bool:
        """Whether a fault is set that is caused by missing commands."""
        ...


class MakerServer(Protocol):
    """The server side of a maker's protocol. Owned by the loop of `ArmServer`."""

    @property
    def scheme(self) -> str:
        """URL scheme of its address."""
        ...

    @property
    def channels(self) -> Sequence[Channel]:
        """Its channels: at least one of TCP, the main one first."""
        ...

    @property
    def controller(self) -> SimulatedController:
        """The arm's controller."""
        ...

    @property
    def patience(self) -> float:
        """How long a cycle of a motion waits for its command outside of lock-step, [s]; 0: not at all.

        The controller then follows a client that does not keep real time, as in lock-step, but never faster than 1 kHz;
        see `ArmServer`. The configuration may replace it.
        """
        ...

    @property
    def clocks_clients(self) -> bool:
        """Whether its clients answer the state of each cycle of a motion."""
        ...

    @property
    def is_quiet(self) -> bool:
        """Whether nothing moves and no response is pending: a cycle may then be computed early."""
        ...

    def attach(self, link: ClientLink) -> None:
        """Sets the link for sending; called once, before anything else."""
        ...

    def connect(self, peer: Peer) -> None:
        """Handles a new client."""
        ...

    def disconnect(self, peer: Peer) -> bool:
        """Handles the end of a connection; returns whether this ends a motion."""
        ...

    def receive(self, peer: Peer, frame: bytes) -> None:
        """Handles a frame from the channel's framer."""
        ...

    def receive_datagram(self, datagram: bytes) -> bool:
        """Handles a datagram of the client; returns whether it is well formed."""
        ...

    def step(self, *, is_sent: bool = True) -> None:
        """Advances by one cycle.

        Args:
            is_sent: Whether its state is sent; only such a cycle gets a message id.
        """
        ...

    def send_states(self) -> None:
        """Sends the states of this cycle; called again in lock-step for a client that has not answered."""
        ...

    def settle(self) -> None:
        """Sends the responses that had to follow the state just sent."""
        ...

    def begin_shutdown(self) -> int:
        """Stops the arm and notifies its client; returns the number of cycles for which states are still to be sent."""
        ...
