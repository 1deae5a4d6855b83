"""First-order low-pass filters of commands and of reported torques.

    x += k (u - x),   k = dt / (dt + 1 / (2 pi f))

The vendor's client applies the same filter before it sends. At 1000 Hz, the largest frequency that can be set, a
filter is off.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, remainder, tau

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.closest_pose import interpolate

SAMPLING_RATE = 1.0 / CYCLE_TIME  # [Hz] A filter with this cut-off frequency is off.


def low_pass_gain(frequency: float) -> float:
    """Returns the gain k of a low-pass filter, 0 to 1.

    Args:
        frequency: Cut-off frequency, 0.1 to 1000 Hz.
    """
    if frequency >= SAMPLING_RATE:
        return 1.0
    return CYCLE_TIME / (CYCLE_TIME + 1.0 / (2.0 * pi * frequency))


class LowPass:
    """A low-pass filter of several numbers. Owned by the virtual arm.

    Args:
        frequency: Cut-off frequency, [Hz].
        start: Initial values.
    """

    def __init__(self, frequency: float, start: Sequence[float]) -> None:
        self._gain = low_pass_gain(frequency)
        self._values = list(start)

    def step(self, values: Sequence[float]) -> list[float]:
        """Returns the filtered values of this cycle."""
        gain = self._gain
        if gain == 1.0:
            return list(values)
        self._values = [x + gain * (u - x) for x, u in zip(self._values, values, strict=True)]
        return self._values


class PoseLowPass:
    """A low-pass filter of a pose and an arm angle: linear position, slerp, and the shorter direction of psi.

    Owned by the virtual arm.

    Args:
        frequency: Cut-off frequency, [Hz].
        pose: Initial pose.
        psi: Initial arm angle, [rad].
    """

    def __init__(self, frequency: float, pose: Pose, psi: float) -> None:
        self._gain = low_pass_gain(frequency)
        self._pose = pose
        self._psi = psi

    @property
    def is_on(self) -> bool:
        """Whether it changes poses."""
        return self._gain < 1.0

    def step(self, pose: Pose, psi: float) -> tuple[Pose, float]:
        """Returns the filtered pose and arm angle of this cycle."""
        gain = self._gain
        if gain == 1.0:
            return pose, psi
        self._pose = interpolate(self._pose, pose, gain)
        self._psi = remainder(self._psi + gain * remainder(psi - self._psi, tau), tau)
        return self._pose, self._psi
