"""The errors and warnings of UFACTORY controllers, each with the number that the maker's client library reports.

Names, causes and remedies: chapter 12 of the user manual, and the table of codes of the client library. An error stops
the arm and empties the queue; it is cleared by `clean_error`, after which the motors are enabled again. A warning
only reports that a request was not executed. Numbers that the virtual controller cannot raise, such as those of its
boards, are left out.
"""

from __future__ import annotations

from rcilab.core.fault import FaultCode


class UfactoryError(FaultCode):
    """An error of the controller; the value is its number."""

    EMERGENCY_STOP_BUTTON = 1
    EMERGENCY_STOP_INPUT = 2
    EMERGENCY_STOP_SWITCH = 3
    JOINT_1 = 11
    JOINT_2 = 12
    JOINT_3 = 13
    JOINT_4 = 14
    JOINT_5 = 15
    JOINT_6 = 16
    JOINT_7 = 17
    KINEMATICS = 21
    SELF_COLLISION = 22
    JOINT_RANGE = 23
    SPEED = 24
    PLANNING = 25
    MEASURED_SPEED = 30
    COLLISION = 31
    SAFETY_BOUNDARY = 35
    MANUAL_MODE = 37
    NO_SOLUTION = 40
    SERVO_LINEAR_SPEED = 60

    @property
    def maker(self) -> str:
        """The folder of UFACTORY."""
        return "ufactory"

    @property
    def manual_name(self) -> str:
        """The number as the manual prints it, such as `C31`."""
        return f"C{self.value}"

    @property
    def cause(self) -> str:
        """What the controller detected, as a short text."""
        return _CAUSES[self]

    @property
    def remedy(self) -> str:
        """The remedy, in one sentence."""
        return _REMEDIES[self]


class UfactoryWarning(FaultCode):
    """A warning of the controller; the value is its number."""

    QUEUE_FULL = 11
    PARAMETER = 12
    UNKNOWN_COMMAND = 13
    NO_SOLUTION = 14

    @property
    def maker(self) -> str:
        """The folder of UFACTORY."""
        return "ufactory"

    @property
    def key(self) -> str:
        """Key in the catalogues; two of the numbers and a name are also those of errors."""
        return f"{self.maker}.WARNING_{self.name}"

    @property
    def manual_name(self) -> str:
        """The number as the manual prints it, such as `W11`."""
        return f"W{self.value}"

    @property
    def cause(self) -> str:
        """Why a request was not executed, as a short text."""
        return _WARNINGS[self][0]

    @property
    def remedy(self) -> str:
        """The remedy, in one sentence."""
        return _WARNINGS[self][1]


_JOINTS = tuple(UfactoryError(number) for number in range(11, 18))
_CAUSES = {
    UfactoryError.EMERGENCY_STOP_BUTTON: "the emergency stop button of the control box is pressed",
    UfactoryError.EMERGENCY_STOP_INPUT: "the emergency stop input of the control box is open",
    UfactoryError.EMERGENCY_STOP_SWITCH: "the emergency stop of the three-position switch is pressed",
    **{joint: f"the drive of joint {joint - 10} reports an error" for joint in _JOINTS},
    UfactoryError.KINEMATICS: "a commanded pose has no joint angles",
    UfactoryError.SELF_COLLISION: "the arm is about to collide with itself",
    UfactoryError.JOINT_RANGE: "a joint angle is outside its range",
    UfactoryError.SPEED: "a commanded speed or acceleration is too high",
    UfactoryError.PLANNING: "the controller could not plan the motion",
    UfactoryError.MEASURED_SPEED: "a measured speed is too high",
    UfactoryError.COLLISION: "the current of a motor differs from the expected one, as in a collision",
    UfactoryError.SAFETY_BOUNDARY: "the tool reached the safety boundary",
    UfactoryError.MANUAL_MODE: "the arm moves in manual mode without being guided",
    UfactoryError.NO_SOLUTION: "the target has joint angles, but the path to it cannot be followed",
    UfactoryError.SERVO_LINEAR_SPEED: "joint targets of servo mode move the tool too fast",
}
_REMEDIES = {
    UfactoryError.EMERGENCY_STOP_BUTTON: "Release the button, then clear the error and enable the motors.",
    UfactoryError.EMERGENCY_STOP_INPUT: "Close both inputs, then clear the error and enable the motors.",
    UfactoryError.EMERGENCY_STOP_SWITCH: "Release the switch, then clear the error and enable the motors.",
    **{
        joint: "Clear the error and enable the motors; switch the control box off and on if it comes again."
        for joint in _JOINTS
    },
    UfactoryError.KINEMATICS: "Move the target closer, or away from a singular pose, and plan the path again.",
    UfactoryError.SELF_COLLISION: "Clear the error, guide the arm back by hand in mode 2, and plan another path.",
    UfactoryError.JOINT_RANGE: "Clear the error and move the joint back into its range.",
    UfactoryError.SPEED: "Lower speed and acceleration; near a singular pose joints are much faster than the tool.",
    UfactoryError.PLANNING: "Plan the path again, or lower its speed.",
    UfactoryError.MEASURED_SPEED: "Clear the error; check that nothing pushes the arm.",
    UfactoryError.COLLISION: "Remove the obstacle, clear the error; check load and collision sensitivity.",
    UfactoryError.SAFETY_BOUNDARY: "Clear the error and guide the arm back by hand in mode 2, or set a wider boundary.",
    UfactoryError.MANUAL_MODE: "Check that load and mounting direction are those of the arm, then clear the error.",
    UfactoryError.NO_SOLUTION: "Move there by joint angles, or by way of other poses.",
    UfactoryError.SERVO_LINEAR_SPEED: "Send targets that are closer together, so that the tool stays below its limit.",
}
_WARNINGS = {
    UfactoryWarning.QUEUE_FULL: (
        "the queue of motions is full",
        "Wait until some have been executed, then send it again.",
    ),
    UfactoryWarning.PARAMETER: ("a parameter of a request is outside its range", "Correct it and send it again."),
    UfactoryWarning.UNKNOWN_COMMAND: (
        "a request has a function code that does not exist",
        "Use a client library that fits the firmware.",
    ),
    UfactoryWarning.NO_SOLUTION: ("a pose has no joint angles", "Choose another pose."),
}
