"""Check of the start position of a motion."""

from __future__ import annotations

import math

import numpy as np

from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.core.arrays import JointVector


def describe_start_mismatch(start: JointVector, q_c: JointVector) -> str | None:
    """Returns a message if a motion does not start at the arm's position, or None.

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
        f"the motion does not start at the arm's position: joint {joint + 1} starts at "
        f"{math.degrees(start[joint]):.4f} deg and is at {math.degrees(q_c[joint]):.4f} deg, "
        f"{math.degrees(off[joint]):.2g} deg apart{more} (tolerance {math.degrees(START_POSITION_TOLERANCE):.0e} deg); "
        "plan the motion from robot.state.q_c, or move the arm to its start first: "
        "robot.execute(plan_joint(robot.model, robot.state.q_c, motion.q[0]))"
    )
