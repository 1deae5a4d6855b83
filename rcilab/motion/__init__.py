"""Motions and their planners."""

from __future__ import annotations

from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.cartesian import plan_arc, plan_circle, plan_line, plan_nullspace
from rcilab.motion.differences import derivatives_from_differences, differences_from_derivatives
from rcilab.motion.joint import plan_joint
from rcilab.motion.motion import Motion, MotionSample, TimeLaw, motion_through, require_motion
from rcilab.motion.online import Jog
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.plan_program import plan_program
from rcilab.motion.program import Program
from rcilab.motion.recovery import plan_recovery
from rcilab.motion.stop import plan_stop
from rcilab.motion.waypoint import Waypoint

__all__ = [
    "LIMIT_MARGIN",
    "Jog",
    "Motion",
    "MotionSample",
    "PiecewisePolynomial",
    "Program",
    "TimeLaw",
    "Waypoint",
    "derivatives_from_differences",
    "differences_from_derivatives",
    "motion_through",
    "plan_arc",
    "plan_circle",
    "plan_joint",
    "plan_line",
    "plan_nullspace",
    "plan_program",
    "plan_recovery",
    "plan_stop",
    "require_motion",
]
