"""Whose conditions count for an arm: one table an interface, so that a lesson can put two makers side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from rcilab.conformance.condition import AnyFault, Condition
from rcilab.conformance.conditions import CONDITIONS, MOTION_CONDITIONS
from rcilab.conformance.franka_conditions import FRANKA_BOX, FRANKA_CONDITIONS, FRANKA_MOTION_CONDITIONS
from rcilab.conformance.tool_conditions import CARTESIAN_POSITION
from rcilab.errors import InvalidValueError
from rcilab.robots.description import Interface, RobotDescription


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionTable:
    """The conditions of one interface."""

    interface: Interface
    """RCI: the xMates; FCI: the Panda."""
    motion: tuple[Condition, ...]
    """What `check` judges of every joint motion."""
    box: Condition
    """What it judges on top where there is a safety box."""
    conditions: tuple[Condition, ...]
    """Every condition there is; those that judge the same thing have the same id in every table."""

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
        "RCI": ConditionTable(interface="RCI", motion=MOTION_CONDITIONS, box=CARTESIAN_POSITION, conditions=CONDITIONS),
        "FCI": ConditionTable(
            interface="FCI", motion=FRANKA_MOTION_CONDITIONS, box=FRANKA_BOX, conditions=FRANKA_CONDITIONS
        ),
    }
)


def condition_table(description: RobotDescription) -> ConditionTable:
    """Returns the conditions that the motions of an arm are judged by."""
    return CONDITION_TABLES[description.interface]
