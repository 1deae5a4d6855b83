"""The reaction of the controller to each fault, as a table that can be printed.

    print(fault_stop.as_text())

If one command or one measurement violates several conditions, all their bits are set in that cycle. States, reports
and errors list them in the order of the error bytes on the wire, which is that of this table and not that of their
occurrence. Commands are checked before the measurement: after a rejected command no measurement is checked.

Common to all: the bit is set in the state of the cycle in which the condition is violated and stays set until the
error recovery; queued commands are dropped; the arm stops inside its acceleration and jerk limits under the position
servo, then the brakes engage; StopMove is answered with success. The faults differ in the value that violates the
condition, and in where the stop begins. A joint limit without auto_limit also switches the motors off (manual 3.1.15).
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import Final, NamedTuple

from rcilab.conformance.common_conditions import COMPLIANT_ALLOWANCE
from rcilab.makers.rokae.conditions import rci_faults
from rcilab.makers.rokae.faults import RANGE_FAULTS, Fault
from rcilab.sim.violations import ArmCondition, ArmViolation, CycleViolation


class FaultSource(Enum):
    """The violating value, and its effect."""

    COMMAND = "the command of this cycle is not followed"
    MEASUREMENT = "the command of this cycle has been followed; the measurement violates the condition"
    ABSENCE = "there was no command, and missing ones are no longer held or bridged"


class FaultStop(NamedTuple):
    """One row of the table."""

    offender: FaultSource
    modes: str
    """Controller modes in which it is checked."""
    recovery: str
    """Conditions of the error recovery."""


_ANYTIME = "none: recover, then start the next motion"
_BACK = (
    "up to 1 deg outside: recover, then power on (the limit has switched the motors off unless auto_limit is on). "
    "Farther: refused (manual recovery needed), power off and on, then move back"
)
_BACK_BOX = "up to 1 cm outside: as below. Farther: refused (manual recovery needed), power off and on, then move back"
_CLEAR = "refused (reflex) while an external torque is above its threshold"

_ALL, _JOINTS, _TOOL, _TORQUES = "all", "all but torque", "both Cartesian modes", "torque"
_COMMAND, _MEASUREMENT = FaultSource.COMMAND, FaultSource.MEASUREMENT

FAULT_STOP: Final = {
    Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION: FaultStop(_MEASUREMENT, _ALL, _BACK),
    Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION: FaultStop(
        _MEASUREMENT,
        "all but hand guiding, which moves it back; not with the virtual guide in an impedance mode",
        _BACK_BOX,
    ),
    Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION: FaultStop(_MEASUREMENT, _TOOL, _ANYTIME),
    Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION: FaultStop(_MEASUREMENT, _ALL, _ANYTIME),
    Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION: FaultStop(_MEASUREMENT, _TOOL, _ANYTIME),
    Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION: FaultStop(
        _MEASUREMENT, f"all; {COMPLIANT_ALLOWANCE:g} times the bound in impedance and torque modes", _ANYTIME
    ),
    Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION: FaultStop(
        _MEASUREMENT, f"both Cartesian modes; {COMPLIANT_ALLOWANCE:g} times the bound in Cartesian impedance", _ANYTIME
    ),
    Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION: FaultStop(
        _COMMAND, "all but torque; with auto_limit joints stop inside instead", _BACK
    ),
    Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION: FaultStop(
        _COMMAND, "all but torque; not with the virtual guide in an impedance mode", _BACK_BOX
    ),
    Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION: FaultStop(_COMMAND, _TOOL, _ANYTIME),
    Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION: FaultStop(_COMMAND, _JOINTS, _ANYTIME),
    Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION: FaultStop(_COMMAND, _TOOL, _ANYTIME),
    Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION: FaultStop(_COMMAND, _JOINTS, _ANYTIME),
    Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION: FaultStop(_COMMAND, _TOOL, _ANYTIME),
    Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY: FaultStop(_COMMAND, _JOINTS, _ANYTIME),
    Fault.COLLISION: FaultStop(_MEASUREMENT, _ALL, _CLEAR),
    Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME: FaultStop(_COMMAND, _TOOL, _ANYTIME),
    Fault.COMMAND_TORQUE_DISCONTINUITY: FaultStop(_COMMAND, _TORQUES, _ANYTIME),
    Fault.COMMAND_TORQUE_RANGE_VIOLATION: FaultStop(_COMMAND, _TORQUES, _ANYTIME),
    Fault.INSTABILITY_DETECTION: FaultStop(FaultSource.ABSENCE, _ALL, "none; after an emergency stop, its release"),
}
"""Every fault. Nothing is checked during hand guiding."""

ARM_FAULTS: Final = {
    ArmCondition.FINITE_ANGLES: Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,
    ArmCondition.FINITE_VELOCITIES: Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
    ArmCondition.FINITE_TWIST: Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
    ArmCondition.FINITE_TORQUES: Fault.COMMAND_TORQUE_RANGE_VIOLATION,
    ArmCondition.VALID_POSE: Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME,
    ArmCondition.ARM_ANGLE_RANGE: Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
    ArmCondition.START_TOLERANCE: None,
    ArmCondition.START_ARM_ANGLE: None,
    ArmCondition.ELBOW_SIDE: None,
    ArmCondition.COMMANDS_ARRIVE: Fault.INSTABILITY_DETECTION,
    ArmCondition.NO_COLLISION: Fault.COLLISION,
}
"""The fault of every condition outside of the condition table."""


def faults_of(violations: Iterable[CycleViolation]) -> tuple[Fault, ...]:
    """Returns the faults of violations, in wire order without duplicates."""
    faults: set[Fault | None] = set()
    for violation in violations:
        if isinstance(violation, ArmViolation):
            faults.add(ARM_FAULTS[violation.condition])
        else:
            faults.update(rci_faults((violation,)))
    return tuple(sorted(fault for fault in faults if fault is not None))


def is_beyond_range(violation: CycleViolation) -> bool:
    """Returns whether a joint is beyond its range, which switches the motors off; an infinite or NaN angle is not."""
    return violation.condition is not ArmCondition.FINITE_ANGLES and not RANGE_FAULTS.isdisjoint(
        faults_of((violation,))
    )


def as_text() -> str:
    """Returns the table as text, three lines per fault."""
    return "\n".join(
        f"{fault.value:2} {fault.manual_name}: {fault.cause}; checked in: {row.modes}\n"
        f"   {row.offender.value}\n   recovery: {row.recovery}"
        for fault, row in FAULT_STOP.items()
    )
