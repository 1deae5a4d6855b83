"""Whom we compare with: solvers of the inverse, each behind the same two arguments, and packages that are missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcilab.core.arrays import Array, JointVector
from rcilab.diagnostics.bench.measure import Absent

Solve: TypeAlias = Callable[[Array, JointVector], Sequence[JointVector] | Array]
"""From a pose of the flange in base, (4, 4), and joint angles to start from, (n,), [rad], to the answers."""

_REQUIREMENTS = {
    "ssik": "'ssik[urdf]'",
    "urchin": "'ssik[urdf]'",
    "pink": "pin-pink daqp",
    "daqp": "pin-pink daqp",
    "toppra": "toppra",
}
"""What to ask pip for, by the packages that are imported here and that rcilab does not need for itself."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """One package's inverse kinematics of one arm."""

    solve: Solve
    about: str
    """Its package, the version, and how it was called."""


def absent(name: str, error: ModuleNotFoundError) -> Absent:
    """Returns the row of a peer that could not be imported.

    Args:
        name: Of the row.
        error: What the import raised; raised again when it is about no package of a peer.
    """
    requirement = _REQUIREMENTS.get((error.name or "").partition(".")[0])
    if requirement is None:
        raise error
    note = f"not installed: pip install {requirement}; or everything that is compared: pip install -e '.[compare]'"
    return Absent(name=name, note=note)
