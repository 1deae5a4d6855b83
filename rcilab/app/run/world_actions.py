"""Disturbs the network of our own controller, presses its safety buttons and wires its outputs."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from rcilab.app.app_state import AppState
from rcilab.app.connection import Connection
from rcilab.app.request import Handlers, Request
from rcilab.app.run.active_force import no_push
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.world_state import CABLE_PULLED, NETWORK_LAB, WorldState
from rcilab.app.state_store import StateStore
from rcilab.app.status_text import explain_error
from rcilab.core.errors import RcilabError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.execution.simulation_status_poller import SimulationStatusPoller
from rcilab.i18n.translator import message
from rcilab.sim.api import DIRECTIONS, AutoLimit, Direction, LoopBack, Network, NetworkFaults, Press, SetInput

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus


_SAFETY = "safety"  # Cause of the notices of a pressed button.
_WIRING = {"loop_back": LoopBack, "auto_limit": AutoLimit}


@dataclass(frozen=True, slots=True, kw_only=True)
class SetNetwork(Request):
    """Change the network of our own controller; None leaves a value unchanged."""

    name: str | None = None
    """One of `NETWORK_LAB`."""
    value: float = 0.0
    """[1] or [s]."""
    direction: str | None = None
    pulled: bool | None = None
    """Whether the cable is pulled."""
    clear: bool = False

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.name is None else f"network.{self.name}.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSafety(Request):
    """Press a safety button of our own controller."""

    button: Literal["none", "estop", "gstop"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SetWiring(Request):
    """Wire our own controller's outputs to its inputs, or make it stop commands inside the soft limits."""

    name: Literal["loop_back", "auto_limit"]
    on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SetVirtualInput(Request):
    """Switch a digital input of our own controller, by its number."""

    signal: int
    level: bool


class WorldActions:
    """Owned by the thread that changes the state; it never waits for the controller."""

    def __init__(self, store: StateStore[AppState], connection: Connection) -> None:
        self._store, self._connection = store, connection
        self._watch: SimulationStatusPoller | None = None
        self._address: str | None = None
        self._is_rewired = False  # The inputs that are shown were read before.

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            SetNetwork: self.set_network,
            PressSafety: self.press_safety,
            SetWiring: self.set_wiring,
            SetVirtualInput: self.set_input,
        }

    def set_network(self, request: SetNetwork) -> None:
        """Changes the network, or pulls or plugs the cable; numbers are clipped to their bounds."""
        watch = self._require_watch()
        if watch is None:
            return
        world = self._store.state.world
        network, direction, pulled = world.network, world.direction, world.pulled
        if request.clear:
            network, direction, pulled = NetworkFaults(), "both", False
        if request.name in NETWORK_LAB and math.isfinite(request.value):
            largest, _ = NETWORK_LAB[request.name]
            network = replace(network, **{request.name: min(max(request.value, 0.0), largest)})
        if request.direction in DIRECTIONS:
            direction: Direction = request.direction  # type: ignore[assignment]  # One of them.
        if request.pulled is not None:
            pulled = request.pulled
        self._store.update(world=replace(world, network=network, direction=direction, pulled=pulled))
        self._tell(watch)

    def press_safety(self, request: PressSafety) -> None:
        """Presses or releases the emergency stop, opens or closes the safety gate."""
        watch = self._require_watch()
        if watch is not None and request.button in ("none", "estop", "gstop"):
            watch.ask(Press(request.button))
            status = self._store.state.world.status
            self._store.clear_notices(_SAFETY)
            if request.button == "none" and status is not None and status.button != "none":
                self._store.notify("good", message(f"safety.{status.button}_over"))
            elif request.button != "none" and not is_moving(self._connection.status()):  # Else the stop is reported.
                self._store.notify("warn", message(f"safety.{request.button}_done"), cause=_SAFETY)

    def set_wiring(self, request: SetWiring) -> None:
        """Wires outputs to inputs, or stops commands at the soft limits; or ends that."""
        watch = self._require_watch()
        if watch is None or request.name not in _WIRING:
            return
        watch.ask(_WIRING[request.name](request.on))
        self._is_rewired |= request.name == "loop_back"
        self._store.update(world=replace(self._store.state.world, **{request.name: request.on}))

    def set_input(self, request: SetVirtualInput) -> None:
        """Switches an input of our own controller, which no longer follows an output that it is wired to."""
        watch = self._require_watch()
        if watch is None:
            return
        if self._store.state.world.loop_back:
            self.set_wiring(SetWiring(name="loop_back", on=False))
        watch.ask(SetInput(request.signal, request.level))
        self._is_rewired = True

    def tick(self, status: SupervisorStatus) -> None:
        """Follows the current controller and its reports; a new one has a good network."""
        address = status.world_address
        if address != self._address:
            self.close()
            self._address = None
            if address is not None:
                host, _, port = address.partition(":")
                self._watch = SimulationStatusPoller(SimulationControl(host, int(port)))
            self._address = address
            self._store.update(world=WorldState())
        if self._watch is None:
            return
        error = self._watch.pop_error()
        if error is not None:
            self._store.notify("bad", explain_error(error))
        is_settled, world, reported = self._watch.is_settled, self._store.state.world, self._watch.status
        if self._is_rewired and is_settled and status.phase in ("idle", "fault"):
            self._is_rewired = False
            with suppress(RcilabError):  # Then they are read with the next output.
                self._connection.robot().read_inputs()
        if reported is not world.status:
            world = replace(world, status=reported)
        if is_settled and reported is not None and reported.auto_limit not in (None, world.auto_limit):
            world = replace(world, auto_limit=reported.auto_limit)  # Another client or a restart may have changed it.
        if world is not self._store.state.world:
            self._store.update(world=world)

    def close(self) -> None:
        """Ends the connection."""
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()

    def _tell(self, watch: SimulationStatusPoller) -> None:
        world = self._store.state.world
        if world.pulled:
            watch.ask(Network(CABLE_PULLED))
            return
        if world.direction != "both":
            watch.ask(Network(NetworkFaults(), "states" if world.direction == "commands" else "commands"))
        watch.ask(Network(world.network, world.direction))

    def _require_watch(self) -> SimulationStatusPoller | None:
        if self._watch is None:
            reason = no_push(self._connection.status())
            if reason is not None and reason.code == "push.no_world":
                reason = message("world.not_ours", address=self._connection.status().target)
            self._store.notify("warn", reason or message("ready.starting"))
        return self._watch
