"""Checks before a motion is sent: its type, its certificate, and its start position."""

from __future__ import annotations

import math

import numpy as np

from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.core.arrays import JointVector
from rcilab.core.errors import InvalidValueError


def require_motion(motion: object, certificate: object) -> None:
    """Requires a motion, and a certificate or None.

    Raises:
        InvalidValueError: It is something else, such as a report; the message says what to pass.
    """
    from rcilab.conformance.certificate import Certificate
    from rcilab.conformance.report import Report
    from rcilab.motion import Motion

    if not isinstance(motion, Motion):
        raise InvalidValueError("motion", motion, "must be a motion; use plan_joint or Motion.from_cycles")
    if isinstance(certificate, Report):
        raise InvalidValueError("certificate", "report", "is not the proof: pass report.certificate, not the report")
    if certificate is not None and not isinstance(certificate, Certificate):
        raise InvalidValueError("certificate", certificate, "is not one; pass check(motion, model).certificate")


def describe_start_mismatch(start: JointVector, q_c: JointVector) -> str | None:
    """Returns why a motion cannot start here, as a sentence, or None if it starts at the arm's position.

    Args:
        start: Start of the motion, shape (n,), [rad].
        q_c: Commanded joint angles of the arm, [rad].
    """
    if len(start) != len(q_c):
        return f"the motion is for {len(start)} joints and the arm has {len(q_c)}; plan it for the right model"
    off = np.abs(np.asarray(start) - q_c)
    if float(off.max()) <= START_POSITION_TOLERANCE:
        return None
    joint = int(off.argmax())
    others = int((off > START_POSITION_TOLERANCE).sum()) - 1
    more = f" (and {others} more joint{'s' if others > 1 else ''})" if others else ""
    return (
        f"the motion starts elsewhere than the arm is: joint {joint + 1} would start at "
        f"{math.degrees(start[joint]):.4f} deg and stands at {math.degrees(q_c[joint]):.4f} deg, "
        f"{math.degrees(off[joint]):.2g} deg apart{more} (tolerance {math.degrees(START_POSITION_TOLERANCE):.0e} deg); "
        "plan the motion from robot.state.q_c, or move the arm to its start first: "
        "robot.execute(plan_joint(robot.model, robot.state.q_c, motion.q[0]))"
    )
