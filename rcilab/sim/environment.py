"""The environment of a virtual robot: forces, boxes, buttons, signals, network, clock; and requests to change it.

Requests are handled in the thread of the controller between two cycles and take effect in the next cycle. In lock-step,
runs with the same requests at the same cycles have the same result.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rcilab.core.clock import Clock
from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.api import (
    AutoLimit,
    Done,
    Floor,
    GetStatus,
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
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.clock_stalls import StallSchedule
from rcilab.sim.faulty_network import FaultyNetwork
from rcilab.sim.force_profile import ForceProfile
from rcilab.sim.maker_server import SimulatedController
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
    """

    def __init__(
        self,
        controller: SimulatedController,
        network: FaultyNetwork,
        stalls: StallSchedule,
        clock: Clock,
        counters: Callable[[], ServerCounters],
        record: Callable[[], int] = lambda: -1,
    ) -> None:
        self._controller = controller
        self._plant = controller.arm.plant
        self._network = network
        self._stalls = stalls
        self._clock = clock
        self._counters = counters
        self._record = record
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
                self._controller.press_button(button)
            case SetInput(signal, level):
                self._controller.set_input(signal, level)
            case LoopBack(on):
                self._controller.loop_back = on
            case AutoLimit(on):
                self._controller.auto_limit = on
            case Limits(table):
                self._controller.limit_table = table
            case OnLoss(behaviour):
                self._controller.arm.on_loss = require_loss_behaviour(behaviour)
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
                self._plant.set_walls(self._active_box() if on else None)
                self._has_walls, self._walls = on, self._active_box()
            case Mount():
                self._plant.mount(None if request.mass is None else _payload(request, request.mass))
            case PlaceArm(q):
                self._controller.set_up(ArmSetup(q=q))
            case SetTool(position, wxyz):
                self._controller.set_up(ArmSetup(T_flange_tool=Pose(position, wxyz)))
            case SetLoad(mass):
                self._controller.set_up(ArmSetup(load=_payload(request, mass)))
            case SetBox(size, position, wxyz, active):
                box = SafetyBox(size=size, T_base_box=Pose(position, wxyz), active=active)
                self._controller.set_up(ArmSetup(safety_box=box))
            case SetSoftLimits(lower, upper):
                self._controller.set_up(ArmSetup(soft_limits=(lower, upper)))
            case GetStatus():
                pass  # Answered before; it changes nothing.

    def _apply_push(self) -> None:
        self._plant.push(self._push.wrench, self._push.push.link, self._push.push.point)

    def _status(self) -> WorldStatus:
        controller, counters = self._controller, self._counters()
        commands, states = self._network.faults
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
        )


def _payload(request: Mount | SetLoad, mass: float) -> Payload:
    inertia = np.array(request.inertia).reshape(3, 3)
    return Payload(mass=mass, center_of_mass=np.array(request.center_of_mass), inertia=inertia)
