"""Drives the robot at the operator's requests. Owned by the dispatcher's thread; it never waits for the robot."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal

from rcilab.app.cell.cell_state import is_cell_pending, solid_cell
from rcilab.app.connection import PageConnection
from rcilab.app.goal.goal import Goal, Tone, goal_at
from rcilab.app.request import Handlers, Moving, Request
from rcilab.app.run.active_force import GUIDING_KINDS, TOOL, is_guided
from rcilab.app.run.mode_parameters import CONFIRM_TIMEOUT
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.readiness import obstacle, pulled_cable
from rcilab.app.run.robot_requests import Outcome, RobotRequests
from rcilab.app.setup.configuration_state import SetupState, drawn_parts, name_parts, setup_obstacle
from rcilab.app.state_store import ROBOT_NOT_READY
from rcilab.app.status_text import StartingError, describe_incident, explain_error
from rcilab.app.store import Store, UiState
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import (
    SAFETY_STOP,
    CertificateError,
    ConnectionLostError,
    ControlError,
    PlanningError,
    RcilabError,
    UsageError,
)
from rcilab.i18n.translator import Message, message
from rcilab.makers.driver import parse_address
from rcilab.makers.maker import capabilities_of
from rcilab.model.robot_model import load_model
from rcilab.sim.controller_config import PLANT_KINDS

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest, SupervisorStatus
    from rcilab.makers.configuration import RobotConfiguration, SetupPart

_POWER_PAUSE = 2.0  # [s] Between two attempts to switch the virtual arm on.


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotCommand(Moving):
    """A button of the Run tab."""

    what: Literal[
        "execute", "confirm", "cancel", "stop", "recover", "power_on", "power_off", "reconnect", "guide", "unguide",
        "pause", "resume", "disconnect",
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseRobot(Request):
    """Choose another arm, another destination, or another plant of the virtual controller."""

    model: str | None = None
    target: str | None = None
    plant: str | None = None
    """"ideal" or "mujoco"."""


class RunActions:
    """Execute, stop, power, recover, connect; and the recording of the run."""

    def __init__(self, store: Store, connection: PageConnection) -> None:
        self._store, self._connection = store, connection
        self.requests = RobotRequests(store, connection)
        self._is_stop_said = False  # The safety stop that ended the last motion was reported with its error.
        self._placed = False  # The goal was set to the arm's first position.
        self._powered = False  # The virtual arm's motors have been switched on once.
        self._power_asked = float("-inf")
        self._arrival: Message | None = None  # Message for the end of the motion in progress.
        self._untouched: Goal | None = store.state.goal  # The goal, until the operator changes it.
        self._setups: dict[str, SetupState] = {}  # Configurations of the arms chosen before, by name.
        self._incident = 0
        self._open_incident = ""  # Code of the incident that has not ended yet.
        self._phase = ""
        self._reached: float | None = None  # [s] Time of the plan that the moving arm has reached.
        self._guided = False
        self._asked_to_guide = -math.inf

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            ChooseRobot: self.choose_robot,
        }

    def drive(self, request: RobotCommand) -> None:
        """Passes a button of the Run tab to the supervisor."""
        if request.what in ("execute", "confirm"):
            self._execute(is_agreed=request.what == "confirm", stops=request.stops)
            return
        if request.what == "cancel":
            self._store.update(asked=None)
            return
        if request.what == "stop":
            self._connection.stop()
            if self._store.state.watched:
                self._store.notify("warn", message("watch.stop"))
            return
        if request.what == "disconnect":
            if is_moving(self._connection.status()):
                self._store.notify("warn", message("notice.moving"))
            else:
                self.disconnect()
            return
        status = self._connection.status()
        if request.what != "reconnect" and status.phase in ("starting", "connecting", "lost", "crashed"):
            self._store.notify("warn", obstacle(self._store.state, status) or message("ready.starting"))
            return
        supervisor = self._connection.robot()
        act = {
            "recover": supervisor.recover,
            "power_on": supervisor.power_on,
            "power_off": supervisor.power_off,
            "reconnect": supervisor.reconnect,
            "guide": partial(self._guide, request.stops),
            "unguide": supervisor.stop_guiding,
        }[request.what]
        sent = act()
        if sent is not None:
            self.requests.add(request.what, sent)

    def _guide(self, stops: int | None) -> PendingRequest | None:
        """Starts hand guiding; for a real arm only after a confirmation."""
        state, now = self._store.state, time.monotonic()
        unset = setup_obstacle(state, self._connection.status())
        if unset is not None:
            self._store.notify("warn", unset)
            return None
        if state.target != "virtual" and now - self._asked_to_guide > CONFIRM_TIMEOUT:
            self._asked_to_guide = now
            self._store.notify("warn", message("guide.sure", address=state.target, seconds=f"{CONFIRM_TIMEOUT:.0f}"))
            return None
        self._asked_to_guide = -math.inf
        return self._connection.robot().start_guiding(*GUIDING_KINDS[state.push.guiding_kind], stops=stops)

    def choose_robot(self, request: ChooseRobot) -> None:
        """Changes arm, destination or plant; refused while the arm moves."""
        state = self._store.state
        if is_moving(self._connection.status()):
            self._store.notify("warn", message("notice.moving"))
            return
        if request.plant is not None and request.model is None and request.target is None:
            self._choose_plant(request.plant)
            return
        if request.target is not None and not request.target.strip():
            self._store.notify("warn", message("run.address_needed"))
            return
        model = state.model if request.model is None else load_model(request.model)
        target = state.target if request.target is None else request.target.strip()
        if request.target is None and model.description.maker != state.model.description.maker:
            target = "virtual"  # An address is that of the other maker's controller.
        if target != "virtual":
            parse_address(target, model)
        if model.name == state.model.name and target == state.target and request.target is None:
            return
        self.open(model.name, target)

    def _choose_plant(self, plant: str) -> None:
        """Restarts the virtual controller with another plant, or with the cell of now; goal and plan are kept."""
        state = self._store.state
        if plant not in PLANT_KINDS or (plant == state.plant and not is_cell_pending(state)):
            return
        if state.target != "virtual":
            self._store.notify("warn", message("plant.address", address=state.target))
            return
        cell = solid_cell(replace(state, plant=plant))
        self._store.update(plant=plant, solid=cell, playing=False, **_unasked(state))
        self._forget_robot()
        self._connection.open(state.model, state.target, plant, _own_setup(state, state.target), cell)

    def disconnect(self) -> None:
        """Disconnects, and ends our own controller; goal and plan are kept, for the preview."""
        state = self._store.state
        self._forget_robot()
        self._connection.disconnect()
        self._store.update(asked=None, playing=False, **_unasked(state))

    def open(self, name: str, target: str) -> None:
        """Connects to a destination with an arm; goal, plan and undo are kept unless it is another arm."""
        state = self._store.state
        model = state.model if state.model.name == name else load_model(name)
        self._forget_robot()
        changes: dict[str, object] = {"target": target, "recording": None, "asked": None, **_unasked(state)}
        if model is not state.model:
            self._store.clear_undo()
            self._placed = False
            changes |= {"plan": None, "no_plan": None}
            changes |= {"plot_joint": 0, "problems": {}}
            changes |= {"push": replace(state.push, link=TOOL)}  # The other arm may lack this link.
            setup = self._exchange_setups(state, name)
            model = setup.wanted.only(setup.touched).applied_to(model)
            self._untouched = goal_at(model, model.home)
            changes |= {"model": model, "goal": self._untouched, "setup": setup}
            changes |= {"drive": replace(state.drive, control=None, refusal=None)}
            state = replace(state, model=model, setup=setup, drive=replace(state.drive, control=None))
        # First: from here on no state of the old arm is shown on the new one.
        cell = solid_cell(replace(state, target=target))
        self._connection.open(model, target, state.plant, _own_setup(state, target), cell)
        self._store.update(playhead=0.0, playing=False, solid=cell, **changes)

    def _forget_robot(self) -> None:
        self.requests.forget()
        self._incident, self._phase, self._open_incident = 0, "", ""
        self._powered, self._power_asked = False, float("-inf")

    def remember_setup(self, name: str, setup: RobotConfiguration) -> None:
        """Keeps the configuration of an arm that is replaced by another."""
        fresh = SetupState()
        touched: frozenset[SetupPart] = frozenset(setup.parts)
        seen = drawn_parts(touched)
        self._setups[name] = replace(fresh, wanted=fresh.wanted.updated(setup), touched=touched, seen=seen)

    def _exchange_setups(self, state: UiState, name: str) -> SetupState:
        """Returns the configuration of the chosen arm, and keeps that of the previous one."""
        self._setups[state.model.name] = replace(state.setup, edited="", asked=None, refusal=None, can_undo=False)
        setup = self._setups.get(name, SetupState())
        if setup.touched:
            self._store.notify("good", message("setup.back", what=name_parts(tuple(sorted(setup.touched))), model=name))
        return setup

    def watch(self) -> str | None:
        """Reads the supervisor: finished requests, new incidents, recorded cycles, the arm's first position.

        Returns:
            "standstill" when the arm has just stopped, "arm_known" at its first position, else None.
        """
        for outcome in self.requests.collect():
            self._report(outcome)
        # Read after the requests are collected, so that it is at least as new as their results.
        status = self._connection.status()
        if status.incident is not None and status.incident.number > self._incident:
            self._incident = status.incident.number
            if status.incident.code == "crashed.controller":
                self._powered = False  # The next virtual controller starts without motor power.
            self._open_incident = status.incident.code
            if status.incident.code != "fault.pressed" or not self._is_stop_said:
                sentence = describe_incident(status.incident.code, status.incident.message, status)
                sentence = pulled_cable(self._store.state, status) or sentence
                self._store.notify("bad", sentence, cause=ROBOT_NOT_READY)
        if self._guided and status.code == "idle.operator":
            self._store.notify("warn", message("notice.operator"))
        self._guided = is_guided(status) or (self._guided and status.phase == "stopping")
        if status.phase == "idle":
            self._settle()
        before, self._phase = self._phase, status.phase
        self._follow(status)
        if not self._placed and status.q_c is not None:
            self._placed = True
            if self._store.state.goal is self._untouched:
                self._store.update(goal=goal_at(self._store.state.model, status.q_c))
            return "arm_known"
        may_power = self._connection.is_ready and status.phase == "idle" and self._store.state.target == "virtual"
        if may_power and not self._powered:
            self._switch_on(status)
        return "standstill" if before in ("moving", "stopping") and not is_moving(status) else None

    def _settle(self) -> None:
        """Withdraws the notices of an incident that is over; the end of a lost process or connection is reported."""
        self._store.clear_notices(ROBOT_NOT_READY)
        if self._open_incident.startswith(("crashed", "lost")):
            code = "lost" if self._open_incident.startswith("lost") else self._open_incident
            self._store.notify("good", message(f"incident.over.{code}"))
        self._open_incident = ""

    def _follow(self, status: SupervisorStatus) -> None:
        """Leaves the preview where the arm has left the plan, however seldom its status was read."""
        plan = self._store.state.plan
        if (is_moving(status) or self._reached is not None) and status.motion_plan_time is not None:
            self._reached = status.motion_plan_time
        if is_moving(status):
            return
        if self._reached is not None and plan is not None:
            playhead = min(self._reached / max(plan.motion.duration, CYCLE_TIME), 1.0)
            self._reached = None
            self._store.update(playhead=playhead)

    def _switch_on(self, status: SupervisorStatus) -> None:
        """Switches the virtual arm's motors on, and tries again until that has succeeded once."""
        if status.powered:
            self._powered = True
            return
        if time.monotonic() - self._power_asked < _POWER_PAUSE or self.requests.is_pending("power_on"):
            return
        with suppress(StartingError):  # The next tick finds it started.
            self.requests.add("power_on", self._connection.robot().power_on())
            self._power_asked = time.monotonic()

    def _execute(self, *, is_agreed: bool, stops: int | None) -> None:
        state = self._store.state
        mode = state.drive.mode
        if state.plan is not None:
            state = self._store.update(plan=state.plan.completed(mode, state.cell_for(state.plan.model)))
        reason = obstacle(state, self._connection.status())
        if reason is not None:
            self._store.notify("warn", reason)
            return
        if state.plan is None:
            return
        if state.target != "virtual" and not (is_agreed and state.asked is state.plan.motion):
            self._store.update(asked=state.plan.motion)
            return
        try:
            self.requests.execute(state.plan, stops=stops)
        except (CertificateError, PlanningError, UsageError) as error:
            self._store.notify("warn", explain_error(error))
            return
        self._arrival = state.plan.missed_by
        self._is_stop_said = False

    def _report(self, outcome: Outcome) -> None:
        if outcome.error is not None:
            if outcome.what == "execute" and isinstance(outcome.error, ControlError) and self._reached is None:
                self._reached = 0.0  # It had begun, but no status showed it.
            self._is_stop_said = outcome.error.code == SAFETY_STOP
            is_in_fault = self._connection.status().phase == "fault"
            cause = ROBOT_NOT_READY if is_in_fault or _lasts_until_ready(outcome.error) else outcome.what
            self._store.notify(*self._report_failure(outcome, outcome.error), cause=cause)
            return
        self._store.clear_notices(outcome.what)
        if outcome.what == "power_on":
            self._powered = True
        elif outcome.what == "reboot":
            self._store.notify("warn", message("signals.rebooted"))
        elif outcome.what == "execute":
            self._reached = math.inf  # Even if it was too short for a status.
            self._report_arrival()

    def _report_arrival(self) -> None:
        if self._arrival is not None:
            self._store.notify("warn", message("notice.arrived_short", short=self._arrival))
        else:
            self._store.notify("good", message("notice.arrived"))

    def _report_failure(self, outcome: Outcome, error: RcilabError) -> tuple[Tone, Message]:
        if _lasts_until_ready(error):
            status = self._connection.status()
            return "bad", pulled_cable(self._store.state, status) or explain_error(error, status)
        if error.code == SAFETY_STOP:
            return "warn", message("ready.pressed")
        if isinstance(error, ControlError) and outcome.what == "execute":
            return "warn", message("notice.operator" if outcome.is_operator_absent else _stopped(self._store.state))
        return "bad", message("notice.refused", what=message(f"drive.{outcome.what}"), error=explain_error(error))

    def close(self) -> None:
        """Ends a recording, with the end of its file: the arm is about to be stopped."""
        self.requests.close("the workbench was closed")


def _lasts_until_ready(error: RcilabError) -> bool:
    """Returns whether an error is a fault or a lost connection: it lasts until the robot is ready again."""
    return isinstance(error, ConnectionLostError) or (isinstance(error, ControlError) and bool(error.faults))


def _unasked(state: UiState) -> dict[str, object]:
    """Returns the changes that drop all questions, confirmations and refusals of the previous robot."""
    return {
        "setup": replace(state.setup, asked=None, refusal=None),
        "jog": replace(state.jog, robot=False, asked=False, sentence=None),
        "drive": replace(state.drive, refusal=None),
        "typed_address": "",
        "world": replace(state.world, status=None),
    }


def _own_setup(state: UiState, target: str) -> RobotConfiguration | None:
    """Returns what a virtual controller gets at once; a real one gets nothing before a confirmation."""
    if target != "virtual":
        return None
    setup = replace(state.setup.wanted.only(state.setup.touched), control=state.drive.control)
    return setup.only(capabilities_of(state.model).setup)


def _stopped(state: UiState) -> str:
    return "notice.stopped" if state.plan is None or state.plan.program is None else "notice.stopped_program"
