"""Numbers and advice for the text of a report."""

from __future__ import annotations

from math import ceil, degrees, floor, isfinite

import numpy as np

from rcilab.conformance.catalogue import Phrase
from rcilab.core.condition import Condition, Signal
from rcilab.motion.joint import JOINT_LAWS
from rcilab.motion.motion import Motion

_LARGE = 1e6
_STANDSTILL = 1e-6  # [rad/s] A motion whose fitted curve starts more slowly starts at standstill.


def share(ratio: float) -> str:
    """Returns the used part of a bound as text: in percent, or as a factor far beyond it."""
    return f"{100.0 * ratio:.1f} %" if ratio < 10.0 else f"{factor_text(ratio)} x"


def factor_text(ratio: float) -> str:
    """Returns a factor as text: whole, or with an exponent from a million on."""
    return f"{ratio:.0f}" if ratio < _LARGE else f"{ratio:.3g}"


def plural(count: int, noun: str) -> str:
    """Returns a number of things as text."""
    return f"{count} {noun}" + "s" * (count != 1)


def with_degrees(angle: float, text: str) -> str:
    """Returns an angle in radians, as in `text`, and in degrees."""
    angle_deg = degrees(angle)
    is_usual = 0.005 <= abs(angle_deg) < _LARGE or angle_deg == 0.0
    shown = f"{angle_deg:.2f}" if is_usual else f"{angle_deg:.2g}"
    return f"{text} rad ({shown}°)"


def advise(
    condition: Condition,
    motion: Motion,
    *,
    row: int,
    count: int,
    ratio: float,
    is_off_start: bool,
    is_isolated: bool = True,
    soft_limit: float | None = None,
    is_near_end: bool = False,
    is_record: bool = False,
) -> Phrase:
    """Returns the remedy for a violation.

    Args:
        condition: The broken condition.
        motion: The motion that breaks it.
        row: Index of the first violating sample.
        count: Number of consecutive violating samples.
        ratio: Ratio of the worst value to the bound.
        is_off_start: Whether the motion does not start at the start state of the check.
        is_isolated: Whether the values before and after these samples are far from the worst one.
        soft_limit: The soft limit that the joint exceeds, [rad]; None if it exceeds the arm's own range.
        is_near_end: Whether the bound is lower than elsewhere, because the joint is near the end of its range.
        is_record: Whether the motion was recorded: values of a plan are not measured.
    """
    if condition.stage == "start" and condition.signal == "torque":
        return Phrase("advice.torque.rate")
    if condition.stage == "start":
        return Phrase("advice.start.position" if condition.order == 0 else "advice.start.rest")
    if condition.stage == "end":
        return Phrase("advice.end.rest")
    if condition.is_measured and is_record:
        return Phrase("advice.measured")
    if condition.signal == "torque":
        return _torque_advice(condition, motion)
    if condition.order == 0 and condition.signal == "joint" and soft_limit is not None:
        return Phrase("advice.range_soft", limit=soft_limit)
    if condition.order == 0:
        return Phrase(_REMEDIES.get(condition.signal, "advice.range"))
    if row <= condition.order and is_off_start:
        return Phrase("advice.off_start")
    if row <= condition.order and np.abs(motion.at(0.0).dq).max() > _STANDSTILL:
        return Phrase("advice.moving_start")
    if row >= len(motion):
        return Phrase("advice.moving_end")
    # One displaced sample changes two first differences, three second and four third ones.
    if not isfinite(ratio) or (is_isolated and count <= condition.order + 1 and motion.law == "samples"):
        return Phrase("advice.jump")
    if is_near_end:
        return Phrase("advice.near_end", factor=f"{ceil(1000.0 * ratio) / 1000.0:.3f}")
    if motion.law in JOINT_LAWS:
        lower = floor(100.0 * motion.speed / ratio) / 100.0
        if 0.0 < lower < motion.speed:
            return Phrase("advice.speed_to", speed=f"{lower:.2f}")
        return Phrase("advice.speed")
    factor = ceil(1000.0 * ratio ** (1.0 / condition.order)) / 1000.0
    return Phrase("advice.slower", factor=f"{factor:.3f}")


_REMEDIES: dict[Signal, str] = {
    "position": "advice.box",
    "arm_angle": "advice.arm_angle",
    "frame": "advice.frame",
    "link_distance": "advice.clearance",
    "floor_distance": "advice.clearance",
    "cell_distance": "advice.obstacle",
    "elbow_sign": "advice.elbow_sign",
    "external_torque": "advice.contact",
    "external_force": "advice.contact",
    "lost_commands": "advice.network",
}
"""Remedies for signals that are out of bounds themselves, not by a derivative; the default is the joint's range."""


def _torque_advice(condition: Condition, motion: Motion) -> Phrase:
    if condition.order == 1 and motion.law in JOINT_LAWS and condition.necessity == "necessary":
        return Phrase("advice.torque.planned")
    if condition.necessity == "necessary":
        return Phrase("advice.torque.rate" if condition.order == 1 else "advice.torque.range")
    if condition.order == 1 and motion.law == "jerk_limited":
        return Phrase("advice.torque_rate_limited")
    return Phrase("advice.speed" if motion.law in JOINT_LAWS else "advice.softer")
