"""The controller of a virtual arm: commands and settings in, one state per cycle out. No sockets, no clock.

Motions are planned by `sim.planner`; each cycle its joint angles are a command of the virtual arm, which checks and
follows them. An error stops the arm on the arm's own path, discards all motions and sets the state to STOPPED; it stays
until it is cleaned.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np

from rcilab.conformance.common_conditions import JOINT_VELOCITY
from rcilab.core.arrays import readonly_copy
from rcilab.core.errors import UsageError
from rcilab.core.fault import FaultCode
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.i18n.translator import Remark
from rcilab.makers.ufactory.bounds import SERVO_PERIOD
from rcilab.makers.ufactory.controller.gripper import Gripper
from rcilab.makers.ufactory.controller.measured_accelerations import MeasuredAccelerations
from rcilab.makers.ufactory.controller.modes import (
    SET_PAUSED,
    SET_READY,
    SET_STOPPED,
    SET_STOPPING,
    TRANSITIONS,
    Answer,
    Command,
    Mode,
    State,
    answer,
)
from rcilab.makers.ufactory.controller.motion_watch import GuidingWatch, MotionWatch
from rcilab.makers.ufactory.controller.neutral_state import build_neutral_state
from rcilab.makers.ufactory.controller.queue_end import QueueEnd
from rcilab.makers.ufactory.controller.settings import Settings, apply_setup
from rcilab.makers.ufactory.controller.signals import Signals
from rcilab.makers.ufactory.errors import UfactoryError, UfactoryWarning
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import range_from
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.api import SafetyButton
from rcilab.sim.arm_setup import ArmSetup, require_stand
from rcilab.sim.hand_guiding import FREE
from rcilab.sim.planner import (
    EventKind,
    PauseTarget,
    Planner,
    PlannerEvent,
    PlannerFeed,
    PlannerState,
    Refusal,
    RefusalReason,
    Target,
)
from rcilab.sim.plant import Measurement
from rcilab.sim.violations import ArmCondition, Violations, describe_violations
from rcilab.sim.virtual_arm import VirtualArm

_OF_THE_ARM = (
    "T_flange_tool",
    "load",
    "collision_thresholds",
    "guide_damping",
    "gravity",
    "reduced",
    "reduced_joint_speed",
    "reduced_lower",
    "reduced_upper",
)
LARGEST_QUEUE = 2048  # Motions; the client library itself waits from 512 or 1024 on.
ALL_AXES = 8
_SERVO_CYCLES = round(1e3 * SERVO_PERIOD)
_SERVO_BURST = 2  # Commands that may come at once, so that a client of 250 Hz with jitter loses none.
_BUTTONS: dict[SafetyButton, UfactoryError] = {
    "estop": UfactoryError.EMERGENCY_STOP_BUTTON,
    "gstop": UfactoryError.EMERGENCY_STOP_INPUT,
    "switch": UfactoryError.EMERGENCY_STOP_SWITCH,
}
_PRESSED: dict[SafetyButton, str] = {
    "estop": "the emergency stop was pressed",
    "gstop": "the input of the emergency stop was opened",
    "switch": "the three-position switch was let go or pressed through",
}
_PLANNED = {JOINT_VELOCITY.id: UfactoryError.SPEED}
"""Of the joints along a line that the controller plans; targets of mode 1 are followed later instead."""
_REFUSALS = {
    RefusalReason.JOINT_RANGE: UfactoryError.JOINT_RANGE,
    RefusalReason.GEOMETRY: UfactoryError.PLANNING,
    RefusalReason.STEP: UfactoryError.SPEED,
}


class TaskEvent(NamedTuple):
    """What became of a task: a motion command in the queue, or on-line."""

    task: int
    kind: EventKind


class XArmController:
    """The controller without its sockets. Owned by the loop that calls `step`, once a millisecond.

    Attributes:
        arm: The arm.
        settings: All settings.
        signals: Digital and analog signals.
        gripper: The gripper at the tool.
        accelerations: Those of the measured arm.
        mode: The mode.
        error: The error that is set, or None.
        warning: The warning that is set, or None.
        enabled: Joints with motors on, a bit each.
        reason: Reason for the last error, as a sentence with numbers.
        reasons: The same of each error, when it last came.
        measurements: What was measured then.
        counter: Of the client (`set_counter_increase`).
        state: Not to be confused with `robot_state`: the state in reports.
        ignored: Servo commands that came faster than 250 Hz.
        on_task: Called with what became of a task.
        on_state: Called with the state before and after.

    Args:
        arm: The arm after power-up.
    """

    auto_limit = False
    buttons: tuple[SafetyButton, ...] = ("estop", "gstop", "switch")
    limit_table = "manual"
    awaits_start = wants_commands = is_starved = lacks_commands = False

    def __init__(self, arm: VirtualArm) -> None:
        self.arm = arm
        self.settings = Settings.of_arm(arm.model.description)
        self.signals, self.gripper = Signals(), Gripper()
        self.accelerations = MeasuredAccelerations(arm.measured_state)
        self.mode = Mode.POSITION
        self.error: UfactoryError | None = None
        self.warning: UfactoryWarning | None = None
        self.enabled = 0
        self.reason = Remark("")
        self.reasons: dict[UfactoryError, Remark] = {}
        self.measurements: dict[UfactoryError, Measurement] = {}
        self.counter = 0
        self.ignored = 0
        self.button: SafetyButton = "none"
        self.on_task: Callable[[TaskEvent], None] = lambda event: None
        self.on_state: Callable[[State, State], None] = lambda before, after: None
        conditions = arm.model.description.conditions
        assert conditions is not None  # Every arm of this maker has them.
        self._faults = {row.id: row.fault for row in reversed(conditions().conditions)} | _PLANNED
        self._set_state = State.STOPPED
        self._shown_state = State.STOPPED
        self._is_outdated = False  # Settings have changed that the arm has not yet.
        self._was_moving = False
        self._is_guided = False
        self._number = 0
        self._tokens = float(_SERVO_BURST)
        self._online: int | None = None  # Task of the on-line command in progress.
        self._all = (1 << arm.model.n) - 1
        arm.set_prefill(0)
        arm.configure(self.settings)
        self._planned = self.motion_limits.joint  # Those that the planner keeps.
        self.planner = Planner(arm.model, self.motion_limits, arm.commanded.q, slows_down=False)
        self._feed = PlannerFeed(arm, self.planner, self._checked_limits)
        self.end = QueueEnd(arm.model, arm.commanded.q)
        self._motion_watch, self._guiding_watch = MotionWatch(arm), GuidingWatch(arm)
        self.robot_state = build_neutral_state(self)

    @property
    def model(self) -> RobotModel:
        """The arm with its tool and load."""
        return self.arm.model

    @property
    def motion_limits(self) -> Limits:
        """The limits of motions: in reduced mode with its ranges and speed."""
        limits, settings = self.model.limits, self.settings
        joint = replace(limits.joint, velocity=np.minimum(limits.joint.velocity, settings.joint_speed))
        if settings.reduced:
            joint = replace(
                joint, lower=readonly_copy(settings.reduced_lower), upper=readonly_copy(settings.reduced_upper)
            )
        return replace(limits, joint=joint, joint_tool_velocity=inf)  # Which is of mode 1 alone.

    @property
    def loop_back(self) -> bool:
        """Whether every output is wired to the input of the same number."""
        return self.signals.loop_back

    @loop_back.setter
    def loop_back(self, on: bool) -> None:
        self.signals.set_loop_back(on)

    @property
    def state(self) -> RobotState:
        """The last state, of every maker."""
        return self.robot_state

    @property
    def shown_state(self) -> State:
        """The state in reports."""
        if self._set_state is State.READY and self.planner.state is PlannerState.MOVING:
            return State.MOVING
        return self._set_state

    @property
    def cycle_number(self) -> int:
        """Number of the last state."""
        return self._number

    @property
    def phase_name(self) -> str:
        """The state, such as "ready"."""
        return self.shown_state.name.lower()

    @property
    def faults(self) -> tuple[FaultCode, ...]:
        """The error that is set."""
        return () if self.error is None else (self.error,)

    @property
    def safety_box(self) -> SafetyBox | None:
        """None: the boundary is a setting of its own."""
        return None

    @property
    def inputs(self) -> tuple[int, ...]:
        """Numbers of the digital inputs that are high."""
        bits = self.signals.inputs
        return tuple(k for k in range(bits.bit_length()) if bits >> k & 1)

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input.

        Raises:
            InvalidValueError: There is no such input.
        """
        self.signals.set_input(signal, level)

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves."""
        return self.planner.state is PlannerState.MOVING or self._is_guided or not self.arm.commanded.is_stationary

    @property
    def is_between_motions(self) -> bool:
        """Whether the arm stands after a planned motion; in mode 1, targets may still come."""
        return self.mode is not Mode.SERVO and not (self.is_moving or self.planner.queued)

    @property
    def has_motors(self) -> bool:
        """Whether the motors of all joints are on."""
        return self.enabled & self._all == self._all

    @property
    def queued(self) -> int:
        """Number of commands that have not ended."""
        return self.planner.queued

    def set_up(self, setup: ArmSetup) -> None:
        """Sets tool and load, or places the arm.

        Raises:
            InvalidValueError: A value is out of its bounds, or the arm cannot stand at the joint angles.
            UsageError: The arm moves.
        """
        if self.is_moving or not self.arm.is_standstill:
            raise UsageError("the arm cannot be set up or placed while it moves; end its motion first")
        settings = apply_setup(self.settings, setup)
        if setup.q is not None:
            require_stand(self.model.with_tool(settings.T_flange_tool), setup.q, settings, self.arm.plant)
        self.require_settings(settings)
        self.configure(settings)
        if setup.q is not None:
            self._feed.abort()
            self.arm.reset(readonly_copy(setup.q))
            self.planner.reset(self.arm.commanded.q)

    def press_button(self, button: SafetyButton) -> None:
        """Presses or releases an emergency stop; its error stays until it is cleaned."""
        if button == self.button:
            return
        self.button = button
        if button != "none":
            self.fail(_BUTTONS[button], Remark(_PRESSED[button], "estop"))

    def guide(self, on: bool) -> None:
        """Raises UsageError: this arm is guided in mode 2."""
        raise UsageError("this arm has no buttons for guiding: set mode 2 and then state 0")

    def require_settings(self, settings: Settings) -> None:
        """Requires settings that the arm can take, before they are applied.

        Raises:
            InvalidValueError: The load is heavier than the rated payload.
        """
        if settings.load is not self.settings.load:
            self.model.with_load(settings.load)

    def configure(self, settings: Settings) -> None:
        """Applies settings that were checked; the arm takes those of frames, load and limits as soon as it stands."""
        before, self.settings = self.settings, settings
        if any(getattr(before, name) is not getattr(settings, name) for name in _OF_THE_ARM):
            self._is_outdated = True
            self._update_arm()

    def _update_arm(self) -> None:
        if not self._is_outdated or self.is_moving:
            return
        self._is_outdated = False
        self.arm.configure(self.settings)
        self._feed.abort()
        self._configure_planner(self.motion_limits.joint)
        self._feed.limits = self._checked_limits
        self.end = QueueEnd(self.model, self.planner.q)
        self._motion_watch.configure()

    def _widen_ranges(self) -> None:
        """Lets a joint that stands outside its range move inwards, before the first motion."""
        if self.is_moving or self.planner.queued:
            return
        joint, planned = range_from(self.motion_limits.joint, np.array(self.planner.q)), self._planned
        if not (np.array_equal(joint.lower, planned.lower) and np.array_equal(joint.upper, planned.upper)):
            self._configure_planner(joint)

    def _configure_planner(self, joint: JointLimits) -> None:
        self._planned = joint
        self.planner.configure(self.model, replace(self.motion_limits, joint=joint))

    def reset_state(self) -> None:
        """Sets the state after a change of mode or settings: nothing moves until it is set to 0."""
        self._end_motions()
        if self._set_state is not State.STOPPED or self.error is None:
            self._set_state = State.CHANGED

    def enable(self, axis: int, on: bool) -> bool:
        """Switches the motor of a joint, 1 to 7, or of all; returns False for another number.

        It ends what moves, as STOPPED does, unless the motors are already on.
        """
        if not (1 <= axis <= self.model.n or axis == ALL_AXES):
            return False
        bits = self._all if axis == ALL_AXES else 1 << (axis - 1)
        if on and self.enabled & bits == bits:
            return True
        self.enabled = self.enabled | bits if on else self.enabled & ~bits
        self._end_motions()
        self._set_state = State.STOPPED
        return True

    def set_mode(self, number: int, *, detects_motion: bool = True) -> bool:
        """Sets the mode; returns False for a number without one.

        Args:
            number: Of the mode.
            detects_motion: Whether an arm that moves at the start of mode 2 is an error.
        """
        if number not in tuple(Mode):
            return False
        self._guiding_watch.detects_motion = detects_motion
        if number != self.mode:
            self.mode = Mode(number)
            self.reset_state()
        return True

    def set_state(self, value: int) -> bool:
        """Sets the state; returns False for a value that cannot be set."""
        if value not in TRANSITIONS:
            return False
        before = self.shown_state
        after = TRANSITIONS[value][before]
        if value == SET_READY and (self.error is not None or not self.has_motors):
            after = State.STOPPED
        if value == SET_READY and before is State.PAUSED:
            self.planner.resume()
        elif value == SET_PAUSED and after is State.PAUSED:
            self._pause()
        elif value == SET_STOPPED:
            self._end_motions()
            self.signals.clear_outputs(box=self.settings.io_reset[0], tool=self.settings.io_reset[1])
        elif value == SET_STOPPING and after is State.STOPPING:
            self.planner.end()
        self._set_state = State.READY if after is State.MOVING else after
        return True

    def clean_error(self) -> None:
        """Clears the error, unless its emergency stop is still pressed."""
        if self.button == "none":
            self.error = None

    def warn(self, warning: UfactoryWarning) -> None:
        """Sets a warning."""
        self.warning = warning

    def answer_to(self, command: Command) -> Answer:
        """Returns what becomes of a motion command now."""
        return answer(self.mode, command, self.shown_state)

    @property
    def is_full(self) -> bool:
        """Whether the queue takes no further motion."""
        return self.planner.queued >= LARGEST_QUEUE

    def find_end(self) -> QueueEnd:
        """Returns where the queue ends."""
        if self.planner.queued == 0:
            self.end.begin(self.planner.q)
        return self.end

    def find_servo_end(self) -> Pose:
        """Returns the pose of the newest servo target; that of the arm if it stands."""
        if self.planner.state is not PlannerState.MOVING:
            self.end.begin(self.planner.q)
        return self.end.pose

    def queue(self, target: Target) -> None:
        """Appends a target.

        Raises:
            InvalidValueError: A value of it is not valid.
        """
        self._widen_ranges()
        self.planner.add(target)

    def queue_marker(self, task: int) -> None:
        """Appends a task that ends as soon as its turn comes; at once without queued motions."""
        if self.planner.queued:
            self.planner.add(PauseTarget(id=task, seconds=0.0))
        else:
            self.on_task(TaskEvent(task, EventKind.REACHED))

    def follow(self, task: int, begin: Callable[[Planner], Refusal | None]) -> None:
        """Carries out a command of a mode without a queue; what it refuses is an error.

        Args:
            task: Number of the command.
            begin: Calls the planner.

        Raises:
            InvalidValueError: A value is not valid.
        """
        self._widen_ranges()
        refusal = begin(self.planner)
        self._end_online(EventKind.DISCARDED)
        self._online = task
        self.on_task(TaskEvent(task, EventKind.BEGAN))
        if refusal is not None:
            self._end_online(EventKind.REFUSED)
            self.refuse(refusal)

    def take_servo(self) -> bool:
        """Returns whether a servo command is within the rate of 250 Hz; others are lost."""
        if self._tokens < 1.0:
            self.ignored += 1
            return False
        self._tokens -= 1.0
        return True

    def fail(self, error: UfactoryError, reason: Remark) -> None:
        """Sets an error and stops the arm."""
        self.error, self.reason = error, reason
        self.reasons[error], self.measurements[error] = reason, self.arm.measured_state.measured
        if error in _BUTTONS.values() or UfactoryError.JOINT_1 <= error <= UfactoryError.JOINT_7:
            self.enabled = 0
        self._end_motions()
        self._handle_events(self.planner.take_events())
        self._feed.abort()
        self._set_state = State.STOPPED

    def step(self) -> RobotState:
        """Advances by one cycle and returns the state at its end."""
        self._number += 1
        self.gripper.step()
        self._tokens = min(self._tokens + 1.0 / _SERVO_CYCLES, _SERVO_BURST)
        self._update_arm()
        self._choose_control_law()
        events, command_violations, measured_violations = self._feed.step()
        self.accelerations.step(self.arm.measured_state)
        self._handle_events(events)
        if command_violations or measured_violations:
            self._raise(command_violations or measured_violations)
        elif self._is_guided:
            found = self._guiding_watch.step()
            if found is not None:
                self.fail(*found)
        else:
            self._watch()
        if self._set_state is State.STOPPING and self.planner.state is not PlannerState.MOVING:
            self._set_state = State.STOPPED
        before, self._shown_state = self._shown_state, self.shown_state
        if before is not self._shown_state:
            self.on_state(before, self._shown_state)
        self.robot_state = build_neutral_state(self)
        return self.robot_state

    def _choose_control_law(self) -> None:
        """Guides the arm in mode 2; otherwise its motors hold it, or its brakes."""
        is_guided = self.mode is Mode.TEACH and self._set_state is State.READY
        if is_guided and not self._is_guided:
            self._feed.abort()
            self.arm.begin_guiding(FREE)
            self._guiding_watch.begin()
        self._is_guided = is_guided
        held = ControlLaw.POSITION if self.has_motors else ControlLaw.BRAKED
        self.arm.resting_law = ControlLaw.GUIDE if is_guided else held

    @property
    def _checked_limits(self) -> Limits:
        """Limits that the arm checks: the planner keeps accelerations and jerks, and no error is theirs."""
        limits = self.motion_limits
        unlimited = readonly_copy(np.full(self.model.n, inf))
        return replace(limits, joint=replace(limits.joint, acceleration=unlimited, jerk=unlimited, torque=unlimited))

    def _handle_events(self, events: Iterable[PlannerEvent]) -> None:
        """Passes the events of tasks on; a target that cannot be followed is an error."""
        for event in events:
            self.on_task(TaskEvent(event.id, event.kind))
            if event.refusal is not None:
                self.refuse(event.refusal)

    def _watch(self) -> None:
        """Checks the cycle of a motion."""
        was_moving, self._was_moving = self._was_moving, False
        if not self._feed.is_feeding:
            return
        obstruction = self.planner.obstruction
        if obstruction is not None:
            self.refuse(obstruction)
            return
        if self.planner.state is not PlannerState.MOVING:
            self._end_online(EventKind.REACHED)
            return
        self._was_moving = True
        if not was_moving:
            self._motion_watch.begin(self.settings)
        found = self._motion_watch.step(self.settings, is_servo=self.mode is Mode.SERVO)
        if found is not None:
            self.fail(*found)

    def _pause(self) -> None:
        if self.mode is Mode.POSITION:
            self.planner.pause()
        elif self.planner.state is PlannerState.MOVING:
            self.planner.stop()
            self._end_online(EventKind.DISCARDED)

    def _end_motions(self) -> None:
        """Stops what moves and discards what is queued."""
        if self.planner.queued or self.planner.state is PlannerState.MOVING:
            self.planner.stop()
        self._end_online(EventKind.DISCARDED)

    def _end_online(self, kind: EventKind) -> None:
        if self._online is not None:
            task, self._online = self._online, None
            self.on_task(TaskEvent(task, kind))

    def refuse(self, refusal: Refusal) -> None:
        """Sets the error of a target that cannot be followed."""
        error = _REFUSALS.get(refusal.reason)
        if error is None:  # The target has no joint angles, or only the path to it.
            error = UfactoryError.KINEMATICS if refusal.share >= 1.0 else UfactoryError.NO_SOLUTION
        self.fail(error, refusal.remark)

    def _raise(self, violations: Violations) -> None:
        first = violations[0].condition
        if first is ArmCondition.NO_COLLISION:
            error: object = UfactoryError.COLLISION
        elif isinstance(first, ArmCondition):
            error = UfactoryError.PLANNING
        else:
            error = self._faults.get(first.id)
        self.fail(
            error if isinstance(error, UfactoryError) else UfactoryError.PLANNING, describe_violations(violations)
        )
