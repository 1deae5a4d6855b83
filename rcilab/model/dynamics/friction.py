"""Joint friction, of the simulated arm or with coefficients identified on a real one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointVector, as_vector
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.robots.mjcf import DAMPING_PER_TORQUE


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JointFriction:
    """Friction of n joints: viscous * dq + coulomb * sign(dq) + offset, the model of the vendor's library.

    Raises:
        InvalidValueError: The vectors differ in length or are not finite, or a coefficient is negative.
    """

    viscous: JointVector
    """Shape (n,), [N m s/rad], not negative."""
    coulomb: JointVector
    """Shape (n,), [N m], not negative; zero at standstill."""
    offset: JointVector
    """Shape (n,), [N m], also at standstill."""

    def __post_init__(self) -> None:
        """Checks the values and makes them read-only."""
        n = np.size(self.viscous)
        for name, unit in (("viscous", "N m s/rad"), ("coulomb", "N m"), ("offset", "N m")):
            values = as_vector(getattr(self, name), n, f"{name} friction", unit)
            if name != "offset" and (values < 0.0).any():
                raise InvalidValueError(f"{name} friction", values.tolist(), f"must not be negative [{unit}]")
            object.__setattr__(self, name, values)

    def torque(self, dq: Array) -> Array:
        """Returns the friction torques, [N m], to add to those of the rigid arm, for dq of shape (..., n), [rad/s].

        Raises:
            InvalidValueError: The friction has another number of joints.
        """
        n = len(self.viscous)
        if dq.shape[-1] != n:
            raise InvalidValueError("friction", repr(self), f"is for {n} joints, the arm has {dq.shape[-1]}")
        return self.viscous * dq + self.coulomb * np.sign(dq) + self.offset

    def __repr__(self) -> str:
        return f"<JointFriction of {len(self.viscous)} joints: .viscous, .coulomb, .offset>"


def simulated_friction(limits: JointLimits) -> JointFriction:
    """Returns the friction of the MuJoCo plant: viscous, in proportion to the size of the drive.

    Coefficients of the real arms are not published; these prevent ringing of the simulated arm. A real arm sends its
    own in the response to LoadRobotModel.

    Args:
        limits: Limits of the arm; the torque limits represent the size of the drives.
    """
    none = np.zeros(len(limits.torque))
    return JointFriction(viscous=DAMPING_PER_TORQUE * limits.torque, coulomb=none, offset=none)
