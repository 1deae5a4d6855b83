"""Conversion between the derivatives of a curve and the backward differences of its samples.

A difference over the last cycle lags the derivative at its end. Over one cycle h of constant jerk j:
dq_b = dq - ddq h / 2 + j h^2 / 6 and ddq_b = ddq - j h. Continuing a stream of commands from differences as if they
were derivatives causes a step of half a cycle's acceleration, a jerk of thousands of rad/s^3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME


def derivatives_from_differences(
    dq: ArrayLike, ddq: ArrayLike, jerk: ArrayLike = 0.0
) -> tuple[JointVector, JointVector]:
    """Returns velocity and acceleration at the last sample of a stream.

    Args:
        dq: First backward difference over one cycle, shape (n,), [rad/s].
        ddq: Second backward difference, shape (n,), [rad/s^2].
        jerk: Third backward difference, shape (n,), [rad/s^3]; 0 assumes a constant acceleration.
    """
    h = CYCLE_TIME
    jerk = np.asarray(jerk, dtype=np.float64)
    ddq = np.asarray(ddq, dtype=np.float64)
    return np.asarray(dq, dtype=np.float64) + ddq * (h / 2.0) + jerk * (h**2 / 3.0), ddq + jerk * h


def differences_from_derivatives(
    dq: ArrayLike, ddq: ArrayLike, jerk: ArrayLike = 0.0
) -> tuple[JointVector, JointVector]:
    """Returns the first and second backward differences of a curve with these derivatives, as a controller forms them.

    Args:
        dq: Velocity, shape (n,), [rad/s].
        ddq: Acceleration, shape (n,), [rad/s^2].
        jerk: Jerk of the last three cycles, shape (n,), [rad/s^3].
    """
    h = CYCLE_TIME
    jerk = np.asarray(jerk, dtype=np.float64)
    ddq = np.asarray(ddq, dtype=np.float64)
    return np.asarray(dq, dtype=np.float64) - ddq * (h / 2.0) + jerk * (h**2 / 6.0), ddq - jerk * h
