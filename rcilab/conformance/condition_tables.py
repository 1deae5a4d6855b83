"""Whose conditions count for an arm: one table an interface, so that a lesson can put two makers side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rcilab.conformance.condition import AnyFault, Condition
from rcilab.conformance.conditions import (
    CARTESIAN_MOTION_CONDITIONS,
    CONDITIONS,
    MOTION_CONDITIONS,
    TORQUE_MOTION_CONDITIONS,
)
from rcilab.conformance.franka_conditions import (
    FRANKA_BOX,
    FRANKA_CARTESIAN_MOTION_CONDITIONS,
    FRANKA_CONDITIONS,
    FRANKA_MOTION_CONDITIONS,
    FRANKA_TORQUE_MOTION_CONDITIONS,
)
from rcilab.conformance.tool_conditions import CARTESIAN_POSITION
from rcilab.core.errors import InvalidValueError
from rcilab.core.state import Mode
from rcilab.robots.description import Interface, RobotDescription


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionTable:
    """The conditions of one interface."""

    interface: Interface
    """RCI: the xMates; FCI: the Panda."""
    motion: tuple[Condition, ...]
    """What `check` judges of every joint motion."""
    cartesian: tuple[Condition, ...]
    """What it judges of a motion that is sent as poses of the tool."""
    torque: tuple[Condition, ...]
    """What it judges of a motion that is sent as torques."""
    box: Condition
    """What it judges on top where there is a safety box."""
    conditions: tuple[Condition, ...]
    """Every condition there is; those that judge the same thing have the same id in every table."""

    def rows(self, mode: Mode, *, has_elbow: bool = True, has_box: bool = False) -> tuple[Condition, ...]:
        """Returns what is judged of a motion in a mode, distances apart.

        Args:
            mode: How it is commanded.
            has_elbow: Whether the arm has 7 axes, so that there is an arm angle to judge.
            has_box: Whether there is a safety box. Told in torques, an arm has no commanded place: the measured counts.
        """
        if mode == "torque":
            return self.torque + ((self.find("measured.cartesian.position"),) if has_box else ())
        box = (self.box,) if has_box else ()
        if not mode.startswith("cartesian"):
            return self.motion + box
        return tuple(row for row in self.cartesian if has_elbow or row.signal != "arm_angle") + box

    def find(self, name: str) -> Condition:
        """Returns a condition by id.

        Raises:
            InvalidValueError: There is no such condition; the message lists those that exist.
        """
        for row in self.conditions:
            if row.id == name:
                return row
        known = ", ".join(row.id for row in self.conditions)
        raise InvalidValueError("condition", name, f"is unknown to the {self.interface}; known: {known}")

    def raising(self, fault: AnyFault) -> tuple[Condition, ...]:
        """Returns the conditions that raise a fault."""
        return tuple(row for row in self.conditions if row.fault is fault)

    def __repr__(self) -> str:
        return f"<ConditionTable of the {self.interface}: {len(self.conditions)} conditions, .motion, .find(id)>"


CONDITION_TABLES: Mapping[Interface, ConditionTable] = MappingProxyType(
    {
        "RCI": ConditionTable(
            interface="RCI",
            motion=MOTION_CONDITIONS,
            cartesian=CARTESIAN_MOTION_CONDITIONS,
            torque=TORQUE_MOTION_CONDITIONS,
            box=CARTESIAN_POSITION,
            conditions=CONDITIONS,
        ),
        "FCI": ConditionTable(
            interface="FCI",
            motion=FRANKA_MOTION_CONDITIONS,
            cartesian=FRANKA_CARTESIAN_MOTION_CONDITIONS,
            torque=FRANKA_TORQUE_MOTION_CONDITIONS,
            box=FRANKA_BOX,
            conditions=FRANKA_CONDITIONS,
        ),
    }
)


def condition_table(description: RobotDescription) -> ConditionTable:
    """Returns the conditions that the motions of an arm are judged by."""
    return CONDITION_TABLES[description.interface]
