"""Springs and dampers on a moving arm: every vibration mode has the same damping ratio.

A spring with joint-space stiffness K (symmetric, shape (n, n)) on an arm with mass matrix M vibrates in n modes. With
M^-1 = F F^T (Cholesky) and the eigenvectors V of F^T K F, the columns of U = F V are these modes, and the eigenvalues
the squares of their angular frequencies w. The damping torque -M U diag(2 zeta w) U^T M dq then damps each mode as a
single mass on a spring with ratio zeta, whatever the pose: the "double diagonalisation" design of Albu-Schaeffer et
al. (2003).

The controller computes torques once a millisecond, so a spring must not be much faster than that: modes are slowed
down to `FASTEST_MODE`. This only affects light links, such as the last one with a long tool at full stiffness.

The modes change with the pose, but little within a few cycles: a `ModalDamping` keeps its design for that time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rcilab.core.arrays import JointVector, Matrix
from rcilab.model.dynamics.symmetric_solver import vibration_modes

DAMPING_RATIO = 0.7  # of critical: some 5 % overshoot
FASTEST_MODE = 600.0  # [rad/s] w times 1 ms stays at 0.6; computed torques become unstable at about 1.0
SLOWEST_DAMPING = 1.0  # [rad/s] Modes without a spring are damped as if they had this frequency; a tuning value
DESIGN_PERIOD = 10  # [cycles] How long a design is kept; a joint at full speed turns by 0.02 rad meanwhile


class Damping(NamedTuple):
    """The dampers of springs at one pose."""

    damper: Matrix
    """Torque per speed error, symmetric, shape (n, n), [N m s/rad]."""
    slowing: Matrix | None
    """Share of the springs' torque to subtract where they are too fast, shape (n, n); None: they are not."""

    def torque(self, spring: JointVector, speed_error: JointVector) -> JointVector:
        """Returns the torque of springs with these dampers, shape (n,), [N m].

        Args:
            spring: Torque of the springs alone, shape (n,), [N m].
            speed_error: Desired minus measured joint velocities, shape (n,), [rad/s].
        """
        tau = spring + self.damper.dot(speed_error)
        return tau if self.slowing is None else tau - self.slowing.dot(spring)


def design_damping(mass_inverse: Matrix, stiffness: Matrix, slowest: float = SLOWEST_DAMPING) -> Damping:
    """Returns the dampers of springs.

    Args:
        mass_inverse: M^-1 at the present pose, shape (n, n), [1/(kg m^2)].
        stiffness: Of the springs, in joint space, symmetric, shape (n, n), [N m/rad].
        slowest: Lower bound of the angular frequency that damping is computed with, [rad/s].
    """
    modes = vibration_modes(mass_inverse, stiffness)
    squares, back = modes.squares, modes.momenta
    gains = 2.0 * DAMPING_RATIO * np.sqrt(np.minimum(np.maximum(squares, slowest**2), FASTEST_MODE**2))
    slowing = None
    if squares[-1] > FASTEST_MODE**2:
        slowing = back * (1.0 - FASTEST_MODE**2 / np.maximum(squares, FASTEST_MODE**2)) @ modes.shapes.T
    return Damping(back * gains @ back.T, slowing)


class ModalDamping:
    """Dampers of a moving arm, redesigned every few cycles. Owned by the caller that computes torques."""

    def __init__(self) -> None:
        self._design: Damping | None = None
        self._age = 0

    def torque(self, design: Callable[[], Damping], spring: JointVector, speed_error: JointVector) -> JointVector:
        """Returns the torque of springs with their dampers, shape (n,), [N m].

        Args:
            design: Designs the dampers at the present pose; called when a new design is due.
            spring: Torque of the springs alone, shape (n,), [N m].
            speed_error: Desired minus measured joint velocities, shape (n,), [rad/s].
        """
        self._age += 1
        if self._design is None or self._age >= DESIGN_PERIOD:
            self._design, self._age = design(), 0
        return self._design.torque(spring, speed_error)
