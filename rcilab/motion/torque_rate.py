"""Time law "torque_rate_limited": lowers the jerk limits until the torque rates are within the recommended limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel
from rcilab.motion.piecewise import PiecewisePolynomial

_ATTEMPTS = 6
_TARGET_PART = 0.95
"""Part of the recommended bound to plan for: the controller differentiates torques over whole cycles, and between the
instants checked here the rate may be slightly higher."""
_SAMPLES_PER_PIECE = 5
"""Number of instants at which each polynomial piece is checked, with both ends."""
_MIN_JERK_PART = 0.03
"""Part of the jerk limit below which the torque rate of a cycle is not checked, if every cycle is a piece."""

T = TypeVar("T")


def plan_within_torque_rate(
    model: RobotModel, plan: Callable[[RobotModel], T], curve: Callable[[T], PiecewisePolynomial]
) -> T:
    """Returns a motion whose torque rates, without gravity, are within the recommended limits of the arm.

    The torque rate is the inertia times the jerk, and smaller terms. The jerk limits of all joints are lowered by the
    same factor until the torque rate is inside its bound. If terms of the velocity alone exceed the bound, the last
    attempt is returned, and `rcilab.check` reports it.

    Args:
        model: The arm, with its tool and load.
        plan: Plans the motion for the arm with lowered jerk limits.
        curve: Returns the curve of a plan.
    """
    factor, planned = 1.0, plan(model)
    for _ in range(_ATTEMPTS):
        ratio = _worst_ratio(model, curve(planned))
        if ratio <= 1.0:
            break
        factor *= _TARGET_PART / ratio
        planned = plan(_with_jerk(model, factor))
    return planned


def _with_jerk(model: RobotModel, factor: float) -> RobotModel:
    limits = model.limits
    limits = replace(limits, joint=replace(limits.joint, jerk=factor * limits.joint.jerk))
    description = replace(model.description, limits=limits)
    return RobotModel(description, model.T_flange_tool, model.load, model.T_tool_stiffness)


def _worst_ratio(model: RobotModel, curve: PiecewisePolynomial) -> float:
    """Returns the largest ratio of a torque rate to its bound."""
    before = _sample_times(model, curve)
    if not len(before):
        return 0.0
    after = np.minimum(before + CYCLE_TIME, curve.duration)
    torque = _torques(model, curve, np.concatenate([before, after]))
    change = torque[len(before) :] - torque[: len(before)]
    return float((np.abs(change).max(axis=0) / (CYCLE_TIME * model.limits.joint.torque_rate)).max())


def _sample_times(model: RobotModel, curve: PiecewisePolynomial) -> Array:
    """Returns the times at which the curve is checked, [s]."""
    breaks = curve.breaks
    if len(breaks) * _SAMPLES_PER_PIECE >= curve.duration / CYCLE_TIME:
        times = np.arange(0.0, curve.duration, CYCLE_TIME)
        return times[(np.abs(curve.sample(times, 3)) > _MIN_JERK_PART * model.limits.joint.jerk).any(axis=1)]
    return np.linspace(breaks[:-1], np.maximum(breaks[1:] - CYCLE_TIME, breaks[:-1]), _SAMPLES_PER_PIECE).ravel()


def _torques(model: RobotModel, curve: PiecewisePolynomial, times: Array) -> Array:
    q, dq, ddq = (curve.sample(times, order) for order in range(3))
    return model.rigid_body.motion_torques(q, dq, ddq)
