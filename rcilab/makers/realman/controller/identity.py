"""What a controller reports about itself when a client connects: versions, model, geometry."""

from __future__ import annotations

from itertools import pairwise
from math import degrees
from typing import Any, Final, Literal, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.makers.realman.wire.identity import product_version
from rcilab.robots.description import DhRow, RobotDescription

Generation: TypeAlias = Literal[3, 4]
_VERSION: Final = {"build_time": "2024/08/28 18:36:18", "version": "V1.7.0"}
_STANDARD = ("RM75",)
"""Arms whose table the maker has in the standard convention; the others are in Craig's."""


def require_generation(number: int | None) -> Generation:
    """Returns a generation of controllers; 3 for None.

    Raises:
        InvalidValueError: There is no such generation.
    """
    match number:
        case None | 3:
            return 3
        case 4:
            return 4
        case _:
            raise InvalidValueError("generation", number, "must be 3 or 4 for this arm")


def software_info(name: str, generation: Generation) -> dict[str, object]:
    """Returns the answer to get_arm_software_info."""
    info: dict[str, object] = {
        "state": "arm_software_info",
        "Product_version": product_version(name),
        "algorithm_info": {"version": "1.4.4"},
        "ctrl_info": _VERSION,
    }
    if generation == 4:
        info |= {"robot_controller_version": "4.0", "communication_info": _VERSION, "program_info": _VERSION}
    else:
        info |= {"dynamic_info": {"model_version": "2"}, "plan_info": _VERSION}
    return info


def dh_data(description: RobotDescription) -> dict[str, Any]:
    """Returns the answer to get_DH_data: alpha, a, d and offset a joint, in 0.001 deg and 0.000001 m."""
    rows = list(description.dh)
    if description.name not in _STANDARD:  # In Craig's convention alpha and a belong to the row after.
        before = [DhRow(a=0.0, alpha=0.0, d=0.0), *rows]
        rows = [
            DhRow(a=first.a, alpha=first.alpha, d=row.d, theta_offset=row.theta_offset)
            for first, row in pairwise(before)
        ]
    numbers = [
        [
            round(1e3 * degrees(row.alpha)),
            round(1e6 * row.a),
            round(1e6 * row.d),
            round(1e3 * degrees(row.theta_offset)),
        ]
        for row in rows
    ]
    return {"command": "get_DH_data", **{f"joint_{joint}": row for joint, row in enumerate(numbers, 1)}}
