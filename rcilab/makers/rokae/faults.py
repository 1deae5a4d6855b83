"""The twenty faults of the RCI.

A fault is a bit on the wire, a member here, a row in a report, a label in a plot and a lesson. Numbers, names,
causes and remedies: RCI manual V1.3.1, section 4.6.
"""

from __future__ import annotations

from rcilab.core.fault import FaultCode


class Fault(FaultCode):
    """One error bit of the robot state; the value is the bit's place on the wire."""

    ACTUAL_JOINT_POSITION_LIMITS_VIOLATION = 0
    ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION = 1
    ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION = 2
    ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION = 3
    ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION = 4
    ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION = 5
    ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION = 6
    COMMAND_JOINT_POSITION_LIMITS_VIOLATION = 7
    COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION = 8
    COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION = 9
    COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION = 10
    COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION = 11
    COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION = 12
    COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION = 13
    COMMAND_JOINT_ACCELERATION_DISCONTINUITY = 14
    COLLISION = 15
    CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME = 16
    COMMAND_TORQUE_DISCONTINUITY = 17
    COMMAND_TORQUE_RANGE_VIOLATION = 18
    INSTABILITY_DETECTION = 19

    @property
    def maker(self) -> str:
        """The folder of ROKAE."""
        return "rokae"

    @property
    def manual_name(self) -> str:
        """The name as the manual prints it, such as `kCollision`."""
        return "k" + "".join(word.capitalize() for word in self.name.split("_"))

    @property
    def cause(self) -> str:
        """What the robot detected, in a few words (manual 4.6, second column)."""
        return _CAUSES[self]

    @property
    def remedy(self) -> str:
        """The remedy, in one sentence (manual 4.6, third column)."""
        return _REMEDIES.get(self, _SMOOTHNESS)

    @property
    def torque_remedy(self) -> str:
        """The remedy in torque mode, where a planner cannot help."""
        return _REMEDIES.get(self, _GAINS)

    @property
    def impedance_remedy(self) -> str:
        """The remedy under impedance, where forces move the arm, too."""
        return _YIELDED if self in _MEASURED_RATES else self.remedy

    @property
    def outside_remedy(self) -> str:
        """The remedy for a motion whose commands kept their limits."""
        return _PUSHED if self in _MEASURED_RATES else self.remedy


FAULT_COUNT = len(Fault)


_CAUSES = {
    Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION: "a measured joint angle left its range",
    Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION: "the measured tool pose left the safety box",
    Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION: "the measured arm angle turned too fast",
    Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION: "a measured joint velocity was too high",
    Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION: "the measured tool velocity was too high",
    Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION: "a measured joint acceleration was too high",
    Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION: "the measured tool acceleration was too high",
    Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION: "a commanded joint angle is outside its range",
    Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION: "the commanded tool pose is outside the safety box",
    Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION: (
        "the commanded arm angle exceeded one of its bounds (angle, velocity, acceleration or jerk)"
    ),
    Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION: "a commanded joint velocity is too high",
    Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION: "the commanded tool velocity is too high",
    Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION: "a commanded joint acceleration is too high",
    Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION: "the commanded tool acceleration is too high",
    Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY: "a commanded joint acceleration jumps (jerk too high)",
    Fault.COLLISION: "an external torque exceeded its collision threshold",
    Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME: "the arm is at a singularity or the pose is not valid",
    Fault.COMMAND_TORQUE_DISCONTINUITY: "a commanded torque jumps (torque rate too high)",
    Fault.COMMAND_TORQUE_RANGE_VIOLATION: "a commanded torque is too high",
    Fault.INSTABILITY_DETECTION: (
        "too many commands in a row were lost, or the lost ones could not be bridged smoothly"
    ),
}

_SMOOTHNESS = (
    "check that the planned motion is continuous up to its acceleration and inside the limits of section 4.4; "
    "otherwise lower the speed or filter the motion"
)

_GAINS = (
    "let torques grow gradually and keep them inside the limits of section 4.4; if your own control law oscillates, "
    "lower its damping first: the loop is unstable if a joint's damping exceeds its effective inertia (other joints "
    "free) divided by the loop delay, and the wrist has little inertia"
)

_YIELDED = (
    "forces moved the arm faster than it may be, whatever was commanded: look for a push, let a desired wrench grow "
    "gradually and keep it below what holds the arm (set_cart_imp_desired_tau), or raise the stiffness"
)

_PUSHED = (
    "the last commands kept their limits, so look for what else moves the arm: contact, a push, or a load that the "
    "controller does not know of (set_load)"
)

_MEASURED_RATES = frozenset(
    {
        Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
        Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION,
        Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
        Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION,
        Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,
    }
)

_BOX = (
    "keep the tool inside the safety box; a motion that starts outside it may only move inwards: recover, or "
    "switch the power off and on if that is refused (in Python, execute(plan_recovery(robot.model, "
    "robot.state.q_c, robot.safety_box)) then moves it back)"
)

_RANGE = (
    "the joint is beyond its range or its soft limit: recover, or switch the power off and on if that is refused; "
    "switch the power on if it is off, as after a joint limit without auto_limit; then move the joint back inside "
    "(“Move back inside” on the Run tab; in Python: execute(plan_recovery(robot.model, robot.state.q_c)))"
)
RANGE_FAULTS = frozenset({Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION, Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION})
"""Faults after which `recover()` may be refused: the arm can be too far outside."""
BOX_FAULTS = frozenset(
    {Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION, Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION}
)
"""The same for the safety box."""

_REMEDIES = {
    Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION: _RANGE,
    Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION: _RANGE,
    Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION: _BOX,
    Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION: _BOX,
    Fault.COLLISION: "check for contact; if the fault is raised without contact, raise the collision thresholds "
    "(an emergency stop can also raise this bit)",
    Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME: "keep Cartesian motions away from singular poses",
    Fault.COMMAND_TORQUE_DISCONTINUITY: _GAINS,
    Fault.COMMAND_TORQUE_RANGE_VIOLATION: _GAINS,
    Fault.INSTABILITY_DETECTION: "check the network and the real-time configuration, and let the controller play "
    "commands later (a virtual one: --prefill 50); a higher packet-loss threshold (usually 10 to 20) helps only if "
    "many commands in a row were lost; an emergency stop can also raise this bit",
}
