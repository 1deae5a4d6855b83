"""The conditions on where and how a motion of the tool starts and ends: rows that both makers' tables share."""

from __future__ import annotations

from typing import Literal

from rcilab.conformance.condition import Condition, same

REST_VELOCITY_TOLERANCE = 1e-4  # [rad/s] or [m/s]
"""What counts as zero velocity. A choice: it changes nothing that a joint can feel, and covers rounding."""
REST_ACCELERATION_TOLERANCE = 1e-2  # [rad/s^2] or [m/s^2]
"""What counts as zero acceleration. A choice, as above: a thousandth of the smallest acceleration limit."""


def start_pose(tolerance: float, source: str) -> Condition:
    """Returns the recommended row on how far the first commanded pose is from the arm's, [m]."""
    return Condition(
        id="start.cartesian.position",
        quantity="distance of the first pose from the arm's",
        formula="T_c = T",
        necessity="recommended",
        unit="m",
        source=source,
        fault=None,
        stage="start",
        signal="translation",
        order=0,
        bounds=lambda limits: same(tolerance),
    )


def tool_rest(source: str) -> tuple[Condition, ...]:
    """Returns the recommended rows that the tool shall start and end at rest."""
    return tuple(
        _rest(stage, signal, order, source)
        for stage in ("start", "end")
        for order in (1, 2)
        for signal in ("translation", "rotation")
    )


def _rest(
    stage: Literal["start", "end"], signal: Literal["translation", "rotation"], order: int, source: str
) -> Condition:
    kind = {"translation": "translational", "rotation": "rotational"}[signal]
    name = ("", "velocity", "acceleration")[order]
    unit = {"translation": "m", "rotation": "rad"}[signal] + ("/s" if order == 1 else "/s^2")
    tolerance = REST_VELOCITY_TOLERANCE if order == 1 else REST_ACCELERATION_TOLERANCE
    return Condition(
        id=f"{stage}.cartesian.{name}.{signal}",
        quantity=f"{kind} {name} at the {stage}",
        formula="dp_c = 0" if order == 1 else "ddp_c = 0",
        necessity="recommended",
        unit=unit,
        source=source,
        fault=None,
        stage=stage,
        signal=signal,
        order=order,
        bounds=lambda limits: same(tolerance),
    )
