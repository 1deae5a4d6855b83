"""How close a configuration is to losing a direction of motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.arrays import Matrix


@dataclass(frozen=True, slots=True)
class Dexterity:
    """What the singular values of the Jacobian say about a configuration."""

    manipulability: float
    """sqrt(det(J J^T)): product of the singular values (Yoshikawa 1985); 0 at a singularity."""
    smallest: float
    """Smallest singular value: the tool velocity that unit joint velocity gives in the worst direction."""
    condition: float
    """Largest over smallest singular value; infinite at a singularity."""


def dexterity(J: Matrix) -> Dexterity:
    """Returns the dexterity measures of a Jacobian, shape (6, n), metres and radians taken as they are."""
    values = np.linalg.svd(J, compute_uv=False)
    smallest, largest = float(values[-1]), float(values[0])
    return Dexterity(float(np.prod(values)), smallest, largest / smallest if smallest > 0.0 else float("inf"))
