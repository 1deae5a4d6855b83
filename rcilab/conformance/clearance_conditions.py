"""The conditions on distances between links and from the floor: rcilab's own, no controller checks them.

An arm that is commanded into its own base, or into the table, moves there and raises a fault at the contact. So these
rows are necessary and raise no fault, and the virtual controller does not check them, as the real one does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np

from rcilab.core.clearance import STANDARD_DISTANCE, ClearanceLimit
from rcilab.core.condition import AnyLimits, Bounds, Condition, Necessity

OWN = "rcilab's own, not the controller's; capsules of the URDF"
FAR = 0.1  # [m]
"""How far beyond its bound a distance uses nothing of it: a hand's width."""

Distance: TypeAlias = Literal["link_distance", "floor_distance"]
"""The signals that are distances."""

_QUANTITIES: dict[Distance, str] = {
    "link_distance": "distance between links",
    "floor_distance": "distance from the floor",
}


def clearance_conditions(distance: ClearanceLimit) -> tuple[Condition, ...]:
    """Returns the rows for a safety distance: what is necessary first, then what is recommended beyond it."""
    necessary: dict[Distance, float] = {"link_distance": distance.links, "floor_distance": distance.floor}
    if distance.floor_height is None:
        del necessary["floor_distance"]
    return (
        *(_row(signal, "necessary", least) for signal, least in necessary.items()),
        *(
            _row(signal, "recommended", distance.advised)
            for signal, least in necessary.items()
            if distance.advised > least
        ),
    )


def _row(signal: Distance, necessity: Necessity, least: float) -> Condition:
    name = {"link_distance": "links", "floor_distance": "floor"}[signal]
    return Condition(
        id=f"clearance.{name}" + ("" if necessity == "necessary" else ".advised"),
        quantity=_QUANTITIES[signal],
        formula=f"d_{name} > d_{'min' if necessity == 'necessary' else 'advised'}",
        necessity=necessity,
        unit="m",
        source=OWN,
        fault=None,
        stage="throughout",
        signal=signal,
        order=0,
        bounds=_above(least),
    )


def _above(least: float) -> Callable[[AnyLimits], Bounds]:
    def bounds(limits: AnyLimits) -> Bounds:
        del limits  # What is asked for is no limit of the arm.
        return np.array([least]), np.array([math.inf])

    return bounds


CLEARANCE_CONDITIONS = clearance_conditions(STANDARD_DISTANCE)
"""What a motion has to keep, and should keep, when nothing else is asked for."""
