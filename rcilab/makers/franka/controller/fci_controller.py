"""The FCI controller of a virtual arm: requests and commands in, one state per cycle out. No sockets, no clock.

Each `step` advances the arm by one cycle, turns its violations into errors, and reports the state. An error ends the
motion: the violating command is not followed, the flag is set in the state of the same cycle and stays set until the
error recovery, and the arm stops on one path, inside its acceleration and jerk limits. The errors that ended a motion
remain in `reflex_reason` until an error ends another one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter

import numpy as np

from rcilab.conformance.standstill import resolution
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.condition import Signal
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotState
from rcilab.i18n.translator import Remark
from rcilab.makers.franka.controller.error_of import errors_of
from rcilab.makers.franka.controller.modes import MotionKind, motion_of
from rcilab.makers.franka.controller.phases import (
    IN_MOTION,
    MOVE_REFUSALS,
    REASONS,
    RECOVERY_REFUSALS,
    SETTABLE,
    STOP_STATUSES,
    Phase,
)
from rcilab.makers.franka.controller.pose_deviation import PoseDeviations, find_deviation
from rcilab.makers.franka.controller.reporter import SINGULAR, StateReporter
from rcilab.makers.franka.controller.settings import Settings, apply_request, apply_setup
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.limit_tables import DEFAULT_TABLE, cartesian_limits, require_table
from rcilab.makers.franka.state_rounding import with_state_rounding
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import Move, Numbers, Request, SetLoad, SetNEToEE
from rcilab.makers.franka.wire.state_packet import NO_ERRORS, NO_READINGS, StatePacket, flags_of
from rcilab.makers.franka.wire.versions import FciVersion, MoveGenerator, Status
from rcilab.model.robot_model import RobotModel
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.api import SafetyButton
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.arm_setup import ArmSetup, require_stand
from rcilab.sim.generators import CommandKind
from rcilab.sim.generators.start import StartTolerance
from rcilab.sim.hand_guiding import GuidedFreedom
from rcilab.sim.jitter_buffer import JitterBuffer
from rcilab.sim.phase_log import Activity, Situation
from rcilab.sim.self_collision import SelfCollisionWatch
from rcilab.sim.violations import Violations, describe_violations
from rcilab.sim.virtual_arm import VirtualArm

SUCCESS_WINDOW = 100  # [cycles] Over which the share of commands in time is reported.
STATES_BEFORE_START = 2  # That a client reads after Move: one that shows the motion, and the one it answers.
RECOVERY_TIME = 50  # [cycles] Shortest duration of an error recovery, so that it is visible to a client.
_NO_GENERATOR, _NO_CONTROLLER = 0, 3  # As in the state.
_RESTING_LAWS = {Phase.USER_STOPPED: ControlLaw.BRAKED, Phase.GUIDING: ControlLaw.GUIDE}
_ACTIVITIES = {Phase.USER_STOPPED: Activity.SAFETY_STOPPED, Phase.GUIDING: Activity.GUIDING}
"""Without a motion; READY in all other phases."""
_MOVES_THE_TOOL = (SetNEToEE, SetLoad)
"""Settings of tool and load, with which the arm begins again at its present angles."""
_ROW_MAJOR = itemgetter(*(column * 4 + row for row in range(4) for column in range(4)))
_STILL = (Phase.IDLE, Phase.REFLEX, Phase.USER_STOPPED)
_USER_STOP = Remark("the user stop was pressed", "estop")


class FciController:
    """The controller without its sockets. Owned by the loop that calls `step`, once a millisecond.

    Attributes:
        arm: The arm.
        version: The version of the interface.
        settings: All settings.
        phase: The phase of the robot.
        faults: The errors that are set.
        reflex_reason: The errors that ended the last motion that was ended by any.
        reason: Reason for the last error, as a sentence with numbers.
        outcome: How the last motion ended, for the second answer to its Move; None while there is no answer due.
        state: The last reported state.
        ignored: Number of commands that arrived outside of a motion.
        on_transition: Receives the situation before and after every transition.

    Args:
        arm: The arm after power-up.
        version: The version of the interface.
    """

    loop_back = is_between_motions = False
    auto_limit = False
    buttons: tuple[SafetyButton, ...] = ("estop",)

    def __init__(self, arm: VirtualArm, version: FciVersion) -> None:
        self.arm, self.version = arm, version
        self.settings = Settings.of_arm(arm.model.description)
        self.phase = Phase.IDLE
        self.faults: tuple[FrankaError, ...] = ()
        self.reflex_reason: tuple[FrankaError, ...] = ()
        self.reason = Remark("")
        self.outcome: Status | None = None
        self.ignored = 0
        self.button: SafetyButton = "none"
        self.on_transition: Callable[[Situation, Situation], None] = lambda before, after: None
        conditions = arm.model.description.conditions
        assert conditions is not None  # Every Franka arm has them.
        self._table = conditions()
        self._motion: MotionKind | None = None
        self._situation = self._find_situation()
        self._deviations = PoseDeviations()
        self._links = SelfCollisionWatch(arm.model)
        self._final: Status | None = None  # Outcome of a motion whose commands have ended, once the arm has stopped.
        self._countdown = 0
        self._shown_states = 0  # Sent since Move.
        self._limit_table = DEFAULT_TABLE
        self._message_id = 0
        arm.on_loss = "bridge"
        arm.ends_by_command = True
        arm.playout.window = SUCCESS_WINDOW
        arm.configure(self.settings)
        arm.resting_law = ControlLaw.POSITION
        self._reporter = StateReporter(arm.model, self.settings)
        self.state = self._report()

    @property
    def model(self) -> RobotModel:
        """The arm with its tool and load."""
        return self.arm.model

    @property
    def playout(self) -> JitterBuffer:
        """The queue of commands, with its counts."""
        return self.arm.playout

    @property
    def motion(self) -> MotionKind | None:
        """The motion in progress."""
        return self._motion

    @property
    def limit_table(self) -> str:
        """Whose limits of the tool's motion apply, from the next motion on: "sdk" or "manual"."""
        return self._limit_table

    @limit_table.setter
    def limit_table(self, table: str) -> None:
        self._limit_table = require_table(table)

    @property
    def cycle_number(self) -> int:
        """The number of the last state."""
        return self._message_id

    @property
    def phase_name(self) -> str:
        """Name of the phase, such as "idle"."""
        return self.phase.name.lower()

    @property
    def safety_box(self) -> SafetyBox | None:
        """None: this controller has none."""
        return None

    @property
    def inputs(self) -> tuple[int, ...]:
        """Empty: this controller has no digital inputs."""
        return ()

    def set_input(self, signal: int, level: bool) -> None:
        """Raises an error: there are no digital inputs.

        Raises:
            InvalidValueError: Always.
        """
        raise InvalidValueError("digital input", signal, "does not exist: this controller has none")

    @property
    def packet(self) -> StatePacket:
        """The last state, as the content of a datagram."""
        controller, generator = self._shown
        rate = self.playout.success_rate if self.phase in IN_MOTION else 0.0
        reporter = self._reporter
        errors = flags_of(self.faults) if self.faults else NO_ERRORS
        reflex = flags_of(self.reflex_reason) if self.reflex_reason else NO_ERRORS
        return StatePacket(
            self._message_id,
            reporter.numbers,
            reporter.accelerometers if self.version.has_floats else NO_READINGS,
            generator,
            controller,
            errors,
            reflex,
            self.phase.robot_mode,
            rate,
        )

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves, or waits for commands that would make it move."""
        return self.phase in IN_MOTION or not self.arm.commanded.is_stationary

    @property
    def wants_commands(self) -> bool:
        """Whether a client's motion is in progress; from its first command on, before which it reads several states."""
        return self._is_streamed and self._has_started and not self.playout.is_finished

    @property
    def awaits_start(self) -> bool:
        """Whether a client that reads every state has read those that it needs before its first command."""
        return self._is_streamed and not self._has_started and self._shown_states >= STATES_BEFORE_START

    @property
    def _is_streamed(self) -> bool:
        return self.phase is Phase.MOVING and self._motion is not None and self._motion.mode.is_streamed

    @property
    def _has_started(self) -> bool:
        return self.playout.is_playing or len(self.playout) > 0

    @property
    def is_starved(self) -> bool:
        """Whether a motion is in progress and its next command is missing."""
        return self.phase is Phase.MOVING and self.playout.is_starved

    @property
    def lacks_commands(self) -> bool:
        """Whether an error is set that is caused by missing commands."""
        return FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION in self.faults

    def reset(self, q: JointVector) -> None:
        """Moves the arm at standstill to another position (simulation only)."""
        self.arm.reset(q)

    def set_up(self, setup: ArmSetup) -> None:
        """Sets the arm up as on Franka's Desk.

        Raises:
            InvalidValueError: A value is out of its bounds, or the arm cannot stand at the joint angles.
            UsageError: The arm moves, follows commands or is guided.
        """
        if self.phase not in _STILL or not self.arm.is_standstill:
            raise UsageError(f"the arm cannot be set up or placed in phase {self.phase_name}; end its motion first")
        settings = apply_setup(self.settings, setup, self.model.description)
        if setup.q is not None:
            require_stand(self.model.with_tool(settings.T_flange_tool), setup.q, settings, self.arm.plant)
        if setup.T_flange_tool is not None:
            self.arm.model = self.model.with_tool(IDENTITY)  # The shape of the tool before goes with it.
        self._configure(settings)
        if setup.q is not None:
            self.arm.reset(readonly_copy(setup.q))

    def press_button(self, button: SafetyButton) -> None:
        """Presses or releases the user stop."""
        if button == self.button:
            return
        self.button = button
        if button == "none":
            free = Phase.IDLE if self.arm.has_stopped else Phase.STOPPING
            self._enter(Phase.REFLEX if self.faults else free)
            return
        self.reason = _USER_STOP
        self._end(Status.EMERGENCY_ABORTED)
        self._enter(Phase.USER_STOPPED)

    def guide(self, on: bool) -> None:
        """Presses or releases the buttons at the wrist with which a hand guides the arm.

        Raises:
            UsageError: A motion is in progress, an error is set, or the user stop is pressed.
        """
        if on and self.phase is Phase.IDLE:
            self._enter(Phase.GUIDING)
            self.arm.begin_guiding(GuidedFreedom(self.settings.free_axes, self.settings.free_elbow))
        elif on and self.phase is not Phase.GUIDING:
            raise UsageError(f"the arm cannot be guided in phase {self.phase_name}; end its motion or clear its error")
        elif not on and self.phase is Phase.GUIDING:
            self._enter(Phase.STOPPING)

    def receive(self, packet: CommandPacket) -> None:
        """Queues a command from the network while a motion is in progress; others are counted."""
        if self._motion is None or self.phase is not Phase.MOVING:
            self.ignored += 1
            return
        self.ignored += not self.arm.receive(_as_command(packet, self._motion, self.version))

    def begin_move(self, request: Move) -> Status:
        """Begins a motion; returns MOTION_STARTED, or the status of its refusal.

        Raises:
            InvalidValueError: An argument is not valid.
        """
        refusal = MOVE_REFUSALS.get(self.phase)
        if refusal is not None:
            return refusal
        is_ideal = self.arm.plant.kind == "ideal"
        motion = motion_of(request, self.version, self.settings, follows_exactly=is_ideal)
        deviations = PoseDeviations.of(request)
        if motion.mode.is_cartesian and self._is_singular():
            return Status.START_SINGULAR
        self.outcome, self._motion = None, motion
        self._shown_states = 0
        self._deviations, self._final = deviations, None
        self._links.begin(self.arm.signals.measured.q)
        self.arm.prepare_motion(motion.mode)
        limits = cartesian_limits(self.model.limits, self.limit_table)
        if self.version.has_floats:
            limits = with_state_rounding(limits)
        unchecked = replace(limits.joint, torque=np.full(self.model.n, np.inf))  # The range of torques is no error.
        self.arm.begin_motion(
            replace(limits, joint=unchecked),
            start=_start_tolerance(limits),
            checks_accelerations=False,
            counts_replacements=True,
        )
        self._enter(Phase.MOVING)
        self.state = self._report()
        return Status.MOTION_STARTED

    def _is_singular(self) -> bool:
        """Returns whether the end effector cannot move in every direction."""
        J = self.model.jacobian(self.arm.commanded.q)
        return bool(np.linalg.svd(J, compute_uv=False)[-1] < SINGULAR)

    def stop_move(self) -> Status:
        """Ends a motion; returns the status of the answer."""
        status = STOP_STATUSES[self.phase]
        if self.phase is Phase.MOVING:
            self._end(Status.PREEMPTED)
            self._enter(Phase.STOPPING)
        return status

    def begin_recovery(self) -> Status | None:
        """Begins an error recovery; returns the status of the answer, or None: it follows when `phase` is IDLE."""
        refusal = RECOVERY_REFUSALS.get(self.phase)
        if refusal is not None:
            return refusal
        if self.phase is Phase.IDLE:
            self._reporter.reset_collisions()
            return Status.SUCCESS
        self._countdown = RECOVERY_TIME
        self._enter(Phase.RECOVERING)
        return None

    def set(self, request: Request) -> tuple[Status, str]:
        """Applies a setter; returns the status of the answer, and why it is refused."""
        if self.phase not in SETTABLE:
            return Status.NOT_POSSIBLE, REASONS[self.phase]
        if isinstance(request, _MOVES_THE_TOOL) and not self.arm.has_stopped:
            return Status.NOT_POSSIBLE, "the arm moves"
        try:
            settings = apply_request(self.settings, request, self.model.description)
        except InvalidValueError as error:
            return Status.INVALID_ARGUMENT, str(error)
        self._configure(settings)
        if self.phase is Phase.GUIDING:
            self.arm.begin_guiding(GuidedFreedom(settings.free_axes, settings.free_elbow))
        return Status.SUCCESS, ""

    def lose_client(self) -> bool:
        """Stops the arm; returns whether this ends a motion."""
        was_moving = self.phase is Phase.MOVING
        if was_moving:
            self._end(Status.ABORTED)
            self._motion = None
            self._enter(Phase.STOPPING)
        self.outcome = self._final = None
        return was_moving

    def count_sent_state(self) -> None:
        """Counts a state that was sent: also one whose cycle was over when Move came, for it shows the motion."""
        self._shown_states += 1

    def step(self, *, is_sent: bool = True) -> RobotState:
        """Advances by one cycle and returns the state at its end."""
        self._message_id += is_sent
        command_violations, measured_violations = self.arm.step()
        violations = command_violations or measured_violations
        if violations:
            self._raise(violations)
        elif self.phase is Phase.MOVING and self.playout.is_finished and self.arm.commanded.is_stationary:
            self._finish()
        if self.phase is Phase.STOPPING and self.arm.has_stopped:
            self.outcome, self._final = self._final or self.outcome, None
            self._enter(Phase.IDLE)
        elif self.phase is Phase.RECOVERING:
            self._recover()
        self.state = self._report()
        self._check_deviation()
        self._check_links()
        self._check_reflex()
        return self.state

    def _finish(self) -> None:
        """Ends a motion after its last command; a compliant arm then stops where it is."""
        self.arm.discard_motion()
        if self._exceeds(self._deviations.goal):
            self._set_errors((FrankaError.MAX_GOAL_POSE_DEVIATION_VIOLATION,))
            return
        self._final = Status.SUCCESS
        self._enter(Phase.STOPPING)

    def _exceeds(self, bounds: Numbers) -> bool:
        """Returns whether the tool of a commanded motion is farther from it than Move allows, and sets the reason."""
        motion = self._motion
        if motion is None or motion.mode.law is ControlLaw.TORQUE:
            return False
        excess = find_deviation(self.arm.signals, bounds)
        if excess is not None:
            self.reason = excess
        return excess is not None

    def _check_deviation(self) -> None:
        if self.phase is Phase.MOVING and self._exceeds(self._deviations.path):
            self._set_errors((FrankaError.MAX_PATH_POSE_DEVIATION_VIOLATION,))
            self.state = self._report()

    def _check_links(self) -> None:
        touching = None if self.phase is not Phase.MOVING else self._links.step(self.arm.signals.measured.q)
        if touching is not None:
            self.reason = touching
            self._set_errors((FrankaError.SELF_COLLISION_AVOIDANCE_VIOLATION,))
            self.state = self._report()

    def _recover(self) -> None:
        self._countdown -= 1
        if self._countdown <= 0 and self.arm.has_stopped:
            self.faults = ()
            self._reporter.reset_collisions()
            self._enter(Phase.IDLE)

    def _check_reflex(self) -> None:
        torque, force = self._reporter.has_collision
        if self.phase is not Phase.MOVING or not (torque or force):
            return
        found = ((FrankaError.JOINT_REFLEX,) if torque else ()) + ((FrankaError.CARTESIAN_REFLEX,) if force else ())
        self.reason = Remark.all(self._reporter.describe_collisions())
        self._set_errors(found)
        self.state = self._report()

    def _raise(self, violations: Violations) -> None:
        self.reason = describe_violations(violations)
        is_cartesian = self._motion is not None and self._motion.mode.is_cartesian
        self._set_errors(errors_of(violations, self._table, is_cartesian=is_cartesian))

    def _set_errors(self, errors: tuple[FrankaError, ...]) -> None:
        self.faults = tuple(sorted({*self.faults, *errors}))
        self.reflex_reason = self.faults
        self._end(Status.REFLEX_ABORTED)
        self._enter(Phase.REFLEX)

    def _end(self, outcome: Status) -> None:
        """Ends a motion in progress, if there is one."""
        if self.phase in IN_MOTION:
            self.outcome = outcome
            self.arm.discard_motion()

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        if phase not in IN_MOTION:
            self._motion = None
        self.arm.is_monitored = self._motion is not None
        self.arm.resting_law = _RESTING_LAWS.get(phase, ControlLaw.POSITION)
        before, self._situation = self._situation, self._find_situation()
        self.on_transition(before, self._situation)

    def _find_situation(self) -> Situation:
        motion, activity = self._motion, _ACTIVITIES.get(self.phase, Activity.READY)
        if motion is None:
            return Situation(activity, self.phase_name, self.faults, "", "")
        mode = motion.reported_controller.name.lower()
        return Situation(Activity.MOVING, self.phase_name, self.faults, mode, motion.description)

    @property
    def _shown(self) -> tuple[int, int]:
        """Controller and motion generator as in the state: a client waits until they are gone before the next Move."""
        if self.phase not in IN_MOTION or self._motion is None:
            return _NO_CONTROLLER, _NO_GENERATOR
        return self._motion.controller, self._motion.generator + 1

    def _report(self) -> RobotState:
        motion = self._motion
        return self._reporter.report(
            self._message_id,
            self.arm.signals,
            self.arm.drive_torque,
            faults=self.faults,
            success_rate=self.playout.success_rate,
            motion_generator_mode=MotionGeneratorMode.IDLE if motion is None else motion.reported_generator,
            controller_mode=ControllerMode.OTHER if motion is None else motion.reported_controller,
            robot_mode=self.phase.robot_mode,
        )

    def _configure(self, settings: Settings) -> None:
        self.settings = settings
        before = self.model.mounted
        self.arm.configure(settings)
        if self.model.mounted is not before:
            self._links = SelfCollisionWatch(self.model)
        self._reporter.configure(self.model, settings)


def _start_tolerance(limits: Limits) -> StartTolerance:
    """Returns the tolerance of the rows on the start: a larger step from standstill violates the jerk."""

    def step(signal: Signal) -> float:
        return float(resolution(signal, 0, limits)[0])

    joint = tuple(resolution("joint", 0, limits).tolist())
    return StartTolerance(joint, step("translation"), step("rotation"), step("arm_angle"))


def _as_command(packet: CommandPacket, motion: MotionKind, version: FciVersion) -> ArmCommand:
    """Returns what a motion uses of a command: the rest of the datagram may hold anything."""
    kind, is_cartesian = motion.mode.kind, motion.mode.is_cartesian
    has_elbow = is_cartesian and packet.has_elbow
    is_alone = motion.generator is MoveGenerator.NONE and version.finishes_torques
    angle, side = packet.elbow_c if has_elbow else (0.0, 0.0)
    return ArmCommand(
        packet.message_id,
        packet.q_c if kind in (CommandKind.JOINT_ANGLES, CommandKind.JOINT_GOALS) else (),
        _ROW_MAJOR(packet.O_T_EE_c) if kind is CommandKind.POSES else (),
        has_elbow,
        angle,
        packet.has_ended_torques if is_alone else packet.is_finished,
        packet.tau_c if motion.mode.law is ControlLaw.TORQUE else (),
        packet.dq_c if kind is CommandKind.JOINT_VELOCITIES else (),
        packet.O_dP_EE_c if kind is CommandKind.TWISTS else (),
        side,
    )
