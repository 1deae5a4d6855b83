"""Curves of the tool and the elbow along joint angles: speed, acceleration, arm angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.views.plots import Curves, backward_differences

if TYPE_CHECKING:
    from rcilab.core.limits import Limits
    from rcilab.model.robot_model import RobotModel

ToolQuantity = Literal["speed", "acceleration", "psi"]
TOOL_QUANTITIES: tuple[ToolQuantity, ...] = ("speed", "acceleration", "psi")


def tool_curves(model: RobotModel, t: Array, q: JointPath, quantity: ToolQuantity) -> Curves:
    """Returns one column: speed of the tool, [m/s], its acceleration, [m/s^2], or the arm angle, [rad].

    The first two are computed as in the controller: norms of backward differences of the tool's positions.

    Args:
        model: The arm with its tool.
        t: [s], shape (N,).
        q: Joint angles, shape (N, n), [rad].
        quantity: The signal; only 7-axis arms have an arm angle.
    """
    if quantity == "psi":
        values = model.solver.redundancy_angle_path(q)
        return Curves(t=t, values=np.asarray(values)[:, np.newaxis])
    positions = model.position_path(q)
    rates = backward_differences(t, positions, 1 if quantity == "speed" else 2)
    return Curves(t=t, values=np.sqrt((rates * rates).sum(axis=1))[:, np.newaxis])


def tool_limit(limits: Limits, quantity: ToolQuantity) -> float | None:
    """Returns the limit of a signal, in SI units; None without one."""
    tool = limits.cartesian
    return {"speed": tool.translation_velocity, "acceleration": tool.translation_acceleration, "psi": None}[quantity]
