"""The manual's conditions on joint motion as one table: check, monitor, report, plots and lessons read these rows.

A condition is a quantity between two bounds, strictly, as the manual prints it (4.1): `lower < value < upper`. The
necessary ones are judged on backward differences of the commanded angles at 1 ms, as the controller does it, and
breaking one stops the robot; the recommended ones ask for a motion that starts and ends at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rcilab.arrays import JointVector
from rcilab.errors import InvalidValueError
from rcilab.faults import Fault
from rcilab.limits import JointLimits

Necessity: TypeAlias = Literal["necessary", "recommended"]
Stage: TypeAlias = Literal["throughout", "start", "end"]

Bounds: TypeAlias = tuple[JointVector, JointVector]
"""Lower and upper bound, each of shape (n,)."""

MANUAL = "RCI manual V1.3.1"

START_POSITION_TOLERANCE = 1e-9  # [rad]
"""How far from the arm a motion may start. A step of 1 nrad is a jerk of 2 rad/s^3: inside the planner's margin."""
REST_VELOCITY_TOLERANCE = 1e-4  # [rad/s]
"""What counts as zero velocity. A choice: it changes nothing that a joint can feel, and covers rounding."""
REST_ACCELERATION_TOLERANCE = 1e-2  # [rad/s^2]
"""What counts as zero acceleration. A choice, as above: a thousandth of the smallest acceleration limit."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Condition:
    """One row of the table."""

    id: str
    """Short stable name, such as "joint.velocity"."""
    quantity: str
    """What is judged, in words, such as "commanded velocity"."""
    formula: str
    """As the manual prints it."""
    necessity: Necessity
    """The robot stops when a necessary condition is broken."""
    unit: str
    source: str
    """Where condition and bound come from."""
    fault: Fault | None
    """What the controller raises; None for a recommended condition."""
    stage: Stage
    """When it is judged."""
    order: int
    """Which derivative of the angles it judges: 0 the angles themselves, 3 the jerk."""
    bounds: Callable[[JointLimits], Bounds]
    """Returns its bounds from the limits of an arm."""

    def __repr__(self) -> str:
        return f"<Condition {self.id}: {self.formula} ({self.necessity})>"


def _symmetric(name: str) -> Callable[[JointLimits], Bounds]:
    def bounds(limits: JointLimits) -> Bounds:
        bound: JointVector = getattr(limits, name)
        return -bound, bound

    return bounds


def _tolerance(value: float) -> Callable[[JointLimits], Bounds]:
    def bounds(limits: JointLimits) -> Bounds:
        bound = np.full(len(limits.velocity), value)
        return -bound, bound

    return bounds


def _range(limits: JointLimits) -> Bounds:
    return limits.lower, limits.upper


JOINT_POSITION = Condition(
    id="joint.position",
    quantity="commanded position",
    formula="q_min < q_c < q_max",
    necessity="necessary",
    unit="rad",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,
    stage="throughout",
    order=0,
    bounds=_range,
)
JOINT_VELOCITY = Condition(
    id="joint.velocity",
    quantity="commanded velocity",
    formula="-dq_max < dq_c < dq_max",
    necessity="necessary",
    unit="rad/s",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
    stage="throughout",
    order=1,
    bounds=_symmetric("velocity"),
)
JOINT_ACCELERATION = Condition(
    id="joint.acceleration",
    quantity="commanded acceleration",
    formula="-ddq_max < ddq_c < ddq_max",
    necessity="necessary",
    unit="rad/s^2",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
    stage="throughout",
    order=2,
    bounds=_symmetric("acceleration"),
)
JOINT_JERK = Condition(
    id="joint.jerk",
    quantity="commanded jerk",
    formula="-dddq_max < dddq_c < dddq_max",
    necessity="necessary",
    unit="rad/s^3",
    source=f"{MANUAL}, 4.1 and 4.4",
    fault=Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,
    stage="throughout",
    order=3,
    bounds=_symmetric("jerk"),
)


def _recommended(
    stage: Literal["start", "end"], quantity: str, formula: str, order: int, tolerance: float
) -> Condition:
    kind = ("position", "velocity", "acceleration")[order]
    return Condition(
        id=f"{stage}.{kind}",
        quantity=quantity,
        formula=formula,
        necessity="recommended",
        unit=("rad", "rad/s", "rad/s^2")[order],
        source=f"{MANUAL}, 4.1 (tolerance: ours)",
        fault=None,
        stage=stage,
        order=order,
        bounds=_tolerance(tolerance),
    )


CONDITIONS: tuple[Condition, ...] = (
    JOINT_POSITION,
    JOINT_VELOCITY,
    JOINT_ACCELERATION,
    JOINT_JERK,
    _recommended("start", "distance of the start from the arm", "q_c = q", 0, START_POSITION_TOLERANCE),
    _recommended("start", "velocity at the start", "dq_c = 0", 1, REST_VELOCITY_TOLERANCE),
    _recommended("start", "acceleration at the start", "ddq_c = 0", 2, REST_ACCELERATION_TOLERANCE),
    _recommended("end", "velocity at the end", "dq_c = 0", 1, REST_VELOCITY_TOLERANCE),
    _recommended("end", "acceleration at the end", "ddq_c = 0", 2, REST_ACCELERATION_TOLERANCE),
)
"""Every condition on joint motion, in the manual's order."""

CYCLE_CONDITIONS: tuple[Condition, ...] = tuple(row for row in CONDITIONS if row.stage == "throughout")
"""Those that hold in every cycle: what the controller's monitor evaluates, in wire order of their faults."""


def find_condition(name: str) -> Condition:
    """Returns a condition by id.

    Raises:
        InvalidValueError: There is no such condition; the message lists those that exist.
    """
    for row in CONDITIONS:
        if row.id == name:
            return row
    raise InvalidValueError("condition", name, f"is unknown; known: {', '.join(row.id for row in CONDITIONS)}")
