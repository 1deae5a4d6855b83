"""Springs and dampers on a moving arm: every mode of vibration gets the same damping ratio.

A spring with joint-space stiffness K (symmetric, shape (n, n)) on an arm with mass matrix M vibrates in n modes. With
M^-1 = F F^T (Cholesky) and the eigenvectors V of F^T K F, the columns of U = F V are these modes, and the eigenvalues
the squares of their angular frequencies w. The damping torque -M U diag(2 zeta w) U^T M dq then damps each mode as a
single mass on a spring with ratio zeta, whatever the pose: the "double diagonalisation" design of Albu-Schaeffer et
al. (2003).

The controller computes torques once a millisecond, so a spring must not be much faster than that: modes are slowed
down to `FASTEST_MODE`. Only light links feel it, such as the last one behind a long tool at full stiffness.
"""

from __future__ import annotations

import math

import numpy as np

from rcilab.arrays import JointVector, Matrix
from rcilab.dynamics.rigid_body import ArmTerms

DAMPING_RATIO = 0.7  # of critical; a choice: some 5 % overshoot
FASTEST_MODE = 600.0  # [rad/s] w times 1 ms stays at 0.6; computed torques become unstable at about 1.0; a choice
SLOWEST_DAMPING = 1.0  # [rad/s] Modes without a spring are damped as if theirs were that slow; a choice


def spring_torque(
    terms: ArmTerms,
    stiffness: Matrix,
    spring: JointVector,
    speed_error: JointVector,
    slowest: float = SLOWEST_DAMPING,
) -> JointVector:
    """Returns the torque of springs with their dampers, shape (n,), [N m].

    Args:
        terms: The arm as it is now.
        stiffness: Of the springs, in joint space, symmetric, shape (n, n), [N m/rad].
        spring: Torque of the springs without damping, shape (n,), [N m].
        speed_error: Wanted minus measured joint velocities, shape (n,), [rad/s].
        slowest: Least angular frequency that damping is computed with, [rad/s].
    """
    F = np.linalg.cholesky(terms.mass_inverse)
    eigenvalues, V = np.linalg.eigh(F.T @ stiffness @ F)
    U = F @ V
    squares = eigenvalues.tolist()
    momenta = (terms.mass_matrix @ speed_error @ U).tolist()
    gains = [2.0 * DAMPING_RATIO * math.sqrt(min(max(square, slowest**2), FASTEST_MODE**2)) for square in squares]
    forces = [gain * momentum for gain, momentum in zip(gains, momenta, strict=True)]
    if squares[-1] > FASTEST_MODE**2:
        pulls = (spring @ U).tolist()
        shares = [max(0.0, 1.0 - FASTEST_MODE**2 / square) if square > 0.0 else 0.0 for square in squares]
        forces = [force - share * pull for force, share, pull in zip(forces, shares, pulls, strict=True)]
    return spring + terms.mass_matrix @ (U @ forces)
