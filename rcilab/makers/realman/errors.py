"""The errors of a RealMan controller: those of the system, and the bits of its joints.

The numbers are those of the maker's page "Appendix: error codes". A joint has one error word; its bits are the members
`JOINT_BITS`.
"""

from __future__ import annotations

from collections.abc import Iterable

from rcilab.core.fault import FaultCode


class RealManError(FaultCode):
    """One error; the value is its place among them, for records, which keep faults as bits."""

    code: int
    """Its number, as the maker prints it."""

    def __new__(cls, code: int) -> RealManError:
        """Creates the member of a number."""
        member = int.__new__(cls, len(cls.__members__))
        member._value_ = len(cls.__members__)
        member.code = code
        return member

    JOINT_COMMUNICATION = 0x1001
    TARGET_OVER_LIMIT = 0x1002
    UNREACHABLE = 0x1003
    KERNEL_COMMUNICATION = 0x1004
    JOINT_BUS = 0x1005
    PLANNER_KERNEL = 0x1006
    JOINT_OVERSPEED = 0x1007
    TOOL_BOARD = 0x1008
    OVERSPEED = 0x1009
    OVERACCELERATION = 0x100A
    BRAKE = 0x100B
    DRAG_OVERSPEED = 0x100C
    COLLISION = 0x100D
    NO_WORK_FRAME = 0x100E
    NO_TOOL_FRAME = 0x100F
    JOINT_DISABLED = 0x1010
    CIRCLE = 0x1011
    SELF_COLLISION = 0x1012
    FENCE = 0x1013
    SOFT_LIMIT = 0x1014
    GRIPPER = 0x2001
    HAND = 0x2002
    SIX_AXIS_FORCE = 0x2003
    ONE_AXIS_FORCE = 0x2004
    OUTPUT_CURRENT = 0x2005
    CONTROLLER_TEMPERATURE = 0x5003
    CONTROLLER_OVERCURRENT = 0x5005
    CONTROLLER_UNDERCURRENT = 0x5006
    CONTROLLER_OVERVOLTAGE = 0x5007
    CONTROLLER_UNDERVOLTAGE = 0x5008
    CONTROLLER_KERNEL = 0x5009
    JOINT_FOC = 0x0001
    JOINT_OVERVOLTAGE = 0x0002
    JOINT_UNDERVOLTAGE = 0x0004
    JOINT_TEMPERATURE = 0x0008
    JOINT_START = 0x0010
    JOINT_ENCODER = 0x0020
    JOINT_OVERCURRENT = 0x0040
    JOINT_SOFTWARE = 0x0080
    JOINT_TEMPERATURE_SENSOR = 0x0100
    JOINT_POSITION_LIMIT = 0x0200
    JOINT_ID = 0x0400
    JOINT_TRACKING = 0x0800
    JOINT_CURRENT_SENSOR = 0x1000
    JOINT_BRAKE_RELEASE = 0x2000
    JOINT_POSITION_STEP = 0x4000
    JOINT_TURNS = 0x8000
    JOINT_FRAME_LOSS = 0xF000

    @property
    def maker(self) -> str:
        """The folder of RealMan."""
        return "realman"

    @property
    def manual_name(self) -> str:
        """The number as the maker prints it, and a name, such as `0x1002 target over limit`."""
        return f"0x{self.code:04X} {self.name.lower().replace('_', ' ')}"

    @property
    def cause(self) -> str:
        """What the controller detected, as a short text."""
        return _CAUSES[self]

    @property
    def remedy(self) -> str:
        """How to clear it."""
        return _CLEAR_JOINT if self in JOINT_BITS else _REMEDIES[self]


JOINT_BITS = frozenset(
    {
        RealManError.JOINT_FOC,
        RealManError.JOINT_OVERVOLTAGE,
        RealManError.JOINT_UNDERVOLTAGE,
        RealManError.JOINT_TEMPERATURE,
        RealManError.JOINT_START,
        RealManError.JOINT_ENCODER,
        RealManError.JOINT_OVERCURRENT,
        RealManError.JOINT_SOFTWARE,
        RealManError.JOINT_TEMPERATURE_SENSOR,
        RealManError.JOINT_POSITION_LIMIT,
        RealManError.JOINT_ID,
        RealManError.JOINT_TRACKING,
        RealManError.JOINT_CURRENT_SENSOR,
        RealManError.JOINT_BRAKE_RELEASE,
        RealManError.JOINT_POSITION_STEP,
        RealManError.JOINT_TURNS,
        RealManError.JOINT_FRAME_LOSS,
    }
)
"""The errors of a single joint."""

REFUSED_COMMANDS = frozenset(
    {
        RealManError.TARGET_OVER_LIMIT,
        RealManError.UNREACHABLE,
        RealManError.NO_WORK_FRAME,
        RealManError.NO_TOOL_FRAME,
        RealManError.JOINT_DISABLED,
        RealManError.CIRCLE,
    }
)
"""The errors of refused commands, each reported until the next command that is accepted."""

_CLEAR_JOINT = "clear the error with set_joint_clear_err, then enable the joint"

_CAUSES = {
    RealManError.JOINT_COMMUNICATION: "a joint does not answer",
    RealManError.TARGET_OVER_LIMIT: "a target angle is outside the joint's range",
    RealManError.UNREACHABLE: "a pose is out of reach, or a singularity is in the way",
    RealManError.KERNEL_COMMUNICATION: "the real-time kernel does not answer",
    RealManError.JOINT_BUS: "the bus of the joints does not answer",
    RealManError.PLANNER_KERNEL: "the planner failed",
    RealManError.JOINT_OVERSPEED: "a joint is commanded to move faster than allowed",
    RealManError.TOOL_BOARD: "the board at the end of the arm cannot be reached",
    RealManError.OVERSPEED: "the tool is commanded to move faster than allowed",
    RealManError.OVERACCELERATION: "tool or joints are commanded to accelerate more than allowed",
    RealManError.BRAKE: "the brake of a joint did not open",
    RealManError.DRAG_OVERSPEED: "the arm was guided too fast",
    RealManError.COLLISION: "the arm collided",
    RealManError.NO_WORK_FRAME: "there is no work frame of this name",
    RealManError.NO_TOOL_FRAME: "there is no tool frame of this name",
    RealManError.JOINT_DISABLED: "a joint is disabled",
    RealManError.CIRCLE: "the three poses are no circle",
    RealManError.SELF_COLLISION: "the arm would collide with itself",
    RealManError.FENCE: "the arm would leave its fence",
    RealManError.SOFT_LIMIT: "a joint is outside its soft range",
    RealManError.GRIPPER: "the gripper has an error",
    RealManError.HAND: "the hand has an error",
    RealManError.SIX_AXIS_FORCE: "the six-axis force sensor has an error",
    RealManError.ONE_AXIS_FORCE: "the one-axis force sensor has an error",
    RealManError.OUTPUT_CURRENT: "the current of an output is too high",
    RealManError.CONTROLLER_TEMPERATURE: "the controller is too hot",
    RealManError.CONTROLLER_OVERCURRENT: "the current of the controller is too high",
    RealManError.CONTROLLER_UNDERCURRENT: "the current of the controller is too low",
    RealManError.CONTROLLER_OVERVOLTAGE: "the voltage of the controller is too high",
    RealManError.CONTROLLER_UNDERVOLTAGE: "the voltage of the controller is too low",
    RealManError.CONTROLLER_KERNEL: "the real-time kernel of the controller does not answer",
    RealManError.JOINT_FOC: "the motor control of a joint failed",
    RealManError.JOINT_OVERVOLTAGE: "the voltage of a joint is too high",
    RealManError.JOINT_UNDERVOLTAGE: "the voltage of a joint is too low",
    RealManError.JOINT_TEMPERATURE: "a joint is too hot",
    RealManError.JOINT_START: "a joint did not start",
    RealManError.JOINT_ENCODER: "the encoder of a joint failed",
    RealManError.JOINT_OVERCURRENT: "the current of a joint is too high",
    RealManError.JOINT_SOFTWARE: "the software of a joint failed",
    RealManError.JOINT_TEMPERATURE_SENSOR: "the temperature sensor of a joint failed",
    RealManError.JOINT_POSITION_LIMIT: "a joint is outside its range",
    RealManError.JOINT_ID: "the number of a joint is not valid",
    RealManError.JOINT_TRACKING: "a joint does not follow its commands",
    RealManError.JOINT_CURRENT_SENSOR: "the current sensor of a joint failed",
    RealManError.JOINT_BRAKE_RELEASE: "the brake of a joint could not be opened",
    RealManError.JOINT_POSITION_STEP: "the commands of a joint jump",
    RealManError.JOINT_TURNS: "a joint lost its count of turns",
    RealManError.JOINT_FRAME_LOSS: "a joint did not receive its commands",
}

_REMEDIES = {
    RealManError.JOINT_COMMUNICATION: "check the cable of the arm, switch it off and on",
    RealManError.TARGET_OVER_LIMIT: (
        "choose a target inside the range, or change the range with set_joint_min_pos and set_joint_max_pos"
    ),
    RealManError.UNREACHABLE: "choose another pose, or go there with a joint motion",
    RealManError.KERNEL_COMMUNICATION: "restart the controller",
    RealManError.JOINT_BUS: "check the cable of the arm, switch it off and on",
    RealManError.PLANNER_KERNEL: "restart the controller",
    RealManError.JOINT_OVERSPEED: "stream smaller steps, or move more slowly",
    RealManError.TOOL_BOARD: "check the cable at the end of the arm",
    RealManError.OVERSPEED: "move more slowly",
    RealManError.OVERACCELERATION: "stream a smoother motion, or move more slowly",
    RealManError.BRAKE: "clear the error of the joint, disable it and enable it again",
    RealManError.DRAG_OVERSPEED: "guide it more slowly",
    RealManError.COLLISION: "clear the way, then clear the error; a lower collision stage is less sensitive",
    RealManError.NO_WORK_FRAME: "create it first, or choose one of get_total_work_frame",
    RealManError.NO_TOOL_FRAME: "create it first, or choose one of get_total_tool_frame",
    RealManError.JOINT_DISABLED: "enable the joint with set_joint_en_state",
    RealManError.CIRCLE: "choose three different points that are not on a line",
    RealManError.SELF_COLLISION: "choose another pose or another way",
    RealManError.FENCE: "choose a pose inside the fence",
    RealManError.SOFT_LIMIT: "move it back with set_joint_step",
    RealManError.GRIPPER: "check the gripper and its cable",
    RealManError.HAND: "check the hand and its cable",
    RealManError.SIX_AXIS_FORCE: "check the sensor",
    RealManError.ONE_AXIS_FORCE: "check the sensor",
    RealManError.OUTPUT_CURRENT: "check what is connected to the output",
    RealManError.CONTROLLER_TEMPERATURE: "let it cool down",
    RealManError.CONTROLLER_OVERCURRENT: "check the power supply",
    RealManError.CONTROLLER_UNDERCURRENT: "check the power supply",
    RealManError.CONTROLLER_OVERVOLTAGE: "check the power supply",
    RealManError.CONTROLLER_UNDERVOLTAGE: "check the power supply",
    RealManError.CONTROLLER_KERNEL: "restart the controller",
}

_SYSTEM = {error.code: error for error in RealManError if error not in JOINT_BITS}


def errors_of_codes(system: Iterable[int], joints: Iterable[int]) -> tuple[RealManError, ...]:
    """Returns the errors that a controller reports, in the order of their members; unknown numbers are left out.

    Args:
        system: The numbers of the system's errors; 0: no error.
        joints: The error word of each joint.
    """
    found = {_SYSTEM[code] for code in system if code in _SYSTEM}
    words = tuple(joints)
    found |= {error for error in JOINT_BITS if any(word & error.code == error.code for word in words)}
    return tuple(sorted(found))
