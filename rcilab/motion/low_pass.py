"""The first-order low pass of commands that the clients of ROKAE and Franka have."""

from __future__ import annotations

import math

import numpy as np

from rcilab.core.arrays import Array, as_number
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.rotation import as_rotation9
from rcilab.motion.path import slerp

FILTER_OFF = 1000.0  # [Hz] Cut-off frequency from which on nothing is filtered: the rate of the commands.


def smoothing(cut_off: float, period: int = 1) -> float:
    """Returns k of the first-order filter x += k (u - x): dt / (dt + 1 / (2 pi f)); 1 at 1000 Hz and above.

    Args:
        cut_off: f, [Hz].
        period: dt, [cycles].

    Raises:
        InvalidValueError: It is not above 0.
    """
    frequency = as_number(cut_off, "cut_off", "Hz")
    if not frequency > 0.0:
        raise InvalidValueError("cut_off", cut_off, f"must be above 0 [Hz]; {FILTER_OFF:g} switches the filter off")
    return (
        1.0 if frequency >= FILTER_OFF else period * CYCLE_TIME / (period * CYCLE_TIME + 1.0 / (math.tau * frequency))
    )


def low_pass(u: Array, x: Array, k: float) -> Array:
    """Returns the filter's next value from the command u and its last value x."""
    return x + k * (u - x)


def low_pass_pose(u: Array, x: Array, k: float) -> Array:
    """Returns the next pose from the commanded pose u and the last one x, (4, 4): the rotation in the same ratio."""
    T = u.copy()
    T[:3, 3] = low_pass(u[:3, 3], x[:3, 3], k)
    T[:3, :3] = np.array(slerp(as_rotation9(x[:3, :3]), as_rotation9(u[:3, :3]), k)).reshape(3, 3)
    return T
