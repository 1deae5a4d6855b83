"""Conditions on distances between links, from floor and obstacles: rcilab's own, because no controller checks them.

An arm that is commanded into its own base, or into the table, moves until the contact raises a fault. These rows are
therefore necessary, but raise no fault, and the virtual controller does not check them either.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.condition import AnyLimits, Bounds, Condition, Necessity

OWN = "rcilab's own, not the controller's; capsules of the URDF"
OWN_CELL = "rcilab's own, not the controller's; solids of the cell"
FAR = 0.1  # [m]
"""Distance beyond its bound from which a clearance counts as unused. Reason: about the width of a hand."""

Distance: TypeAlias = Literal["link_distance", "floor_distance", "cell_distance"]
"""The signals that are distances."""

_QUANTITIES: dict[Distance, str] = {
    "link_distance": "distance between links",
    "floor_distance": "distance from the floor",
    "cell_distance": "distance from an obstacle",
}


def clearance_conditions(distance: ClearanceLimit, *, has_obstacles: bool = False) -> tuple[Condition, ...]:
    """Returns the rows for a safety distance: the necessary ones, then the recommended ones.

    Args:
        distance: Required distances.
        has_obstacles: Whether the arm is in a cell with obstacles.
    """
    necessary: dict[Distance, float] = {"link_distance": distance.links, "floor_distance": distance.floor}
    if has_obstacles:
        necessary["cell_distance"] = distance.cell
    if distance.floor_height is None:
        del necessary["floor_distance"]
    return (
        *(_row(signal, "necessary", minimum) for signal, minimum in necessary.items()),
        *(
            _row(signal, "recommended", distance.advised)
            for signal, minimum in necessary.items()
            if distance.advised > minimum
        ),
    )


def _row(signal: Distance, necessity: Necessity, minimum: float) -> Condition:
    name = signal.removesuffix("_distance").replace("link", "links")
    return Condition(
        id=f"clearance.{name}" + ("" if necessity == "necessary" else ".advised"),
        quantity=_QUANTITIES[signal],
        formula=f"d_{name} > d_{'min' if necessity == 'necessary' else 'advised'}",
        necessity=necessity,
        unit="m",
        source=OWN_CELL if signal == "cell_distance" else OWN,
        fault=None,
        stage="throughout",
        signal=signal,
        order=0,
        bounds=_above(minimum),
    )


def _above(minimum: float) -> Callable[[AnyLimits], Bounds]:
    def bounds(limits: AnyLimits) -> Bounds:
        del limits  # The bound is a requirement, not a limit of the arm.
        return np.array([minimum]), np.array([math.inf])

    return bounds


CLEARANCE_CONDITIONS = clearance_conditions(STANDARD_DISTANCE)
"""Rows for the default distances."""
