"""The torque sensors of real joints: readings with friction, noise and steps.

On a real arm the friction of a joint is in its torque reading: it acts beyond the sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Array, make_readonly
from rcilab.robots.description import JointImperfection
from rcilab.sim.plant import Measurement

_SLIDING = 0.005  # [rad/s] Above it the friction in a reading is that of a sliding joint; a tuning value.
_BLOCK = 1000  # [cycles] Noise is drawn for this many at once, which is faster.


class TorqueSensors:
    """The sensors of an arm. Owned by its plant.

    Args:
        joints: One per joint.
        seed: Of the noise; the same seed gives the same readings.
    """

    def __init__(self, joints: Sequence[JointImperfection], seed: int = 0) -> None:
        self._friction = np.array([joint.friction for joint in joints])
        self._step = np.array([joint.torque_step for joint in joints])
        self._scale = np.array([joint.torque_noise for joint in joints])
        self._random = np.random.default_rng(seed)
        self._noise: Array = np.empty((0, len(self._scale)))
        self._used = 0

    def read(self, measured: Measurement, *, is_friction_simulated: bool) -> Measurement:
        """Returns a measurement as real sensors read it.

        Args:
            measured: The exact one.
            is_friction_simulated: Whether its torques already contain the friction.
        """
        if self._used >= len(self._noise):
            self._noise, self._used = self._random.normal(scale=self._scale, size=(_BLOCK, len(self._scale))), 0
        tau: Array = measured.tau + self._noise[self._used]
        self._used += 1
        if not is_friction_simulated:
            tau += self._friction * np.tanh(measured.dq / _SLIDING)
        return measured._replace(tau=make_readonly(self._step * np.rint(tau / self._step)))
