"""The RCI controller of a virtual arm: requests and commands in, one state per cycle out. No sockets, no clock.

Each `step` advances the arm by one cycle, turns its violations into faults, and reports the state.

The reaction to a fault: the violating command is not followed; the fault's bit is set in the state of the same cycle,
and stays set; queued commands are dropped; the arm stops on one path, `ReferenceTrajectory.stop`, inside its
acceleration and jerk limits, under the position servo; then the brakes engage. If the arm followed its angles, the
stop begins at the last valid command; if it was compliant (impedance, torque, hand guiding), at its measured position
and velocity. `fault_stop` lists the reaction to each fault.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotState
from rcilab.i18n.translator import Remark
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.fault_stop import faults_of, is_beyond_range
from rcilab.makers.rokae.controller.model_download import model_response
from rcilab.makers.rokae.controller.modes import MODES
from rcilab.makers.rokae.controller.reporter import StateReporter
from rcilab.makers.rokae.controller.request_handlers import (
    Reply,
    answer_query,
    check_request,
    conclude,
    describe_refusal,
    find_outside,
)
from rcilab.makers.rokae.controller.settings import Settings, apply_request, apply_setup, guided_freedom
from rcilab.makers.rokae.controller.state_machine import Action, Event, Phase, Transition, transition
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.limit_tables import cartesian_limits, require_table
from rcilab.model.robot_model import RobotModel
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.api import SafetyButton
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.arm_setup import ArmSetup, require_stand
from rcilab.sim.controller_config import MODE_DELAY, ForceSign
from rcilab.sim.jitter_buffer import JitterBuffer
from rcilab.sim.phase_log import Activity, Situation
from rcilab.sim.plant import Plant
from rcilab.sim.violations import ArmCondition, Violations, describe_violations
from rcilab.sim.virtual_arm import VirtualArm

RECOVERY_TIME = 50  # [cycles] Shortest duration of an error recovery, so that it is visible to a client.
_STOP_REASONS = {
    rci.SafetyStop.ESTOP: Remark("an emergency stop was pressed", "estop"),
    rci.SafetyStop.GSTOP: Remark("the safety gate was opened", "gstop"),
}
_BUTTONS: dict[rci.SafetyStop, SafetyButton] = {
    rci.SafetyStop.NONE: "none",
    rci.SafetyStop.ESTOP: "estop",
    rci.SafetyStop.GSTOP: "gstop",
}
_POWER_OFF = Remark("the client switched motor power off during a motion", "power_off")
_WAITING = (Phase.STARTING, Phase.RECOVERING)
_MOVING = (Phase.MOVING, Phase.STOPPING)
_ACTIVITIES = {
    Phase.OFF: Activity.OFF,
    Phase.CUT_OFF: Activity.OFF,
    Phase.USER_STOPPED: Activity.SAFETY_STOPPED,
    Phase.GUIDING: Activity.GUIDING,
    **dict.fromkeys(_MOVING, Activity.MOVING),
}
"""READY in all other phases."""
_STILL = (Phase.OFF, Phase.IDLE, Phase.REFLEX, Phase.CUT_OFF, Phase.USER_STOPPED)
_BRAKED = (Phase.OFF, Phase.REFLEX, Phase.CUT_OFF, Phase.USER_STOPPED, Phase.RECOVERING)
_RESTING_LAWS = {**dict.fromkeys(_BRAKED, ControlLaw.BRAKED), Phase.GUIDING: ControlLaw.GUIDE}
"""The control law while no command is followed; POSITION in all other phases."""
_IDLE_MODES = (ControllerMode.OTHER, MotionGeneratorMode.IDLE)
_REPORTED = (
    rci.CommandCode.SET_COOR,
    rci.CommandCode.SET_LOAD,
    rci.CommandCode.SET_FC_COOR,
    rci.CommandCode.SET_TORQUE_FILTER_CUT_OFF_FREQUENCY,
)
"""Setters that change the content of states."""


class RciController:
    """The controller without its sockets. Owned by the loop that calls `step`, once a millisecond.

    Attributes:
        arm: The arm.
        settings: All settings.
        phase: The phase of the robot.
        faults: The set error bits, in wire order.
        reason: Reason for the last fault, as a sentence with numbers.
        state: The last reported state.
        ignored: Number of commands that arrived outside of a motion.
        safety_stop: The active safety stop.
        on_transition: Receives the situation before and after every transition; None: no receiver.

    Args:
        arm: The arm after power-up.
        mode_delay: Cycles from StartMove to the requested modes in the state.
        recovery_time: Shortest duration of an error recovery, [cycles].
        force_sign: Sign of the reported external forces.
        coulomb: Coulomb friction of the joints that LoadRobotModel serves, n numbers, [N m]; None: none.
    """

    buttons: tuple[SafetyButton, ...] = ("estop", "gstop")

    is_between_motions = False

    def __init__(
        self,
        arm: VirtualArm,
        *,
        mode_delay: int = round(MODE_DELAY / CYCLE_TIME),
        recovery_time: int = RECOVERY_TIME,
        force_sign: ForceSign = "on-arm",
        coulomb: Sequence[float] | None = None,
    ) -> None:
        model = arm.model
        self._limit_table = "manual"
        self.settings = self._pendant = Settings.of(model.description)
        self.safety_stop: rci.SafetyStop = rci.SafetyStop.NONE
        self.phase = Phase.OFF
        self.faults: tuple[Fault, ...] = ()
        self.reason = Remark("")
        self._lack: Remark | None = None  # The last reason that was missing commands.
        self.ignored = 0
        self.on_transition: Callable[[Situation, Situation], None] | None = None
        self._mode_delay = mode_delay
        self._recovery_time = recovery_time
        # Computed here: it takes longer than a cycle.
        self._model_response = model_response(model.description, coulomb)
        self.arm = arm
        arm.configure(self.settings)
        self._reporter = StateReporter(model, self.settings, force_sign)
        self._requested = self._shown = _IDLE_MODES
        self._countdown = 0
        self._is_still = False
        self._stops_by_fault = False
        self._message_id = 0
        self._datagram: bytes | None = None
        self.state = self._report()

    @property
    def model(self) -> RobotModel:
        """The arm with its tool and load."""
        return self.arm.model

    @property
    def plant(self) -> Plant:
        """The plant."""
        return self.arm.plant

    @property
    def playout(self) -> JitterBuffer:
        """The queue of commands, with its counts."""
        return self.arm.playout

    @property
    def cycle_number(self) -> int:
        """The number of the last state."""
        return self.state.message_id

    @property
    def phase_name(self) -> str:
        """Name of the phase, such as "idle"."""
        return self.phase.name.lower()

    @property
    def safety_box(self) -> SafetyBox | None:
        """The safety box."""
        return self.settings.safety_box

    @property
    def button(self) -> SafetyButton:
        """The active safety stop."""
        return _BUTTONS[self.safety_stop]

    def press_button(self, button: SafetyButton) -> None:
        """Activates or releases a safety stop."""
        self.press_safety_stop(rci.SafetyStop[button.upper()])

    @property
    def datagram(self) -> bytes:
        """The last reported state, as a datagram."""
        if self._datagram is None:
            self._datagram = rci.encode_state(self.state)
        return self._datagram

    @property
    def is_settled(self) -> bool:
        """Whether the arm is at standstill in a phase that does not end by itself: deferred replies are due."""
        return self.arm.is_standstill and self.phase not in (Phase.STOPPING, Phase.RECOVERING)

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves, or waits for commands that would make it move."""
        return self.phase in _MOVING or not self.arm.commanded.is_stationary

    @property
    def wants_commands(self) -> bool:
        """Whether a client's motion is in progress."""
        return self.phase is Phase.MOVING and not self.playout.is_finished

    @property
    def awaits_start(self) -> bool:
        """False: a client answers the first state of a motion, so `wants_commands` is true from then on."""
        return False

    @property
    def is_starved(self) -> bool:
        """Whether a motion is in progress and its next command is missing."""
        return self.phase is Phase.MOVING and self.playout.is_starved

    @property
    def lacks_commands(self) -> bool:
        """Whether a fault is set that is caused by missing commands."""
        return bool(self.faults) and self._lack is not None and self.reason is self._lack

    @property
    def loop_back(self) -> bool:
        """Whether every digital output is wired to the input of the same number."""
        return self.settings.loop_back

    @loop_back.setter
    def loop_back(self, on: bool) -> None:
        self.settings = self.settings.with_loop_back(on)

    @property
    def limit_table(self) -> str:
        """The table of tool limits, from the next motion on: "manual" or "sdk"."""
        return self._limit_table

    @limit_table.setter
    def limit_table(self, table: str) -> None:
        self._limit_table = require_table(table)

    @property
    def auto_limit(self) -> bool:
        """Whether joints stop inside their soft limits instead of a fault, from the next motion on."""
        return self.settings.auto_limit

    @auto_limit.setter
    def auto_limit(self, on: bool) -> None:
        self.settings = replace(self.settings, auto_limit=on)
        self.arm.configure(self.settings)

    @property
    def inputs(self) -> tuple[int, ...]:
        """Numbers of the digital inputs that are high."""
        return tuple(signal for signal, level in enumerate(self.settings.inputs) if level)

    def guide(self, on: bool) -> None:
        """Raises an error: the client starts and stops hand guiding.

        Raises:
            UsageError: Always.
        """
        raise UsageError("this arm is guided after StartDrag of its client: use robot.rci.start_drag, then push")

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input, 0 to 5; with loop-back on, until the outputs are set again.

        Raises:
            InvalidValueError: There is no such input.
        """
        self.settings = self.settings.with_input(signal, level)

    def reset(self, q: JointVector) -> None:
        """Moves the arm at standstill to another position (simulation only)."""
        self._is_still = False
        self.arm.reset(q)

    def set_up(self, setup: ArmSetup) -> None:
        """Sets the arm up as on its teach pendant; a reboot keeps it.

        Raises:
            InvalidValueError: A value is out of its bounds, or the arm cannot stand at the joint angles.
            UsageError: The arm moves, follows commands or is guided.
        """
        if self.phase not in _STILL or not self.arm.is_standstill:
            why = "while it still moves" if self.phase in _STILL else f"in phase {self.phase_name}"
            raise UsageError(f"the arm cannot be set up or placed {why}; end its motion first")
        description = self.model.description
        settings = apply_setup(self.settings, setup, description)
        if setup.q is not None:
            require_stand(self.model.with_tool(settings.T_flange_tool), setup.q, settings, self.plant)
        self.settings, self._pendant = settings, apply_setup(self._pendant, setup, description)
        self.arm.configure(settings)
        if setup.q is not None:
            self.arm.reset(readonly_copy(setup.q))
        self._reporter.configure(self.model, settings)
        self._is_still = False

    def receive(self, packet: rci.CommandPacket) -> None:
        """Queues a command from the network while a motion is in progress; others are counted."""
        self.ignored += not self.arm.receive(ArmCommand(*packet))

    def handle(self, request: rci.Request) -> Reply:
        """Handles a request and returns the answer."""
        content = answer_query(request, self.phase, self.safety_stop, self.settings, self._model_response)
        if content is not None:
            status = getattr(content, "status", rci.SettingStatus.SUCCESS)
            return Reply(content, refusal=self._describe(request, status) if status else "")
        cell = check_request(request, self.phase, self.settings, self.arm)
        if not isinstance(cell, Transition):
            return self._refuse(request, cell)
        if Action.APPLY in cell.actions and not self._apply(request):
            return self._refuse(request, rci.SettingStatus.INVALID_ARGUMENT)
        if Action.SET_FAULTS in cell.actions:
            self.reason = _POWER_OFF
        self._enter(cell, request=request, faults=(Fault.INSTABILITY_DETECTION,))
        assert cell.status is not None
        if cell.status:  # Zero is success, in every answer.
            return self._refuse(request, cell.status)
        return Reply(rci.StatusResponse(cell.status), cell.when, Action.REBOOT in cell.actions)

    def _refuse(self, request: rci.Request, status: rci.Status) -> Reply:
        return Reply(rci.StatusResponse(status), refusal=self._describe(request, status))

    def _describe(self, request: rci.Request, status: rci.Status) -> str:
        return describe_refusal(
            request,
            status,
            self.phase,
            self.settings,
            self.arm,
            safety_stop=self.safety_stop,
            faults=self.faults,
        )

    def conclude(self, request: rci.Request, reply: Reply) -> Reply:
        """Returns the answer that is due: a recovery may have been interrupted meanwhile."""
        status = conclude(reply, self.phase)
        return reply if status is None else self._refuse(request, status)

    def on_event(self, event: Event, *faults: Fault) -> None:
        """Handles an event other than a client's request; `faults` are the bits that it may set."""
        self._enter(transition(self.phase, event), faults=faults)

    def press_safety_stop(self, kind: rci.SafetyStop) -> None:
        """Presses an emergency stop or opens the safety gate, or ends both with NONE.

        Both stop the arm and keep it stopped; from StartMove to the end of a motion they also set an error bit, because
        the client would not notice otherwise.
        """
        if kind is not self.safety_stop:
            self.safety_stop = kind
            if kind is not rci.SafetyStop.NONE:
                self.reason = _STOP_REASONS[kind]
            event = Event.SAFETY_RELEASE if kind is rci.SafetyStop.NONE else Event.SAFETY_STOP
            self.on_event(event, Fault.INSTABILITY_DETECTION)

    def step(self, *, is_sent: bool = True) -> RobotState:
        """Advances by one cycle and returns the state at its end.

        Args:
            is_sent: Whether that state is sent. A state that is not sent has no message id, because the client
                counts cycles by message ids.
        """
        self._message_id += is_sent
        if not self._is_still:
            self._advance()
        elif self.arm.hold():
            return self._repeat()
        self.state, self._datagram = self._report(), None
        self._is_still = self._reporter.has_repeated and self._may_stay_still()
        return self.state

    def _advance(self) -> None:
        self._count_down()
        command_violations, measured_violations = self.arm.step()
        if command_violations:
            self._raise(command_violations)
        elif measured_violations:
            self._raise(measured_violations)
        if self.phase is Phase.STOPPING and self.arm.is_standstill and not self.arm.is_following:
            self.on_event(Event.AT_REST)
        if self._stops_by_fault and self.is_settled:
            self._stops_by_fault = False
            if where := find_outside(self.settings, self.arm.measured_state):
                self.arm.warnings.append(f"{where}: power off and on, then move it back")

    def _may_stay_still(self) -> bool:
        """Returns whether the next cycle will equal this one, unless a request arrives or the arm is moved."""
        return self.phase in _STILL and self._countdown == 0 and self.arm.has_settled

    def _repeat(self) -> RobotState:
        self.state = self._reporter.repeat(self._message_id)
        if self._datagram is not None:
            self._datagram = rci.renumber_state(self._datagram, self._message_id)
        return self.state

    def _count_down(self) -> None:
        if self._countdown > 0:
            self._countdown -= 1
        if self._countdown > 0 or self.phase not in _WAITING:
            return
        if self.phase is Phase.STARTING:
            self.on_event(Event.MODES_SHOWN)
        elif self.arm.commanded.is_stationary:
            self.on_event(Event.RECOVERED)

    def _raise(self, violations: Violations) -> None:
        self.reason = describe_violations(violations)
        if any(violation.condition is ArmCondition.COMMANDS_ARRIVE for violation in violations):
            self._lack = self.reason
        is_limit = not self.settings.auto_limit and any(map(is_beyond_range, violations))
        self.on_event(Event.JOINT_LIMIT if is_limit else Event.FAULT, *faults_of(violations))

    def _report(self) -> RobotState:
        controller_mode, motion_mode = self._shown
        return self._reporter.report(
            self._message_id,
            self.arm.signals,
            faults=self.faults,
            success_rate=self.playout.success_rate,
            motion_generator_mode=motion_mode,
            controller_mode=controller_mode,
            robot_mode=self.phase.robot_mode,
        )

    def _enter(self, cell: Transition, *, request: rci.Request | None = None, faults: tuple[Fault, ...] = ()) -> None:
        before = self._situation
        self._is_still = False
        for action in cell.actions:
            self._act(action, request, faults)
        if cell.phase is Phase.RECOVERING and self.phase is not Phase.RECOVERING:
            self._countdown = self._recovery_time
        self.phase = cell.phase
        self.arm.is_monitored = cell.phase in _MOVING
        self.arm.resting_law = _RESTING_LAWS.get(cell.phase, ControlLaw.POSITION)
        if self.on_transition is not None:
            self.on_transition(before, self._situation)

    @property
    def _situation(self) -> Situation:
        mode, activity = self._shown[0].name.lower(), _ACTIVITIES.get(self.phase, Activity.READY)
        return Situation(activity, self.phase_name, self.faults, mode, mode.replace("_", " "))

    def _act(self, action: Action, request: rci.Request | None, faults: tuple[Fault, ...]) -> None:
        match action:
            case Action.BEGIN:
                assert isinstance(request, rci.StartMove)
                modes = ControllerMode(request.controller_mode), rci.StartMotionMode(request.motion_mode)
                self._requested, self._countdown = (modes[0], modes[1].shown_as), self._mode_delay
                self.arm.prepare_motion(MODES[modes])
            case Action.SHOW_MODES:
                self._shown = self._requested
                self.arm.begin_motion(cartesian_limits(self.model.limits, self.limit_table))
            case Action.REVEAL_MODES:
                self._shown = self._requested
            case Action.HIDE_MODES:
                self._shown = _IDLE_MODES
            case Action.DRAIN:
                self.arm.drain_motion()
            case Action.DISCARD:
                self.arm.discard_motion()
            case Action.SET_FAULTS:
                self.faults = tuple(sorted({*self.faults, *faults}))
                self._stops_by_fault = True
            case Action.CLEAR_FAULTS:
                self.faults = ()
            case Action.GUIDE:
                assert isinstance(request, rci.StartDrag)
                self.arm.begin_guiding(guided_freedom(request))
            case Action.REBOOT:
                self.settings = self.settings.rebooted(self._pendant)
                self.arm.configure(self.settings)
                self._reporter.configure(self.model, self.settings)
            case Action.APPLY:
                pass  # Already applied by `_apply` before the transition, because a value may be invalid.

    def _apply(self, request: rci.Request) -> bool:
        try:
            settings = apply_request(self.settings, request, self.model.description)
        except InvalidValueError:
            return False
        self.settings = settings
        self.arm.configure(settings)
        if request.code in _REPORTED:
            self._reporter.configure(self.model, settings)
        return True
