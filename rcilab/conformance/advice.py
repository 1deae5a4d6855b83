"""Numbers and advice in the sentences of a report."""

from __future__ import annotations

from math import ceil, degrees, floor, isfinite

from rcilab.conformance.catalogue import Phrase
from rcilab.core.condition import Condition, Signal
from rcilab.motion.motion import Motion, TimeLaw


def share(ratio: float) -> str:
    """Returns how much of a bound is used: in percent, or as a factor far beyond it."""
    return f"{100.0 * ratio:.1f} %" if ratio < 10.0 else f"{ratio:.0f} x"


def with_degrees(angle: float, text: str) -> str:
    """Returns an angle in both units; `text` is its number in [rad]."""
    angle_deg = degrees(angle)
    shown = f"{angle_deg:.2f}" if abs(angle_deg) >= 0.005 or angle_deg == 0.0 else f"{angle_deg:.2g}"
    return f"{text} rad ({shown}°)"


def advise(
    condition: Condition,
    motion: Motion,
    *,
    row: int,
    count: int,
    ratio: float,
    off_start: bool,
    soft: float | None = None,
) -> Phrase:
    """Returns what to do about a violation.

    Args:
        condition: The broken condition.
        motion: The motion that breaks it.
        row: Index of the first sample that does.
        count: Number of samples in a row.
        ratio: Worst value over bound.
        off_start: Whether the motion starts elsewhere than the start state of the check.
        soft: The soft limit of the joint's angle that is passed, [rad]; None: the arm's own range is left.
    """
    if condition.stage == "start" and condition.signal == "torque":
        return Phrase("advice.torque.rate")
    if condition.stage == "start":
        return Phrase("advice.start.position" if condition.order == 0 else "advice.start.rest")
    if condition.stage == "end":
        return Phrase("advice.end.rest")
    if condition.is_measured:
        return Phrase("advice.measured")
    if condition.signal == "torque":
        return _softer(condition, motion)
    if condition.order == 0 and condition.signal == "joint" and soft is not None:
        return Phrase("advice.range_soft", limit=soft)
    if condition.order == 0:
        return Phrase(_WAYS.get(condition.signal, "advice.range"))
    if row <= condition.order and off_start:
        return Phrase("advice.off_start")
    if row <= condition.order and motion.at(0.0).dq.any():
        return Phrase("advice.moving_start")
    if row >= len(motion):
        return Phrase("advice.moving_end")
    # One displaced sample shows in two first differences, three second and four third ones.
    if not isfinite(ratio) or (count <= condition.order + 1 and motion.law == "samples"):
        return Phrase("advice.jump")
    if motion.law in _PLANNED:
        lower = floor(100.0 * motion.speed / ratio) / 100.0
        if 0.0 < lower < motion.speed:
            return Phrase("advice.speed_to", speed=f"{lower:.2f}")
        return Phrase("advice.speed")
    slower = ceil(1000.0 * ratio ** (1.0 / condition.order)) / 1000.0
    return Phrase("advice.slower", factor=f"{slower:.3f}")


_WAYS: dict[Signal, str] = {
    "position": "advice.box",
    "arm_angle": "advice.arm_angle",
    "frame": "advice.frame",
    "link_distance": "advice.clearance",
    "floor_distance": "advice.clearance",
    "elbow_sign": "advice.elbow_sign",
    "external_torque": "advice.contact",
    "external_force": "advice.contact",
    "lost_commands": "advice.network",
}
"""What to do about signals that are themselves out of bounds, not their derivatives; of joints it is the range."""


_PLANNED: tuple[TimeLaw, ...] = ("jerk_limited", "torque_rate_limited", "s_profile")
"""Laws whose planners take a speed."""


def _softer(condition: Condition, motion: Motion) -> Phrase:
    """Returns what to do about torques: those of a motion matter only to an arm that gives them exactly as asked."""
    if condition.necessity == "necessary":
        return Phrase("advice.torque.rate" if condition.order == 1 else "advice.torque.range")
    if condition.order == 1 and motion.law == "jerk_limited":
        return Phrase("advice.gentler")
    return Phrase("advice.speed" if motion.law in _PLANNED else "advice.softer")
