"""Compares the load of a model with the torques of the arm at standstill: no controller reports its load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rcilab.model.dynamics.payload import NO_LOAD

if TYPE_CHECKING:
    from rcilab.core.state import RobotState
    from rcilab.model.robot_model import RobotModel

_STILL = 1e-3  # [rad/s] Tuning value: noise of the velocity of an arm at standstill is below.
_FRICTION = 1.0  # [N m] Above the Coulomb friction of 0.33 to 0.59 N m on recordings of an xMatePro3.
_MODEL_ERROR = 0.2  # Recordings of an xMatePro3 have up to 1.18 times the gravity torque of the model.


def describe_other_load(model: RobotModel, state: RobotState, robot: str) -> str:
    """Returns a sentence if the arm does not hold the model's load, or if this cannot be known; else "".

    Args:
        model: The arm with its tool and load.
        state: The state of the arm.
        robot: Name of the robot in the sentence.
    """
    expected = model.torque(state.q).gravity
    is_known = bool(np.any(state.tau)) and float(np.abs(state.dq).max()) <= _STILL
    tolerance = _FRICTION + _MODEL_ERROR * np.abs(expected)
    excess = np.abs(state.tau - expected) - tolerance
    joint = int(excess.argmax())
    mass = model.load.mass
    carries = f"a load of {mass:g} kg" if mass else "no load"
    sending = "robot.set_load, or connect(..., apply=True)"
    if is_known and excess[joint] > 0.0:
        return (
            f"the load of {robot} is not that of the model, which has {carries}: at standstill joint {joint + 1} has "
            f"{state.tau[joint]:.2f} N m, the model {expected[joint]:.2f} N m (tolerance {tolerance[joint]:.1f}); "
            f"connect with a model that has the arm's load, or send the model's: {sending}"
        )
    unloaded = expected if mass == 0.0 else model.with_load(NO_LOAD).torque(state.q).gravity
    if mass == 0.0 or (is_known and bool((np.abs(expected - unloaded) > tolerance).any())):
        return ""
    return (
        f"whether {robot} has the load of the model, {mass:g} kg, is not known: its state does not contain it, and the "
        f"torques of this pose do not show it; to send it: {sending}"
    )
