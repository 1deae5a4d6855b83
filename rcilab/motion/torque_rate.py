"""The time law "torque_rate_limited": the jerk limits are lowered until the torques change as slowly as recommended."""

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
_SHARE = 0.95
"""Part of the recommended bound to plan for: the controller differentiates torques over whole cycles, and between the
instants checked here they may change a little faster."""
_MOMENTS = 5
"""At how many moments of each polynomial piece to look, both ends among them."""
_EVENTFUL = 0.03
"""Part of the jerk limit below which the torque rate of a cycle is not looked at, where every cycle is a piece."""

T = TypeVar("T")


def plan_within_torque_rate(
    model: RobotModel, plan: Callable[[RobotModel], T], curve: Callable[[T], PiecewisePolynomial]
) -> T:
    """Returns a motion whose torques, without gravity, change no faster than the limits of the arm recommend.

    The torque rate is the inertia times the jerk, and smaller terms. The jerk limits of all joints are lowered by the
    same factor until the rate of the planned motion is inside its bound. Where terms of the velocity alone pass the
    bound, the last attempt is returned, and `rcilab.check` reports it.

    Args:
        model: The arm, with its tool and load.
        plan: Plans for the arm with lowered jerk limits.
        curve: Returns the curve of what was planned.
    """
    factor, planned = 1.0, plan(model)
    for _ in range(_ATTEMPTS):
        ratio = _worst_ratio(model, curve(planned))
        if ratio <= 1.0:
            break
        factor *= _SHARE / ratio
        planned = plan(_with_jerk(model, factor))
    return planned


def _with_jerk(model: RobotModel, factor: float) -> RobotModel:
    limits = model.limits
    limits = replace(limits, joint=replace(limits.joint, jerk=factor * limits.joint.jerk))
    description = replace(model.description, limits=limits)
    return RobotModel(description, model.T_flange_tool, model.load, model.T_tool_stiffness)


def _worst_ratio(model: RobotModel, curve: PiecewisePolynomial) -> float:
    """Returns the largest torque rate over its bound."""
    before = _moments(model, curve)
    if not len(before):
        return 0.0
    after = np.minimum(before + CYCLE_TIME, curve.duration)
    change = _torques(model, curve, after) - _torques(model, curve, before)
    return float((np.abs(change).max(axis=0) / (CYCLE_TIME * model.limits.joint.torque_rate)).max())


def _moments(model: RobotModel, curve: PiecewisePolynomial) -> Array:
    """Returns the moments to look at, [s]."""
    breaks = curve.breaks
    if len(breaks) * _MOMENTS >= curve.duration / CYCLE_TIME:
        times = np.arange(0.0, curve.duration, CYCLE_TIME)
        return times[(np.abs(curve.sample(times, 3)) > _EVENTFUL * model.limits.joint.jerk).any(axis=1)]
    return np.linspace(breaks[:-1], np.maximum(breaks[1:] - CYCLE_TIME, breaks[:-1]), _MOMENTS).ravel()


def _torques(model: RobotModel, curve: PiecewisePolynomial, times: Array) -> Array:
    q, dq, ddq = (curve.sample(times, order) for order in range(3))
    return model.rigid_body.motion_torques(q, dq, ddq)
