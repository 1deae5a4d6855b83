"""The environment of a virtual robot: forces, boxes, buttons, signals, network, clock; and requests to change it.

Requests are handled in the thread of the controller between two cycles and take effect in the next cycle. In lock-step,
runs with the same requests at the same cycles have the same result.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass

from rcilab.core.clock import Clock
from rcilab.core.errors import InvalidValueError, RcilabError, UsageError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import Pose
from rcilab.sim.api import (
    AutoLimit,
    Done,
    Floor,
    GetStatus,
    Guide,
    Limits,
    LoopBack,
    Mount,
    Network,
    OnLoss,
    PlaceArm,
    PlaceBox,
    Press,
    Push,
    Refused,
    Release,
    RemoveBox,
    SetBox,
    SetInput,
    SetLoad,
    SetSoftLimits,
    SetTool,
    StallClock,
    Walls,
    WorldAnswer,
    WorldRequest,
    WorldStatus,
)
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.controller_config import CONTROLLER_OPTIONS, require_option
from rcilab.sim.faulty_network import FaultyNetwork
from rcilab.sim.force_profile import ForceProfile
from rcilab.sim.maker_server import SimulatedController
from rcilab.sim.setup_requests import SetupInForce, SetupRequest, as_setup, describe_setup
from rcilab.sim.streamed_motion import require_loss_behaviour


@dataclass(frozen=True, slots=True)
class ServerCounters:
    """Counters of the server: skipped cycles, malformed datagrams, and foreign datagrams."""

    missed: int
    bad_datagrams: int
    unknown_senders: int


class Environment:
    """Handles requests of the simulation port. Owned by the thread that runs the controller.

    Args:
        controller: The controller.
        network: Its network.
        stalls: Stalls of its clock.
        clock: Clock for the stalls.
        counters: Returns the counters of the server.
        record: Returns the descriptor of the record of all cycles; -1 without one.
        options: Those of `CONTROLLER_OPTIONS` that the arm's controller has.
        log: Takes an entry of the log: kind, text and facts; None: there is no log.
    """

    def __init__(
        self,
        controller: SimulatedController,
        network: FaultyNetwork,
        stalls: StallSchedule,
        clock: Clock,
        counters: Callable[[], ServerCounters],
        record: Callable[[], int] = lambda: -1,
        options: Collection[str] = CONTROLLER_OPTIONS,
        log: Callable[..., None] | None = None,
    ) -> None:
        self._controller = controller
        self._plant = controller.arm.plant
        self._network = network
        self._stalls = stalls
        self._clock = clock
        self._counters = counters
        self._record, self._log, self._options = record, log, options
        self._parameters = controller.arm.parameters
        self._setup = SetupInForce.of(self._parameters)  # Kept, because it takes longer than the rest of a status.
        self._push = ForceProfile()
        self._has_walls = False
        self._walls: SafetyBox | None = None

    def handle(self, request: WorldRequest) -> WorldAnswer:
        """Carries out a request and returns the response."""
        if isinstance(request, GetStatus):
            return self._status()
        try:
            self._change(request)
        except RcilabError as error:
            facts = {name: fact if isinstance(fact, int | float) else str(fact) for name, fact in error.facts.items()}
            return Refused(str(error), error.code, facts)
        return Done()

    def step(self) -> None:
        """Updates the external force and moves walls; called after every cycle."""
        if self._push.step():
            self._apply_push()
        if self._has_walls and self._active_box() is not self._walls:
            self._walls = self._active_box()
            self._plant.set_walls(self._walls)

    def _active_box(self) -> SafetyBox | None:
        return active_box(self._controller.safety_box)

    def _change(self, request: WorldRequest) -> None:
        match request:
            case Push():
                self._plant.push(request.wrench, request.link, request.point)  # Raises if the link does not exist.
                self._push.begin(request)
                self._apply_push()
            case Release():
                if self._controller.button != "none" and not self._push.is_on:
                    raise UsageError("no external force acts on the arm; press button=none ends an emergency stop")
                self._push.release()
                self._apply_push()
            case Press(button):
                known = self._controller.buttons
                if button not in ("none", *known):
                    raise InvalidValueError("button", button, f"does not exist on this arm; known: {', '.join(known)}")
                self._controller.press_button(button)
            case Guide(on):
                self._controller.guide(on)
            case SetInput(signal, level):
                self._controller.set_input(signal, level)
                what = f"digital input {signal} set {'high' if level else 'low'}, by the simulation port"
                self._log_change(request, what)
            case LoopBack(on):
                self._require_option(request, on)
                self._controller.loop_back = on
            case AutoLimit(on):
                self._require_option(request, on)
                self._controller.auto_limit = on
            case Limits(table):
                self._controller.limit_table = table
            case OnLoss(behaviour):
                self._require_option(request, behaviour)
                self._controller.arm.on_loss = require_loss_behaviour(behaviour)
                what = f"on_loss set to {behaviour} from the next motion on, by the simulation port"
                self._log_change(request, what)
            case Network(faults, direction):
                self._network.replace(faults, direction)
            case StallClock():
                self._stalls.replace([] if request.stall is None else [request.stall], self._clock.now())
            case PlaceBox(box, size, position, wxyz):
                self._plant.place_box(box, size, Pose(position, wxyz))
            case RemoveBox(box):
                self._plant.remove_box(box)
            case Floor(on):
                self._plant.set_floor(on)
            case Walls(on):
                if on:
                    self._plant.require_contact("walls")  # Also without an active box: one may follow.
                self._plant.set_walls(self._active_box() if on else None)
                self._has_walls, self._walls = on, self._active_box()
            case Mount():
                load = SetLoad(request.mass or 0.0, request.center_of_mass, request.inertia)
                self._plant.mount(None if request.mass is None else as_setup(load).load)
            case PlaceArm() | SetTool() | SetLoad() | SetBox() | SetSoftLimits():
                self._controller.set_up(as_setup(request, self._controller.safety_box))
                self._log_change(request, describe_setup(request))
            case GetStatus():
                pass  # Answered before; it changes nothing.

    def _require_option(self, request: LoopBack | AutoLimit | OnLoss, value: object) -> None:
        require_option(request.name, value, self._options, self._controller.arm.model.name)

    def _log_change(self, request: SetupRequest | OnLoss | SetInput, text: str) -> None:
        if self._log is not None:
            self._log("set_up", text, request=request.name, **asdict(request))

    def _apply_push(self) -> None:
        self._plant.push(self._push.wrench, self._push.push.link, self._push.push.point)

    def _status(self) -> WorldStatus:
        controller, counters = self._controller, self._counters()
        commands, states = self._network.faults
        if controller.arm.parameters is not self._parameters:
            self._parameters, self._setup = controller.arm.parameters, SetupInForce.of(controller.arm.parameters)
        setup = self._setup
        return WorldStatus(
            model=controller.arm.model.name,
            plant=self._plant.kind,
            cycle=controller.cycle_number,
            phase=controller.phase_name,
            faults=tuple(fault.manual_name for fault in controller.faults),
            reason=controller.reason,
            button=controller.button,
            q=tuple(controller.arm.signals.measured.q.tolist()),
            lost=controller.arm.playout.lost,
            lost_in_row=controller.arm.playout.max_consecutive_lost,
            success_rate=controller.arm.playout.success_rate,
            missed=counters.missed,
            bad_datagrams=counters.bad_datagrams,
            unknown_senders=counters.unknown_senders,
            ignored=controller.ignored,
            pushed=self._push.is_on,
            stalls=self._stalls.count,
            auto_limit=controller.auto_limit,
            commands=commands,
            states=states,
            pid=os.getpid(),
            record=self._record(),
            tool=setup.tool,
            load=setup.load,
            box=setup.box,
            soft_limits=setup.soft_limits,
            inputs=controller.inputs,
            on_loss=controller.arm.on_loss,
        )
