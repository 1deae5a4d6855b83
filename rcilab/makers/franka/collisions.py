"""The external torques and forces that stop an arm, each with its threshold, as controller and driver describe them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from rcilab.i18n.rounding import format_pair
from rcilab.i18n.translator import Remark
from rcilab.makers.franka.bounds import DEFAULT_THRESHOLD

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")


class CollisionThresholds(NamedTuple):
    """Upper thresholds of setCollisionBehavior, without a sign."""

    torques: Sequence[float]
    """Of the joints, 7 numbers, [N m]."""
    forces: Sequence[float]
    """Along and about the axes of the stiffness frame K, 6 numbers, [N, N m]."""


def describe_collisions(
    flags: tuple[Sequence[object], Sequence[object]],
    torques: Sequence[float],
    wrench: Sequence[float],
    thresholds: CollisionThresholds | None,
) -> Iterator[Remark]:
    """Yields each external torque and force of a state that is above its upper threshold.

    Args:
        flags: `joint_collision` and `cartesian_collision`, 7 and 6 values.
        torques: `tau_ext_hat_filtered`, with its sign, 7 numbers, [N m].
        wrench: `K_F_ext_hat_K`, 6 numbers, [N, N m].
        thresholds: Those in force; None: unknown.
    """
    joints = range(len(torques)), flags[0], torques, None if thresholds is None else thresholds.torques
    for joint, value, bound in _exceeding(*joints):
        text, unit, what = f"joint {joint + 1}: external torque", "N m", {"joint": joint + 1}
        yield _describe(text, "collision", f"tau_ext_hat_filtered[{joint}]", value, bound, unit, what)
    axes = range(len(wrench)), flags[1], wrench, None if thresholds is None else thresholds.forces
    for axis, value, bound in _exceeding(*axes):
        kind, unit = ("force", "N") if axis < 3 else ("moment", "N m")
        text, what = f"external {kind} {_AXES[axis]} of K:", {"axis": _AXES[axis][-1]}
        yield _describe(text, "external_force", f"K_F_ext_hat_K[{axis}]", value, bound, unit, what)


def _exceeding(
    numbers: Sequence[int], flags: Sequence[object], values: Sequence[float], bounds: Sequence[float] | None
) -> Iterator[tuple[int, float, float | None]]:
    """Yields number, value and bound of what is flagged, and still above the bound if that is known."""
    for number, flag, value in zip(numbers, flags, values, strict=True):
        bound = None if bounds is None else bounds[number]
        if flag and (bound is None or abs(value) > bound):
            yield number, value, bound


def _describe(
    text: str, code: str, field: str, value: float, bound: float | None, unit: str, what: Mapping[str, object]
) -> Remark:
    """Returns by how much a value exceeds its threshold, and with which sign clients read it."""
    sign, size = "-" if value < 0.0 else "", abs(value)
    if bound is None:
        sentence = (
            f"{text} {size:.4g} {unit} is above its threshold, which was not set over this connection (a virtual "
            f"controller starts with {DEFAULT_THRESHOLD:g} {unit}; {field} is {sign}{size:.4g})"
        )
        return Remark(sentence, f"{code}_unset", value=size, bound=DEFAULT_THRESHOLD, unit=unit, **what)
    shown, threshold = format_pair(size, bound)
    sentence = f"{text} {shown} {unit} is above its threshold {threshold} {unit} ({field} is {sign}{shown})"
    return Remark(sentence, code, value=size, bound=bound, unit=unit, **what)
