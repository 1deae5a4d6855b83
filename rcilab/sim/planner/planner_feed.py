"""Planned joint angles of a virtual arm, as the commands of a motion that begins and ends by itself."""

from __future__ import annotations

from typing import NamedTuple

from rcilab.core.limits import Limits
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.planner.planner import Planner, PlannerState
from rcilab.sim.planner.planner_event import PlannerEvent
from rcilab.sim.violations import Violations
from rcilab.sim.virtual_arm import VirtualArm

_LINGER = 500  # [cycles] A motion ends when nothing has moved for so long: beginning one takes more than a cycle of it.
_MODE = MotionMode(ControlLaw.POSITION, CommandKind.JOINT_ANGLES)


class FedStep(NamedTuple):
    """The result of one cycle."""

    events: tuple[PlannerEvent, ...]
    command_violations: Violations = ()
    """Of the planned angles; the arm has not followed them and stops, and all targets are discarded."""
    measured_violations: Violations = ()
    """Of the measurement; the arm stops, and all targets are discarded."""


class PlannerFeed:
    """Moves a virtual arm by a planner. Owned by the controller's loop, which calls `step` instead of the arm's.

    The arm must have a prefill of 0 and, with power on, the resting law POSITION. While nothing is to move, it only
    steps the arm.

    Attributes:
        arm: The arm.
        planner: The planner.
        limits: Limits that the arm checks, from the next motion on; infinite where the maker has no check.

    Args:
        arm: As the attribute.
        planner: As the attribute.
        limits: As the attribute.
    """

    def __init__(self, arm: VirtualArm, planner: Planner, limits: Limits) -> None:
        self.arm, self.planner, self.limits = arm, planner, limits
        self._number = 0
        self._rest = 0  # Cycles since something has moved.

    @property
    def is_feeding(self) -> bool:
        """Whether the arm follows the planner."""
        return self.arm.is_following

    def abort(self) -> None:
        """Stops the arm on its own stop path and discards all targets, as after a fault."""
        self.arm.discard_motion()
        self.arm.is_monitored = False
        self.planner.reset(self.arm.commanded.q)

    def step(self) -> FedStep:
        """Advances planner and arm by one cycle."""
        arm, planner = self.arm, self.planner
        if not arm.is_following and not self._begin():
            result = arm.step()
            return FedStep(planner.take_events(), *result)
        q, events = planner.step()
        self._number += 1
        result = arm.step(ArmCommand(self._number, tuple(q)))
        if any(result):
            self.abort()
            return FedStep((*events, *planner.take_events()), *result)
        is_moving = planner.state is PlannerState.MOVING or not arm.commanded.is_stationary
        self._rest = 0 if is_moving else self._rest + 1
        if self._rest > _LINGER:
            arm.discard_motion()
            arm.is_monitored = False
        return FedStep(events)

    def _begin(self) -> bool:
        """Begins a motion if there is something to move and the arm stands; returns whether it has begun."""
        arm, planner = self.arm, self.planner
        if not arm.commanded.is_stationary:
            return False
        planner.place(arm.commanded.q)
        if planner.state is not PlannerState.MOVING:
            return False
        arm.prepare_motion(_MODE)
        arm.begin_motion(self.limits)
        arm.is_monitored = True
        self._rest = 0
        return True
