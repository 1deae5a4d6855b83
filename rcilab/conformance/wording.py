"""Numbers and advice in the sentences of a report."""

from __future__ import annotations

from math import ceil, degrees, floor, isfinite

from rcilab.conformance.condition import Condition
from rcilab.motion.motion import Motion


def amount(value: float, bound: float) -> tuple[str, str]:
    """Returns value and bound with as few digits as show that they differ."""
    for digits in range(4, 17):
        texts = f"{value:.{digits}g}", f"{bound:.{digits}g}"
        if texts[0] != texts[1] or value == bound:
            return texts
    return repr(value), repr(bound)


def share(ratio: float) -> str:
    """Returns how much of a bound is used: in percent, or as a factor far beyond it."""
    return f"{100.0 * ratio:.1f} %" if ratio < 10.0 else f"{ratio:.0f} x"


def with_degrees(angle: float, text: str) -> str:
    """Returns an angle in both units; `text` is its number in [rad]."""
    return f"{text} rad ({degrees(angle):.2f}°)"


def advise(condition: Condition, motion: Motion, *, row: int, count: int, ratio: float, off_start: bool) -> str:
    """Returns what to do about a violation.

    Args:
        condition: The broken condition.
        motion: The motion that breaks it.
        row: Index of the first sample that does.
        count: Number of samples in a row.
        ratio: Worst value over bound.
        off_start: Whether the motion starts elsewhere than it was judged from.
    """
    if condition.stage == "start":
        if condition.order == 0:
            return "plan the motion from the arm's commanded position (state.q_c)"
        return "let the motion start at rest"
    if condition.stage == "end":
        return "let the motion end at rest"
    if condition.signal == "position":
        return "choose a path inside the safety box"
    if condition.signal == "torque":
        return _softer(condition, motion)
    if condition.order == 0:
        return "choose a path inside the joint's range"
    if row <= condition.order and off_start:
        return "the motion does not start where the arm is: plan it from the arm's commanded position (state.q_c)"
    if row <= condition.order and motion.at(0.0).dq.any():
        return "the motion starts moving: plan it from rest, or check it with the start state it was planned for"
    if row >= len(motion):
        return "the motion stops with a jerk at its end: let it end at rest"
    # One displaced sample shows in two first differences, three second and four third ones.
    if not isfinite(ratio) or (count <= condition.order + 1 and motion.law == "samples"):
        return "the samples around this time jump: smooth them"
    if motion.law in ("jerk_limited", "s_profile"):
        lower = floor(100.0 * motion.speed / ratio) / 100.0
        if 0.0 < lower < motion.speed:
            return f"lower speed to {lower:.2f} or less"
        return "lower speed"
    slower = ceil(1000.0 * ratio ** (1.0 / condition.order)) / 1000.0
    return f"run it {slower:.3f} times slower, or smooth it"


def _softer(condition: Condition, motion: Motion) -> str:
    """Returns what to do about torques: only an arm that gives them exactly as asked feels it."""
    if condition.order == 1 and motion.law == "jerk_limited":
        return 'law="s_profile" plans it with accelerations that rise more gently'
    return "lower speed" if motion.law in ("jerk_limited", "s_profile") else "run it slower, or smooth it"
