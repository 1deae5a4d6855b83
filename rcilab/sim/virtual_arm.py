"""A virtual arm: reference, drives, plant and sensors, advanced one cycle at a time, independent of the maker.

Each `step` plays and checks one command of the motion in progress, or continues a stop, moves the plant and reads the
sensors. Its result contains violations; the maker's controller maps them to its own faults.

On a violation the arm reacts like a position controller: the violating command is not followed, queued commands are
discarded, and the arm stops on one path, `ReferenceTrajectory.stop`, inside its acceleration and
jerk limits, under the position servo; then the brakes engage. Where the arm followed its reference the stop begins at
the last good command; where it was compliant (impedance, torque, hand guiding), at its measured position and velocity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import Limits
from rcilab.model.robot_model import RobotModel
from rcilab.sim.actuator import Actuator, ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.friction_watch import FrictionWatch, blame_friction
from rcilab.sim.generators import build_generator
from rcilab.sim.generators.generator import blame_lost_commands
from rcilab.sim.generators.motion_limits import MotionMode, build_motion_limits
from rcilab.sim.generators.start import StartTolerance, start_tolerance
from rcilab.sim.hand_guiding import GuidedFreedom
from rcilab.sim.hold_response import servo_figures
from rcilab.sim.jitter_buffer import JitterBuffer, Playback
from rcilab.sim.measured_state import MeasuredStateMonitor
from rcilab.sim.plant import Measurement, Plant, Setpoint
from rcilab.sim.reference_trajectory import ReferenceTrajectory
from rcilab.sim.streamed_motion import LOST_LIMIT, PREFILL, TORQUE_PREFILL, LossBehaviour, StreamedMotion
from rcilab.sim.tool_kinematics import ToolKinematics
from rcilab.sim.violations import Violations, describe_violations

STANDSTILL = 1e-4  # [rad/s] Below it a joint is stationary; 0.006 deg/s is far below what a tool resolves.
SETTLE_LIMIT = 300  # [cycles] Timeout for an arm that an obstacle keeps off its reference.


class CycleSignals(NamedTuple):
    """The signals of one cycle."""

    commanded: ReferenceTrajectory
    tool_c: ToolKinematics
    """The tool of the commanded motion."""
    measured: Measurement
    tool: ToolKinematics
    """The tool as measured."""
    tau_c: list[float] | None
    """Commanded torques, [N m]; None while none are commanded."""
    tau_ext: JointVector
    """External joint torques, [N m]."""
    wrench: Array
    """External wrench on the tool, base axes, [N, N m]."""


class StepResult(NamedTuple):
    """The violations of one cycle."""

    command_violations: Violations = ()
    """Of the command, or of its absence. The measurement is then not checked."""
    measured_violations: Violations = ()
    """Of the measurement; the command was followed."""


_CLEAN = StepResult()


class VirtualArm:
    """One arm. Owned by the loop that calls `step` once per cycle.

    Attributes:
        model: The arm with the configured tool and load.
        plant: The plant.
        commanded: The commanded joint angles.
        tool_c: The tool at the commanded joint angles.
        measured_state: The sensors.
        resting_law: The control law while no command is followed. BRAKED engages the brakes at standstill.
        is_monitored: Whether measurements are checked.
        on_loss: What the arm does while commands are missing, from the next motion on.
        ends_by_command: Whether a motion runs to its end only by a last command of the client, as where a request to
            stop breaks it off.
        warnings: Sentences about the motions so far; the reader clears them.
        playback: The output of the queue in the last cycle; None while no commands are followed.
        on_command: Called with every command that arrives for a motion, except for duplicates.

    Args:
        model: The arm.
        plant: The plant.
        parameters: The configuration; None: that after power-up.
        prefill: Cycles between the first command of a motion and its play-out.
        torque_prefill: The same for torques. None: `prefill`, `TORQUE_PREFILL` at most.
        skips_torques: Whether torques that are older are skipped.
        lost_limit: Consecutive lost commands that end a motion; None: no limit. See `StreamedMotion`.
        on_loss: What the arm does while commands are missing.
        friction_watch: Observes the effect of friction; None: nothing does.
    """

    def __init__(
        self,
        model: RobotModel,
        plant: Plant,
        parameters: ArmParameters | None = None,
        *,
        prefill: int = PREFILL,
        torque_prefill: int | None = None,
        skips_torques: bool = True,
        lost_limit: int | None = LOST_LIMIT,
        on_loss: LossBehaviour = "hold",
        friction_watch: FrictionWatch | None = None,
    ) -> None:
        self.model = model
        self.plant = plant
        measured = plant.reset(model.home)
        q = measured.q.tolist()
        self.commanded = ReferenceTrajectory(model.limits.joint, q)
        self.tool_c = ToolKinematics(model, q)
        self.measured_state = MeasuredStateMonitor(model, measured)
        self.resting_law = ControlLaw.BRAKED
        self.is_monitored = False
        self.playback: Playback | None = None
        self.on_command: Callable[[ArmCommand], None] = lambda command: None
        self._parameters = parameters = ArmParameters.of(model.description) if parameters is None else parameters
        self._motion = StreamedMotion(prefill, torque_prefill, lost_limit, skips_torques=skips_torques)
        self.warnings: list[str] = []
        self._has_warned = False  # Of the present pause.
        self._friction_watch = friction_watch
        self.on_loss: LossBehaviour = on_loss
        self.ends_by_command = False
        self._actuator = Actuator(model, parameters)
        self._tau_c: list[float] | None = None
        self._tool_version = self.commanded.version
        self._law = ControlLaw.BRAKED
        self._last_compliance: ControlLaw | None = None  # Until commands have moved the arm on its servos.
        self._dq_before = measured.dq
        self._cycles_at_rest = 0
        self._setpoint: Setpoint | None = None

    @property
    def playout(self) -> JitterBuffer:
        """The queue of commands, with its counts."""
        return self._motion.playout

    @property
    def mode(self) -> MotionMode:
        """The mode of the motion in progress, or of the last one."""
        return self._motion.mode

    @property
    def parameters(self) -> ArmParameters:
        """The configuration."""
        return self._parameters

    def set_prefill(self, cycles: int) -> None:
        """Sets the cycles between the first command and its play-out, of torques too, from the next motion on."""
        self._motion.set_prefill(cycles)

    @property
    def is_following(self) -> bool:
        """Whether commands are played."""
        return self._motion.is_followed

    @property
    def is_behind(self) -> bool:
        """Whether the next cycle is lost although the command of a later one has arrived."""
        return self._motion.is_behind

    @property
    def is_standstill(self) -> bool:
        """Whether its reference is stationary and its joints have stopped."""
        return self.commanded.is_stationary and (self._cycles_at_rest > SETTLE_LIMIT or self._is_slow())

    @property
    def has_stopped(self) -> bool:
        """Whether its reference is stationary and the joints are on their servos, which may still settle."""
        return self.commanded.is_stationary and not self._law.is_compliant

    @property
    def can_engage_brakes(self) -> bool:
        """Whether the arm is stationary at its reference; never while it is compliant."""
        may_rest = self.commanded.is_stationary and not self._law.is_compliant
        return may_rest and (
            self._cycles_at_rest > SETTLE_LIMIT or self.measured_state.measured.q.tolist() == self.commanded.q
        )

    @property
    def has_settled(self) -> bool:
        """Whether the control law and all counters remain constant without commands."""
        return self._cycles_at_rest > SETTLE_LIMIT and self._current_law() is self._law

    @property
    def signals(self) -> CycleSignals:
        """The signals of the last cycle."""
        sensors = self.measured_state
        return CycleSignals(
            self.commanded,
            self.tool_c,
            sensors.measured,
            sensors.tool,
            self._tau_c,
            sensors.tau_ext,
            sensors.wrench,
        )

    @property
    def drive_torque(self) -> Sequence[float] | Array | None:
        """Torque of the control law in the last cycle, without gravity, n numbers, [N m]; None on the servos."""
        return None if self._setpoint is None else self._setpoint.tau

    def reset(self, q: JointVector) -> None:
        """Places the stationary arm at other joint angles."""
        measured = self.plant.reset(readonly_copy(q))
        self.commanded.reset(measured.q.tolist())
        self.tool_c.reset(self.commanded.q)
        self._tool_version = self.commanded.version
        self._dq_before = measured.dq
        self.measured_state.configure(self.model, measured)

    def configure(self, parameters: ArmParameters) -> None:
        """Sets new parameters; another tool or load only at standstill."""
        self._parameters = parameters
        tool, load = parameters.T_flange_tool, parameters.load
        if tool is not self.model.T_flange_tool or load is not self.model.load:
            self.model = self.model.with_tool(tool).with_load(load)
            self.plant.configure(self.model)
            measured = self.plant.reset(self.measured_state.measured.q)
            self.tool_c = ToolKinematics(self.model, self.commanded.q)
            self._dq_before = measured.dq
            self.measured_state.configure(self.model, measured)
        self._actuator.configure(self.model, parameters)

    def prepare_motion(self, mode: MotionMode) -> None:
        """Resets everything for a motion in this mode."""
        self._motion.prepare(mode, self.on_loss)

    def begin_motion(
        self,
        limits: Limits,
        *,
        start: StartTolerance | None = None,
        checks_accelerations: bool = True,
        counts_replacements: bool = False,
    ) -> None:
        """Follows commands from now on, from the present reference.

        Args:
            limits: Limits of the arm for this motion; infinite where the maker has no check.
            start: Largest difference of the first command from the reference, by the maker's own rule: a start outside
                it ends the motion by this violation alone. None: `start_tolerance`, beyond which the jump violates
                limits. It is not checked for velocities and goals.
            checks_accelerations: Whether measured accelerations and the speed of the arm angle are checked.
            counts_replacements: Whether the replacement of a lost command is checked and counts as the last command,
                as where the maker's client computes with it. False: received commands are checked over the gap.
        """
        mode, parameters, sensors = self._motion.mode, self._parameters, self.measured_state
        tolerance = start_tolerance(mode.law, parameters)
        if start is not None:
            tolerance = start
        elif self._last_compliance is not None:
            tolerance = tolerance.widened(start_tolerance(self._last_compliance, parameters))
        starts = (sensors.measured.q, np.array(self.commanded.q))
        tools = (sensors.tool.pose, self.tool_c.pose)
        servos = servo_figures(self.model.description) if self._motion.on_loss == "hold" else None
        is_strict = start is not None
        bounds = build_motion_limits(
            mode,
            self.model,
            parameters,
            limits,
            starts,
            tools,
            tolerance,
            servos,
            is_strict_start=is_strict,
            counts_replacements=counts_replacements,
        )
        self._motion.begin(build_generator(mode, bounds, list(self.commanded.q)))
        sensors.begin(
            bounds.limits,
            bounds.entry_box(),
            parameters.collision_thresholds,
            checks_tool=mode.is_cartesian,
            checks_accelerations=checks_accelerations,
            is_compliant=mode.law.is_compliant,
        )
        self._tau_c = [0.0] * self.model.n if mode.law is ControlLaw.TORQUE else None
        delay = self.playout.delay
        if mode.law is ControlLaw.TORQUE and delay > PREFILL:
            self.warnings.append(
                f"torques act {delay} ms after the state that they answer: a control law of torques may oscillate; "
                f"--prefill 0 to {TORQUE_PREFILL} is for torques"
            )

    def drain_motion(self) -> None:
        """Plays the queued commands, then stops."""
        self._motion.drain()

    def discard_motion(self) -> None:
        """Discards the queued commands and stops."""
        self._motion.discard()

    def begin_guiding(self, freedom: GuidedFreedom) -> None:
        """Begins hand guiding at the present pose, once `resting_law` is GUIDE."""
        self._actuator.begin_guiding(freedom, self.measured_state.measured)

    def receive(self, command: ArmCommand) -> bool:
        """Queues a command; returns whether one was expected."""
        if not self._motion.is_followed:
            return False
        if self._motion.playout.push(command):
            self.on_command(command)
        return True

    def step(self, command: ArmCommand | None = None) -> StepResult:
        """Advances by one cycle: the reference advances, the plant moves, the sensors are read.

        Args:
            command: A command to queue first; None: none.
        """
        if command is not None:
            self.receive(command)
        result = _CLEAN
        has_moved = False
        self.playback = None
        if self._motion.is_followed:
            output = self._motion.step()
            self.playback = self._motion.playback
            if output is not None and output.violations:
                violations = output.violations
                watch = self._friction_watch
                if watch is not None and watch.has_held and self._last_compliance is not None:
                    violations = blame_friction(violations)
                result = StepResult(command_violations=violations)
                self._react()
            elif output is not None:
                has_moved = True
                self._tau_c = output.tau
                if output.q is not None:
                    self.commanded.move(output.q, output.differences)
        law = self._current_law()
        if law is not ControlLaw.TORQUE:
            self._tau_c = None
        self._move(law, has_moved=has_moved)
        if self.is_monitored:
            # The arm's own stop is a motion of the joints: the tool has no commanded motion.
            violations = self.measured_state.check(is_commanded=self._motion.is_followed)
            is_off_commands = self._motion.is_off_commands
            self._has_warned &= is_off_commands
            if violations and is_off_commands:
                violations = self._explain_by_pause(violations)
            if violations:
                result = StepResult(measured_violations=violations)
                self._react()
        return result

    def hold(self) -> bool:
        """Advances a settled arm by one cycle; returns whether its signals are those of the cycle before.

        Only after a cycle with unchanged signals, and with `has_settled`: `step` would then compute the same setpoint,
        and the same signals unless the measurement changes.
        """
        self.playback = None
        assert self._setpoint is not None
        measured = self.plant.step(self._setpoint)
        if measured is self.measured_state.measured:
            return True
        self._take(self._law, measured)
        return False

    def _explain_by_pause(self, violations: Violations) -> Violations:
        """Returns the violations of a measurement in or after a pause of the client.

        An acceleration of the servo's response does not stop the arm: it is not known which one would. A velocity does,
        and is due to the lost commands.
        """
        excused = [v for v in violations if isinstance(v, LimitViolation) and v.condition.order == 2]
        if excused and not self._has_warned:
            self._has_warned = True
            self.warnings.append(
                f"commands were missing, and the arm jolts: {describe_violations(excused)}, which no pause that is "
                "known of a real arm reaches; a real arm may stop here"
            )
        return tuple(
            blame_lost_commands(violation.remark)
            if isinstance(violation, LimitViolation) and violation.condition.order == 1
            else violation
            for violation in violations
            if violation not in excused
        )

    def _react(self) -> None:
        self._motion.discard()
        self.resting_law = ControlLaw.BRAKED
        self.is_monitored = False

    def _current_law(self) -> ControlLaw:
        if self._motion.is_followed:
            return self._motion.law
        law = self.resting_law
        return ControlLaw.POSITION if law is ControlLaw.BRAKED and not self.can_engage_brakes else law

    def _move(self, law: ControlLaw, *, has_moved: bool) -> None:
        """Moves the plant by one cycle.

        When a compliant arm becomes position-controlled, the reference starts from the measured position and velocity.

        Args:
            law: The control law.
            has_moved: Whether the commanded angles are already those of this cycle; otherwise they stop.
        """
        commanded, last = self.commanded, self.measured_state.measured
        if self._law.is_compliant and not law.is_compliant:
            ddq: list[float] = ((last.dq - self._dq_before) / CYCLE_TIME).tolist()
            commanded.join(last.q.tolist(), last.dq.tolist(), ddq)
        if has_moved and not law.is_compliant:
            self._last_compliance = None
        is_reference_measured = self._is_reference_measured(law)
        if not (is_reference_measured or commanded.is_stationary or has_moved):
            commanded.stop()
        if not is_reference_measured:
            self._move_tool()
        self._setpoint = self._actuator.setpoint(law, commanded, self.tool_c, last, self._tau_c)
        self._take(law, self.plant.step(self._setpoint))
        if self._friction_watch is not None:
            self._watch_friction(self._friction_watch)

    def _watch_friction(self, watch: FrictionWatch) -> None:
        assert self._setpoint is not None
        sensors = self.measured_state
        if self._motion.is_followed and self._law.is_compliant:
            watch.observe(self._law, self._setpoint, sensors.measured, self.tool_c, sensors.tool)
        else:
            self.warnings += watch.conclude(self._parameters)

    def _take(self, law: ControlLaw, measured: Measurement) -> None:
        """Processes the measurement of this cycle."""
        commanded, last = self.commanded, self.measured_state.measured
        if self._is_reference_measured(law):
            commanded.move(measured.q.tolist())
            self._move_tool()
        elif law is ControlLaw.BRAKED and measured.q.tolist() != commanded.q:
            commanded.reset(measured.q.tolist())
            self._move_tool()
        self._law, self._dq_before = law, last.dq
        if law.is_compliant:
            self._last_compliance = law
        self._cycles_at_rest = self._cycles_at_rest + 1 if commanded.is_stationary else 0
        self.measured_state.observe(measured, commanded, self.tool_c)

    def _is_reference_measured(self, law: ControlLaw) -> bool:
        """Returns whether forces move the arm and no motion is commanded along with them."""
        return law.is_force_driven and not (self._motion.is_followed and self._motion.mode.has_reference)

    def _is_slow(self) -> bool:
        speeds: list[float] = self.measured_state.measured.dq.tolist()
        return -STANDSTILL < min(speeds) and max(speeds) < STANDSTILL

    def _move_tool(self) -> None:
        commanded, tool = self.commanded, self.tool_c
        if commanded.version != self._tool_version or not tool.is_stationary:
            q, dq, _ = commanded.arrays
            tool.update(commanded.q, self.model.rigid_body.tool_terms(q, dq))
            self._tool_version = commanded.version
