"""Whether a motion starts where the arm is."""

from __future__ import annotations

import math

import numpy as np

from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.core.arrays import JointVector


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
