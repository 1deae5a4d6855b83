"""The rate limiter of libfranka, which programs run with by default. Shares no code with the package.

It starts from the commanded values of the state: those of version 10 are rounded to single precision.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

CYCLE = 0.001  # [s]
MARGIN = 1e-3  # Inside each limit, in its unit.


def limited_velocity(
    limits: tuple[ArrayLike, ArrayLike, ArrayLike], wanted: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike
) -> np.ndarray:
    """Returns the velocity of joints, one by one.

    Args:
        limits: Velocity, acceleration, jerk.
        wanted: Velocity that the program commands.
        velocity: That of the state.
        acceleration: That of the state.
    """
    highest, ddq, jerk = (np.asarray(limit) - MARGIN for limit in limits)
    v, a = np.asarray(velocity), np.asarray(acceleration)
    change = np.clip(((np.asarray(wanted) - v) / CYCLE - a) / CYCLE, -jerk, jerk)
    up, down = np.minimum(jerk / ddq * (highest - v), ddq), np.minimum(jerk / ddq * (highest + v), ddq)
    return v + np.clip(a + change * CYCLE, -down, up) * CYCLE


def limited_vector(
    limits: tuple[float, float, float], wanted: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike
) -> np.ndarray:
    """Returns the velocity of the tool by its norm, as `limited_velocity`."""
    highest, most, jerk = (limit - MARGIN for limit in limits)
    v, a = np.asarray(velocity), np.asarray(acceleration)
    change = ((np.asarray(wanted) - v) / CYCLE - a) / CYCLE
    a = a + change * CYCLE * min(1.0, jerk / max(float(np.linalg.norm(change)), 1e-9))
    size = max(float(np.linalg.norm(a)), 1e-9)
    along = float(a @ v) / size
    room = -along + np.sqrt(along**2 - v @ v + highest**2)
    return v + a / size * min(size, jerk / most * room, most) * CYCLE


def limited_torque(rate: float, wanted: ArrayLike, tau: ArrayLike) -> np.ndarray:
    """Returns the torques of a program that may change by a rate, [N m/s], from those of the state."""
    step = (rate - MARGIN) * CYCLE
    return np.asarray(tau) + np.clip(np.asarray(wanted) - np.asarray(tau), -step, step)
