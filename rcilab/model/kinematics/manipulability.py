"""Measures of the closeness to a singularity, from the singular values of the Jacobian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, Matrix


@dataclass(frozen=True, slots=True)
class Manipulability:
    """Measures of a configuration from the singular values of its Jacobian."""

    manipulability: float
    """sqrt(det(J J^T)): product of the singular values (Yoshikawa 1985); 0 at a singularity."""
    smallest: float
    """Smallest singular value: the tool velocity of unit joint velocity in the worst direction."""
    condition: float
    """Largest over smallest singular value; infinite at a singularity."""


def manipulability_of(J: Matrix) -> Manipulability:
    """Returns the dexterity measures of a Jacobian, shape (6, n), in m and rad."""
    values = np.linalg.svd(J, compute_uv=False)
    smallest, largest = float(values[-1]), float(values[0])
    return Manipulability(float(np.prod(values)), smallest, largest / smallest if smallest > 0.0 else float("inf"))


@dataclass(frozen=True, slots=True, eq=False)
class ManipulabilityPath:
    """The measures of `Manipulability` for N configurations, each of shape (N,)."""

    manipulability: Array
    smallest: Array
    condition: Array

    def __repr__(self) -> str:
        return f"<ManipulabilityPath of {len(self.smallest)} rows: .manipulability, .smallest, .condition>"


def dexterity_path(J: Array) -> ManipulabilityPath:
    """Returns the dexterity measures of many Jacobians, shape (N, 6, n)."""
    values = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    smallest, largest = values[:, -1], values[:, 0]
    with np.errstate(divide="ignore"):
        condition = np.where(smallest > 0.0, largest / smallest, np.inf)
    return ManipulabilityPath(np.prod(values, axis=1), smallest, condition)
