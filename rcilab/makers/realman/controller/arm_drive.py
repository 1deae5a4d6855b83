"""The planner and the arm that follows it: one joint command a cycle while the planner moves.

Angles of this module are those that the joints read. The arm has those of its mechanics: they differ by the zeros that
a client has set.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.limits import Limits
from rcilab.core.spatial import Pose
from rcilab.makers.realman.bounds import ANGLE_STEP, SPEED_ALLOWANCE
from rcilab.makers.realman.controller.tool_watch import ToolWatch
from rcilab.motion.bounds import range_from
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators import CommandKind, MotionMode
from rcilab.sim.planner import Planner, PlannerEvent, PlannerState
from rcilab.sim.virtual_arm import StepResult, VirtualArm

_ROUNDING = radians(ANGLE_STEP)  # [rad] An angle at the end of a range is inside it.
_ALLOWANCE = 1.5  # Factor on accelerations: paths of the tool are planned from samples.
_LINGER = 500  # [cycles] A motion ends when nothing has moved for so long: beginning one takes more than a cycle.
_MODE = MotionMode(ControlLaw.POSITION, CommandKind.JOINT_ANGLES)


class ArmDrive:
    """Advances planner and arm. Owned by the controller.

    Attributes:
        arm: The arm.
        planner: The planner.
        events: Those of the planner in the last step.

    Args:
        arm: The arm after power-up.
        limits: Those in force, in the angles that the joints read.
    """

    def __init__(self, arm: VirtualArm, limits: Limits) -> None:
        arm.set_prefill(0)
        self.arm = arm
        self._zero = np.zeros(arm.model.n)
        self._limits = limits
        self._number = 0
        self._is_stopping = False  # After a fault, until the arm stands.
        self._idle_cycles = 0  # Cycles since something has moved.
        self._only_shown: list[float] | None = None  # Joint angles of a simulated arm.
        self.planner = Planner(arm.model, limits, arm.commanded.q)
        self.events: tuple[PlannerEvent, ...] = ()
        self._tool = ToolWatch()
        self._too_fast: tuple[LimitViolation, ...] = ()  # What the last streamed poses exceed.

    @property
    def q(self) -> JointVector:
        """Measured joint angles, or those of the simulated arm, shape (n,), [rad]."""
        if self._only_shown is not None:
            return np.array(self._only_shown)
        return self.arm.signals.measured.q - self._zero

    @property
    def q_c(self) -> list[float]:
        """Commanded joint angles, n plain floats, [rad]."""
        if self._only_shown is not None:
            return list(self._only_shown)
        return (np.array(self.arm.commanded.q) - self._zero).tolist()

    @property
    def is_simulated(self) -> bool:
        """Whether motions are only shown: the arm stands."""
        return self._only_shown is not None

    @property
    def is_still(self) -> bool:
        """Whether the planner has nothing to do, and the arm stands."""
        return self.planner.state is not PlannerState.MOVING and self.arm.commanded.is_stationary

    @property
    def is_stopping(self) -> bool:
        """Whether the arm stops after a fault."""
        return self._is_stopping

    def configure(self, limits: Limits, zero: tuple[float, ...]) -> None:
        """Sets limits, zeros, and the tool of the arm; only while it is still."""
        arm = self.arm
        self._zero, self._limits = np.array(zero), limits
        lower = tuple((limits.joint.lower + self._zero - _ROUNDING).tolist())
        upper = tuple((limits.joint.upper + self._zero + _ROUNDING).tolist())
        arm.configure(replace(arm.parameters, joint_lower=lower, joint_upper=upper))
        self._restart()

    def release(self) -> None:
        """Ends the motion that lingers after its end, before what needs a standing arm; only while it is still."""
        self.arm.discard_motion()
        self.arm.is_monitored = False

    def simulate(self, on: bool) -> None:
        """Begins or ends to show motions only, while it is still; a simulated arm begins where the real one is."""
        if on is not self.is_simulated:
            self.release()
            self._only_shown = self.q_c if on else None
            self._restart()

    def _restart(self) -> None:
        """Lets the planner begin again where the arm is; a joint outside its range may move inwards."""
        q = self.q_c
        limits = replace(self._limits, joint=range_from(self._limits.joint, np.array(q)))
        self.planner.configure(self.arm.model, limits)
        self.planner.reset(q)

    def abort(self) -> None:
        """Stops the arm by itself, as after a fault, and discards all targets."""
        self._tool.reset()
        self.arm.discard_motion()
        self.planner.reset(self.q_c)
        self._is_stopping = self._only_shown is None

    def step(self) -> StepResult:
        """Advances by one cycle."""
        arm, planner = self.arm, self.planner
        if self._is_stopping and arm.has_stopped:
            self._is_stopping = False
            self._restart()
        if self._is_stopping or not (arm.is_following or planner.state is PlannerState.MOVING):
            self.events = planner.take_events()
            return arm.step()
        q, self.events = planner.step()
        if self._only_shown is not None:
            self._only_shown = q
            return arm.step()
        if not arm.is_following:
            self._begin()
        self._number += 1
        result = arm.step(ArmCommand(self._number, tuple((np.array(q) + self._zero).tolist())))
        if self._too_fast:
            result = StepResult(measured_violations=(*result.measured_violations, *self._too_fast))
            self._too_fast = ()
        if result.command_violations or result.measured_violations:
            self.abort()
            self.events += planner.take_events()
        self._idle_cycles = 0 if not self.is_still else self._idle_cycles + 1
        if self._idle_cycles > _LINGER:
            arm.discard_motion()
        return result

    def watch_tool(self, cycle: int, pose: Pose) -> None:
        """Observes a pose before it is followed along a curve.

        Args:
            cycle: Number of the cycle in which it came.
            pose: Of the tool in base.
        """
        standing = self.arm.model.forward(self.q) if self.is_still else None
        self._too_fast = self._tool.take(cycle, pose, self._limits.cartesian, standing)

    def end_tool_watch(self) -> None:
        """Ends the stream of poses that are observed: other commands came."""
        self._tool.reset()

    def _begin(self) -> None:
        arm = self.arm
        self._idle_cycles = 0
        arm.prepare_motion(_MODE)
        joint = self._limits.joint
        checked = replace(
            joint,
            velocity=readonly_copy(SPEED_ALLOWANCE * joint.velocity),
            acceleration=readonly_copy(_ALLOWANCE * joint.acceleration),
            jerk=np.full(arm.model.n, np.inf),  # Jerks have no error.
        )
        arm.begin_motion(replace(self._limits, joint=checked), checks_accelerations=False)
        arm.is_monitored = True


def find_outside(q: JointVector, limits: Limits) -> tuple[int, float] | None:
    """Returns the first joint, from 1, that is outside its range, and the end that it passes, [rad]; else None."""
    joint = limits.joint
    for number, (angle, low, high) in enumerate(zip(q.tolist(), joint.lower, joint.upper, strict=True), 1):
        if not low <= angle <= high:
            return number, float(low if angle < low else high)
    return None
