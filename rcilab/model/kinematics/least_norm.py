"""The inverse of a Jacobian: the smallest joint motion for a desired tool motion, bounded at singularities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array

NEAR_SINGULAR = 0.03  # [m, rad] Smallest singular value that is inverted undamped; typical poses have 0.1 and more.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JointRates:
    """The joint motion closest to a desired motion of a frame; with a leading dimension N for N motions."""

    rates: Array
    """Joint velocities, [rad/s], or accelerations, [rad/s^2], shape (n,)."""
    damped: NDArray[np.bool_]
    """Whether the result is damped because of a singularity, shape ()."""
    missed: Array
    """Missing part of the desired motion, base axes, shape (6,), linear part first: desired minus J @ rates."""

    def __repr__(self) -> str:
        if self.rates.ndim > 1:
            return f"<JointRates of {len(self.rates)} rows, {int(self.damped.sum())} damped: .rates, .damped, .missed>"
        rates = " ".join(f"{x:.4g}" for x in self.rates.tolist())
        note = f"damped, misses {float(np.abs(self.missed).max()):.3g}" if self.damped else "exact"
        return f"<JointRates {rates}, {note}>"


def least_norm(J: Array, desired: Array, weights: Array) -> JointRates:
    """Returns the joint rates of least weighted norm, sum(weights * rates^2), with J @ rates = desired.

    From the singular values s of J W^(-1/2) (Siciliano et al., Robotics, 2009, section 3.5). A direction whose s is
    below `NEAR_SINGULAR` gets s / NEAR_SINGULAR^2 in place of 1 / s: damped least squares with the damping chosen
    for each direction (section 3.5.2), so that rates are bounded and all other directions are exact.

    Args:
        J: Jacobians, shape (..., 6, n).
        desired: Motions of the frame, shape (..., 6).
        weights: Costs of the joints' motions, shape (n,), positive; only their ratios matter.
    """
    scale = np.sqrt(weights.mean() / weights)
    U, s, Vt = np.linalg.svd(J * scale, full_matrices=False)
    gain = s / np.square(np.maximum(s, NEAR_SINGULAR))
    components = np.einsum("...ij,...i->...j", U, desired)
    rates = scale * np.einsum("...ji,...j->...i", Vt, gain * components)
    missed = desired - np.einsum("...ij,...j->...i", J, rates)
    return JointRates(rates=rates, damped=np.asarray(s[..., -1] < NEAR_SINGULAR), missed=missed)
