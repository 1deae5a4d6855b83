"""The workspace of an arm as random samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector, described, readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.model.kinematics.manipulability import ManipulabilityPath, dexterity_path
from rcilab.model.kinematics.moving_arm import MovingArm

_MAX_SAMPLES = 1_000_000  # They take about 200 MB during computation.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Workspace:
    """N random configurations in the joint ranges, and their tool positions."""

    q: JointPath
    """Joint angles, shape (N, n), [rad]."""
    position: Array
    """Origin of the tool in base, shape (N, 3), [m]."""
    dexterity: ManipulabilityPath
    """Manipulability of the configurations."""

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        if not len(self):
            return "<Workspace of 0 samples>"
        lows, highs = self.position.min(axis=0).tolist(), self.position.max(axis=0).tolist()
        spans = ", ".join(f"{a} {x:.2f} to {y:.2f}" for a, x, y in zip("xyz", lows, highs, strict=True))
        return f"<Workspace of {len(self)} samples, {spans} m: .q, .position, .dexterity>"


def sample_workspace(
    arm: MovingArm, lower: JointVector, upper: JointVector, count: int, seed: int, box: SafetyBox | None
) -> Workspace:
    """Returns samples at joint angles that are uniformly random inside the limits, the same for the same seed.

    Args:
        arm: The arm with its tool.
        lower: Smallest joint angles, shape (n,), [rad].
        upper: Largest joint angles, shape (n,), [rad].
        count: Number of configurations to try.
        seed: Seed of the random numbers.
        box: Only samples with the tool inside are returned; all when absent or not active.

    Raises:
        InvalidValueError: `count` is not from 1 to 1 000 000, `seed` is negative, or the box is not valid.
    """
    if not isinstance(count, int | np.integer) or not 1 <= count <= _MAX_SAMPLES:
        raise InvalidValueError("count", described(count), f"must be a whole number from 1 to {_MAX_SAMPLES}")
    if not isinstance(seed, int | np.integer) or seed < 0:
        raise InvalidValueError("seed", described(seed), "must be a whole number, 0 or more")
    q = np.random.default_rng(seed).uniform(lower, upper, (count, arm.n))
    position = arm.position_path(q)
    if (bound := active_box(box)) is not None:
        inside = bound.excess_path(position) <= 0.0
        q, position = q[inside], position[inside]
    J = arm.jacobian(q) if len(q) else np.empty((0, 6, arm.n))
    return Workspace(q=readonly_copy(q), position=readonly_copy(position), dexterity=dexterity_path(J))
