"""The controller of a RealMan arm: requests in, motions through the planner, errors and states out. No sockets.

Errors of the system that stop the arm remain until clear_system_err, and refuse motions; those of a refused request are
shown until the next accepted one. The bits of a joint remain until set_joint_clear_err, and refuse motions and changes
of that joint. A disabled joint is held by its brake and refuses motions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState
from rcilab.i18n.translator import Remark
from rcilab.makers.realman.bounds import MOST_SENSITIVE
from rcilab.makers.realman.controller.arm_drive import ArmDrive
from rcilab.makers.realman.controller.fault_of import REFUSALS, errors_of
from rcilab.makers.realman.controller.fence import FenceWatch
from rcilab.makers.realman.controller.flash import Flash
from rcilab.makers.realman.controller.joint_parameters import RECOMMENDED_RATIO, JointParameters, require_joint
from rcilab.makers.realman.controller.programs import Program, RunningProgram
from rcilab.makers.realman.controller.reporter import report_state
from rcilab.makers.realman.controller.settings import SIGNALS, Settings, ToolFrame
from rcilab.makers.realman.controller.trajectories import Trajectory, TrajectoryQueue
from rcilab.makers.realman.errors import JOINT_BITS, REFUSED_COMMANDS, RealManError
from rcilab.model.robot_model import RobotModel
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.api import SafetyButton
from rcilab.sim.arm_setup import ArmSetup, require_stand
from rcilab.sim.planner import EventKind, PlannerState, Refusal, Target
from rcilab.sim.self_collision import SelfCollisionWatch
from rcilab.sim.violations import describe_violations
from rcilab.sim.virtual_arm import VirtualArm

_PHASES = {PlannerState.IDLE: "idle", PlannerState.MOVING: "moving", PlannerState.PAUSED: "paused"}
_ESTOP = Remark("the emergency stop was pressed", "estop")


class RealManController:
    """The controller without its sockets. Owned by the loop that calls `step`, once a millisecond.

    Attributes:
        arm: The arm.
        drive: The planner, and the arm that follows it.
        trajectories: Those of clients.
        parameters: Of the joints.
        settings: All other settings.
        enabled: Whether each joint is enabled.
        joint_errors: The error word of each joint.
        system_errors: The errors of the system, in the order in which they came.
        is_powered: Whether motor power is on.
        is_real: Whether motions move the arm; otherwise they are only shown.
        streamed: What clients stream, "joint" or "pose", while they do; else "".
        is_teaching: Whether the arm moves until the end of a teach command.
        is_dragging: Whether drag teaching is on: the arm takes no motion.
        records: Whether drag teaching is recorded.
        recorded: The points of the last recording, [0.001 deg].
        programs: Those that are stored, by number.
        program: The one that runs.
        default_program: Number of the one that an input starts; 0: no program.
        reason: Reason for the last error.
        state: The last state.
        on_end: Called with a trajectory that has ended, and whether it reached its end.
        on_log: Called with kind and text of an event.

    Args:
        arm: The arm after power-up.
        flash: The memory of the controller.
    """

    loop_back = False
    auto_limit = False
    buttons: tuple[SafetyButton, ...] = ("estop",)
    limit_table = "manual"
    wants_commands = False
    awaits_start = False
    is_starved = False
    lacks_commands = False

    def __init__(self, arm: VirtualArm, flash: Flash) -> None:
        n = arm.model.n
        self.arm = arm
        self._flash = flash
        self.parameters, self._warning = flash.load(JointParameters.of_arm(arm.model.limits.joint))
        self.settings = Settings(init_pose=(0,) * n)
        self.drive = ArmDrive(arm, self.limits)
        self.trajectories = TrajectoryQueue()
        self.enabled = [True] * n
        self.joint_errors = [0] * n
        self.system_errors: tuple[RealManError, ...] = ()
        self.is_powered = self.is_real = True
        self.streamed = ""
        self.is_teaching = self.is_dragging = self.records = False
        self.recorded: list[list[int]] = []
        self.programs: dict[int, Program] = {}
        self.program: RunningProgram | None = None
        self.default_program = 0
        self._needs_configuration = True
        self._tool = self.settings.tool  # As configured.
        self.reason = Remark("")
        self.button: SafetyButton = "none"
        self.ignored = 0
        self._inputs = [False] * SIGNALS
        self._links = SelfCollisionWatch(arm.model)
        self._fence = FenceWatch(arm.model)
        self._is_watching = False
        self._arrived: list[Trajectory] = []  # Until the arm stands.
        self._number = 0
        self.on_end: Callable[[Trajectory, bool, bool], None] = lambda trajectory, reached, continues: None
        self.on_log: Callable[[str, str], None] = lambda kind, text: None
        arm.on_loss = "bridge"
        self._hold()
        self.state = self._report()

    @property
    def model(self) -> RobotModel:
        """The arm with its tool and load."""
        return self.arm.model

    @property
    def limits(self) -> Limits:
        """The limits in force, in the angles that the joints read."""
        return self.settings.tip.limits(self.parameters.limits(self.arm.model.limits))

    @property
    def q(self) -> JointVector:
        """The angles that the joints read, shape (n,), [rad]."""
        return self.drive.q

    @property
    def T_work_tool(self) -> Pose:
        """The pose of the tool in the current work frame."""
        return self.settings.T_base_work.inverse() @ self.model.forward(self.q)

    @property
    def cycle_number(self) -> int:
        """The number of the last state."""
        return self._number

    @property
    def phase_name(self) -> str:
        """What it does: "idle", "moving", "paused" or "fault"."""
        return "fault" if self._has_fault else _PHASES[self.drive.planner.state]

    @property
    def _has_fault(self) -> bool:
        """Whether an error is set that stopped the arm."""
        joints, system = self.joint_errors, self.system_errors
        return (any(joints) and any(word & ~RealManError.JOINT_POSITION_STEP.code for word in joints)) or any(
            error not in REFUSED_COMMANDS for error in system
        )

    @property
    def faults(self) -> tuple[RealManError, ...]:
        """The errors that stopped the arm, of system and joints; not those of refused commands."""
        if not (self.system_errors or any(self.joint_errors)):
            return ()
        bits = [error for error in JOINT_BITS if any(word & error.code == error.code for word in self.joint_errors)]
        return (*(error for error in self.system_errors if error not in REFUSED_COMMANDS), *sorted(bits))

    @property
    def safety_box(self) -> SafetyBox | None:
        """None: this controller has none."""
        return None

    @property
    def inputs(self) -> tuple[int, ...]:
        """Numbers of the digital inputs that are high, from 0."""
        levels = self.settings.outputs if self.loop_back else self._inputs
        return tuple(number for number, level in enumerate(levels) if level)

    @property
    def is_moving(self) -> bool:
        """Whether the arm moves, or will."""
        return not self.drive.is_still or self.drive.is_stopping

    @property
    def is_between_motions(self) -> bool:
        """Whether the arm stands after a planned motion; after streamed commands more may still come."""
        planner = self.drive.planner
        is_planned = planner.streamed is None and self.program is None
        return is_planned and not (self.is_moving or planner.queued)

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input.

        Raises:
            InvalidValueError: There is no such input.
        """
        if not 0 <= signal < SIGNALS:
            raise InvalidValueError("digital input", signal, f"must be 0 to {SIGNALS - 1}")
        self._inputs[signal] = level

    def guide(self, on: bool) -> None:
        """Raises an error: hand guiding is not simulated.

        Raises:
            UsageError: Always.
        """
        raise UsageError("hand guiding of this arm is not simulated")

    def press_button(self, button: SafetyButton) -> None:
        """Presses or releases the emergency stop."""
        if button != self.button:
            self.button = button
            if button != "none":
                self.reason = _ESTOP
                self.stop_at_once()
            self._hold()

    def set_up(self, setup: ArmSetup) -> None:
        """Sets the arm up: joint angles, tool and load.

        Raises:
            InvalidValueError: A value is out of its bounds, or the arm cannot stand at the joint angles.
            UsageError: The arm moves.
        """
        if self.is_moving:
            raise UsageError(f"the arm cannot be set up or placed in phase {self.phase_name}; end its motion first")
        if setup.safety_box is not None or setup.soft_limits is not None:
            raise InvalidValueError("setup", setup, "takes no safety box and no soft limits: set_joint_min_pos does")
        arm = self.arm
        parameters = arm.parameters
        if setup.T_flange_tool is not None:
            parameters = replace(parameters, T_flange_tool=setup.T_flange_tool)
        if setup.load is not None:
            parameters = replace(parameters, load=setup.load)
        if setup.q is not None:
            require_stand(arm.model.with_tool(parameters.T_flange_tool), setup.q, parameters, arm.plant)
        arm.model.with_load(parameters.load)  # Before anything changes.
        tool = ToolFrame(
            T_flange_tool=parameters.T_flange_tool,
            mass=parameters.load.mass,
            center=tuple(parameters.load.center_of_mass.tolist()),
        )
        self.settings = self.settings.with_tool(self.settings.tool_frame, tool)
        self._tool = tool
        arm.configure(parameters)
        if setup.q is not None:
            arm.reset(readonly_copy(setup.q))
        self._configure()

    def change(self, settings: Settings) -> None:
        """Takes new settings; those of tool and limits act once the arm stands."""
        before, self.settings = self.settings, settings
        if settings.tool is not before.tool or settings.tip != before.tip:
            self._needs_configuration = True
        if settings.collision_stage != before.collision_stage:
            self._needs_configuration = True
        if (settings.fence, settings.fence_side) != (before.fence, before.fence_side):
            self._fence.begin()

    def set_joint_value(self, name: str, joint: int, value: int, *, is_drive: bool) -> None:
        """Sets a parameter of a joint, see `JointParameters`.

        Raises:
            InvalidValueError: The joint has an error or is enabled, or the value is out of its bounds.
        """
        self._require_settable(joint)
        self._keep(self.parameters.with_value(name, joint, value, is_drive=is_drive))
        if name in ("max_speed", "max_acc") and self.parameters.ratio(joint) < RECOMMENDED_RATIO:
            ratio = self.parameters.ratio(joint)
            text = f"joint {joint}: acceleration [RPM/s] and speed [RPM] have a ratio of {ratio:.3g}"
            self.on_log("warning", f"{text}; at least {RECOMMENDED_RATIO} is recommended")

    def set_zero(self, joint: int) -> None:
        """Makes the present angle of a joint its zero.

        Raises:
            InvalidValueError: The joint has an error or is enabled.
        """
        self._require_settable(joint)
        self._keep(self.parameters.with_zero(joint, float(self.arm.signals.measured.q[joint - 1])))

    def restore_ranges(self) -> None:
        """Sets the ranges of all joints to those of the specification.

        Raises:
            InvalidValueError: A joint has an error or is enabled.
        """
        for joint in range(1, self.model.n + 1):
            self._require_settable(joint)
        self._keep(self.parameters.with_factory_ranges())

    def enable_joint(self, joint: int, on: bool) -> None:
        """Enables or disables a joint.

        Raises:
            InvalidValueError: There is no such joint, it has an error, or it is to be enabled while it moves.
        """
        require_joint(joint, self.model.n)
        if on:
            self._require_no_error(joint)
            if not self.drive.is_still or self.drive.is_stopping:
                raise InvalidValueError("joint", joint, "moves; it must stand still to be enabled")
        elif self.enabled[joint - 1] and self.is_moving:
            self._fail(
                RealManError.JOINT_DISABLED,
                Remark(f"joint {joint} was disabled during a motion", "joint_disabled", joint=joint),
            )
        self.enabled[joint - 1] = on
        self._hold()

    def clear_joint_error(self, joint: int) -> None:
        """Clears the error word of a joint.

        Raises:
            InvalidValueError: There is no such joint.
        """
        self.joint_errors[require_joint(joint, self.model.n) - 1] = 0

    def clear_system_errors(self) -> None:
        """Clears the errors of the system."""
        self.system_errors = ()

    def switch_power(self, on: bool) -> None:
        """Switches motor power; without it every joint is disabled."""
        if not on and self.is_moving:
            self.stop_at_once()
        self.is_powered = on
        self.enabled = [on] * self.model.n
        self._hold()

    def set_error(self, error: RealManError, reason: Remark, joint: int = 0) -> None:
        """Shows an error, of a joint if it is one of its bits."""
        self.reason = reason
        if joint:
            self.joint_errors[joint - 1] |= error.code
        elif error not in self.system_errors:
            self.system_errors = (*self.system_errors, error)

    def require_ready(self) -> None:
        """Requires an arm that can move.

        Raises:
            UsageError: A joint is disabled or has an error, an error is set, or the emergency stop is pressed.
        """
        lasting = [error for error in self.system_errors if error not in REFUSED_COMMANDS]
        if self.is_dragging:
            raise UsageError("the motion is not possible: drag teaching is on; stop_drag_teach ends it")
        if self.button != "none":
            raise UsageError("the motion is not possible: the emergency stop is pressed")
        if lasting:
            raise UsageError(f"the motion is not possible: {lasting[0].manual_name}; clear_system_err")
        for joint, (word, is_on) in enumerate(zip(self.joint_errors, self.enabled, strict=True), 1):
            self._require_no_error(joint, word)
            if not is_on:
                problem = f"joint {joint} is disabled; set_joint_en_state enables it"
                self.set_error(RealManError.JOINT_DISABLED, Remark(problem, "joint_disabled", joint=joint))
                raise UsageError(f"the motion is not possible: {problem}")

    def begin_command(self) -> None:
        """Prepares for a motion command: the errors of refused ones are gone."""
        self.require_ready()
        self.system_errors = tuple(error for error in self.system_errors if error not in REFUSED_COMMANDS)
        if self._needs_configuration and self.drive.is_still and not self.drive.is_stopping:
            self._configure()

    def add(self, target: Target, trajectory: Trajectory) -> None:
        """Appends a target; it begins with the others of its chain."""
        self.add_all(self.trajectories.add(target, trajectory))

    def add_all(self, targets: list[Target]) -> None:
        """Passes targets to the planner."""
        if targets:
            if self.is_teaching:
                self.drive.planner.end()
            self.streamed, self.is_teaching, self.program = "", False, None
        for target in targets:
            self.drive.planner.add(target)

    def slow_stop(self) -> None:
        """Stops on the path, and discards all trajectories."""
        self.discard_waiting()
        self.drive.planner.end()
        self.streamed, self.is_teaching, self.program = "", False, None

    def stop_at_once(self) -> None:
        """Stops every joint as fast as its limits allow, and discards all trajectories."""
        self.discard_waiting()
        self.drive.planner.stop()
        self.streamed, self.is_teaching, self.program = "", False, None

    def discard_waiting(self) -> None:
        """Reports the end of the trajectories that wait for others of their chain, and forgets them."""
        for trajectory in self.trajectories.pop_waiting():
            self.on_end(trajectory, False, False)

    def step(self) -> RobotState:
        """Advances by one cycle and returns the state at its end."""
        self._number += 1
        if self._warning:
            warning, self._warning = self._warning, ""
            self.on_log("warning", warning)
        if self._needs_configuration and self.drive.is_still and not self.drive.is_stopping:
            self._configure()
        commands, measured = self.drive.step()
        if commands or measured:
            self.reason = describe_violations(commands or measured)
            for error, joint in errors_of(commands or measured):
                self.set_error(error, self.reason, joint)
            self._end_all()
        self._check_surroundings()
        for event in self.drive.events:
            self._handle(event.id, event.kind, event.refusal)
        if self._arrived and (self.drive.is_still or self.drive.planner.state is PlannerState.MOVING):
            self._report_arrivals()
        if self.streamed and self.drive.is_still:
            self.streamed = ""
        self.state = self._report()
        return self.state

    def _handle(self, number: int, kind: EventKind, refusal: Refusal | None) -> None:
        if kind is EventKind.BEGAN:
            return
        trajectory = self.trajectories.pop(number)
        if kind is EventKind.REFUSED and refusal is not None:
            error = REFUSALS[refusal.reason]
            self.set_error(error, refusal.remark)
            self.on_log("refused", f"a trajectory was refused: {error.manual_name}: {refusal.remark}")
        if trajectory is None:
            return
        if kind is EventKind.REACHED:
            self._arrived.append(trajectory)
        else:
            self._report_arrivals()
            self.on_end(trajectory, False, trajectory.is_followed_by_another)

    def _report_arrivals(self) -> None:
        """Reports the trajectories that have reached their ends: the arm stands, or moves on."""
        arrived, self._arrived = self._arrived, []
        for trajectory in arrived:
            self.on_end(trajectory, True, trajectory.is_followed_by_another)

    def _check_surroundings(self) -> None:
        """Stops a motion in which links touch or go beyond the fence; an arm that does so already may move back."""
        q, settings = self.arm.signals.measured.q, self.settings
        was_watching, self._is_watching = self._is_watching, self.arm.is_following
        if not self._is_watching:
            return
        if not was_watching:
            self._links.begin(q)
            self._fence.begin()
        touching = self._links.step(q) if settings.avoids_self_collision else None
        if touching is not None:
            self._fail(RealManError.SELF_COLLISION, touching)
        fence = settings.fence if settings.is_fenced else None
        beyond = None if fence is None else self._fence.step(q, fence, settings.fence_side)
        if beyond is not None:
            self._fail(RealManError.FENCE, beyond)

    def _end_all(self) -> None:
        """Reports the end of every trajectory that a fault has discarded."""
        self.streamed, self.is_teaching, self.program = "", False, None
        self._report_arrivals()
        for trajectory in self.trajectories.pop_all():
            self.on_end(trajectory, False, False)
        self.discard_waiting()

    def _fail(self, error: RealManError, reason: Remark) -> None:
        self.set_error(error, reason)
        self.drive.abort()
        self._end_all()

    def _require_settable(self, joint: int) -> None:
        word = self.joint_errors[require_joint(joint, self.model.n) - 1]
        if word:
            raise _joint_error(joint, word)
        if self.enabled[joint - 1]:
            raise InvalidValueError("joint", joint, "is enabled; disable it with set_joint_en_state first")

    def _require_no_error(self, joint: int, word: int | None = None) -> None:
        """Requires a joint that may move: a step of a stream is a warning."""
        word = self.joint_errors[joint - 1] if word is None else word
        if word & ~RealManError.JOINT_POSITION_STEP.code:
            raise _joint_error(joint, word)

    def _keep(self, parameters: JointParameters) -> None:
        self.parameters = parameters
        problem = self._flash.store(parameters)
        if problem:
            self.on_log("warning", problem)
        self._needs_configuration = True
        if self.drive.is_still and not self.drive.is_stopping:
            self._configure()

    def _configure(self) -> None:
        self._needs_configuration = False
        arm, tool = self.arm, self.settings.tool
        stage = self.settings.collision_stage
        part = np.inf if not stage else 1.0 - stage / (MOST_SENSITIVE + 1.0)
        thresholds = tuple((part * arm.model.limits.joint.torque).tolist())
        parameters = replace(arm.parameters, collision_thresholds=thresholds)
        self.drive.release()
        if tool is not self._tool:
            parameters = replace(parameters, T_flange_tool=tool.T_flange_tool, load=tool.load)
            self._tool = tool
        arm.configure(parameters)
        self.drive.configure(self.limits, self.parameters.zero)

    def _hold(self) -> None:
        is_held = self.is_powered and all(self.enabled) and self.button == "none"
        self.arm.resting_law = ControlLaw.POSITION if is_held else ControlLaw.BRAKED

    def _report(self) -> RobotState:
        is_moving = self.is_moving
        return report_state(
            self._number,
            self.arm.model,
            self.arm.signals,
            faults=self.faults,
            motion_generator_mode=MotionGeneratorMode.JOINT_POSITION if is_moving else MotionGeneratorMode.IDLE,
            controller_mode=ControllerMode.JOINT_POSITION if is_moving else ControllerMode.OTHER,
            robot_mode=self._robot_mode(is_moving),
        )

    def _robot_mode(self, is_moving: bool) -> RobotMode:
        if self.button != "none":
            return RobotMode.USER_STOPPED
        if self._has_fault:
            return RobotMode.REFLEX
        return RobotMode.MOVE if is_moving else RobotMode.IDLE


def _joint_error(joint: int, word: int) -> InvalidValueError:
    return InvalidValueError("joint", joint, f"has the error 0x{word:04X}; set_joint_clear_err clears it")
