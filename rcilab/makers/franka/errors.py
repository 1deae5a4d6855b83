"""The errors of Franka's control interface, each with the name its client library prints.

An error is one of 41 flags of the robot state; the value is its index there. Franka's page "Errors" explains the names;
those that the page leaves out are explained from their names. Two of Franka's terms differ from the usual: a velocity
"discontinuity" is an acceleration beyond its limit, an acceleration "discontinuity" a jerk.
"""

from __future__ import annotations

from rcilab.core.fault import FaultCode


class FrankaError(FaultCode):
    """One error flag of the Panda's robot state; the value is its index."""

    JOINT_POSITION_LIMITS_VIOLATION = 0
    CARTESIAN_POSITION_LIMITS_VIOLATION = 1
    SELF_COLLISION_AVOIDANCE_VIOLATION = 2
    JOINT_VELOCITY_VIOLATION = 3
    CARTESIAN_VELOCITY_VIOLATION = 4
    FORCE_CONTROL_SAFETY_VIOLATION = 5
    JOINT_REFLEX = 6
    CARTESIAN_REFLEX = 7
    MAX_GOAL_POSE_DEVIATION_VIOLATION = 8
    MAX_PATH_POSE_DEVIATION_VIOLATION = 9
    CARTESIAN_VELOCITY_PROFILE_SAFETY_VIOLATION = 10
    JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID = 11
    JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION = 12
    JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION = 13
    JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY = 14
    JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY = 15
    CARTESIAN_POSITION_MOTION_GENERATOR_START_POSE_INVALID = 16
    CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION = 17
    CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION = 18
    CARTESIAN_MOTION_GENERATOR_VELOCITY_DISCONTINUITY = 19
    CARTESIAN_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY = 20
    CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT = 21
    CARTESIAN_MOTION_GENERATOR_START_ELBOW_INVALID = 22
    FORCE_CONTROLLER_DESIRED_FORCE_TOLERANCE_VIOLATION = 23
    START_ELBOW_SIGN_INCONSISTENT = 24
    COMMUNICATION_CONSTRAINTS_VIOLATION = 25
    POWER_LIMIT_VIOLATION = 26
    CARTESIAN_MOTION_GENERATOR_JOINT_POSITION_LIMITS_VIOLATION = 27
    CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_LIMITS_VIOLATION = 28
    CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_DISCONTINUITY = 29
    CARTESIAN_MOTION_GENERATOR_JOINT_ACCELERATION_DISCONTINUITY = 30
    CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG = 31
    CONTROLLER_TORQUE_DISCONTINUITY = 32
    JOINT_P2P_INSUFFICIENT_TORQUE_FOR_PLANNING = 33
    TAU_J_RANGE_VIOLATION = 34
    INSTABILITY_DETECTED = 35
    JOINT_MOVE_IN_WRONG_DIRECTION = 36
    CARTESIAN_SPLINE_MOTION_GENERATOR_VIOLATION = 37
    JOINT_VIA_MOTION_GENERATOR_PLANNING_JOINT_LIMIT_VIOLATION = 38
    BASE_ACCELERATION_INITIALIZATION_TIMEOUT = 39
    BASE_ACCELERATION_INVALID_READING = 40

    @property
    def maker(self) -> str:
        """The folder of Franka."""
        return "franka"

    @property
    def manual_name(self) -> str:
        """The name as the client library prints it, such as `joint_motion_generator_velocity_discontinuity`."""
        return self.name.lower().replace("tau_j", "tau_J")

    @property
    def cause(self) -> str:
        """What the robot detected, in a few words."""
        return _CAUSES[self]


_CAUSES = {
    FrankaError.JOINT_POSITION_LIMITS_VIOLATION: "a joint angle left its range",
    FrankaError.CARTESIAN_POSITION_LIMITS_VIOLATION: "the tool left its allowed space",
    FrankaError.SELF_COLLISION_AVOIDANCE_VIOLATION: "the arm came close to a self-collision",
    FrankaError.JOINT_VELOCITY_VIOLATION: "a measured joint velocity was too high",
    FrankaError.CARTESIAN_VELOCITY_VIOLATION: "the measured tool velocity was too high",
    FrankaError.FORCE_CONTROL_SAFETY_VIOLATION: "force control left its safe range",
    FrankaError.JOINT_REFLEX: "an estimated external torque exceeded its threshold",
    FrankaError.CARTESIAN_REFLEX: "the estimated external force exceeded its threshold",
    FrankaError.MAX_GOAL_POSE_DEVIATION_VIOLATION: "the arm ended too far from its goal",
    FrankaError.MAX_PATH_POSE_DEVIATION_VIOLATION: "the arm deviated too far from its path",
    FrankaError.CARTESIAN_VELOCITY_PROFILE_SAFETY_VIOLATION: "a Cartesian velocity profile left its safe range",
    FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID: (
        "the first commanded joint angles do not match the arm"
    ),
    FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION: "a commanded joint angle is outside its range",
    FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION: "a commanded joint velocity is too high",
    FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY: (
        "a commanded joint velocity jumps (acceleration too high)"
    ),
    FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY: (
        "a commanded joint acceleration jumps (jerk too high)"
    ),
    FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_START_POSE_INVALID: (
        "the first commanded pose does not match the arm"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION: "the commanded elbow leaves its range or is too fast",
    FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION: "the commanded tool velocity is too high",
    FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_DISCONTINUITY: (
        "the commanded tool velocity jumps (acceleration too high)"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY: (
        "the commanded tool acceleration jumps (jerk too high)"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT: "the commanded elbow is flipped to the other side",
    FrankaError.CARTESIAN_MOTION_GENERATOR_START_ELBOW_INVALID: "the first commanded elbow does not match the arm",
    FrankaError.FORCE_CONTROLLER_DESIRED_FORCE_TOLERANCE_VIOLATION: "the desired force was not held",
    FrankaError.START_ELBOW_SIGN_INCONSISTENT: "the elbow is flipped to the other side at the start",
    FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION: "too many commands in a row were lost",
    FrankaError.POWER_LIMIT_VIOLATION: "the arm reached its maximum power",
    FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_POSITION_LIMITS_VIOLATION: (
        "a commanded pose requires a joint angle outside its range"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_LIMITS_VIOLATION: (
        "commanded poses require a joint velocity that is too high"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_DISCONTINUITY: (
        "commanded poses make a joint velocity jump (acceleration too high)"
    ),
    FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_ACCELERATION_DISCONTINUITY: (
        "commanded poses make a joint acceleration jump (jerk too high)"
    ),
    FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG: "the commanded pose is not a valid transform",
    FrankaError.CONTROLLER_TORQUE_DISCONTINUITY: "a commanded torque jumps (torque rate too high)",
    FrankaError.JOINT_P2P_INSUFFICIENT_TORQUE_FOR_PLANNING: (
        "a planned joint motion needs more torque than is available"
    ),
    FrankaError.TAU_J_RANGE_VIOLATION: "a torque sensor reached the end of its range",
    FrankaError.INSTABILITY_DETECTED: "the control loop is not stable",
    FrankaError.JOINT_MOVE_IN_WRONG_DIRECTION: "a joint outside its range moves farther out",
    FrankaError.CARTESIAN_SPLINE_MOTION_GENERATOR_VIOLATION: "a Cartesian spline exceeded its limits",
    FrankaError.JOINT_VIA_MOTION_GENERATOR_PLANNING_JOINT_LIMIT_VIOLATION: (
        "a motion planned through joint angles leaves their range"
    ),
    FrankaError.BASE_ACCELERATION_INITIALIZATION_TIMEOUT: "the acceleration of the base was not known in time",
    FrankaError.BASE_ACCELERATION_INVALID_READING: "the acceleration of the base could not be read",
}
