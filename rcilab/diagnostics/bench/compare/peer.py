"""Other packages in the comparison: a common interface of their solvers, and rows for missing packages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcilab.core.arrays import Array, JointVector
from rcilab.diagnostics.bench.measure import Absent

Solve: TypeAlias = Callable[[Array, JointVector], Sequence[JointVector] | Array]
"""`(T_base_flange, q_start) -> solutions`, shapes (4, 4) and (n,), [rad]."""

_REQUIREMENTS = {
    "ssik": "'ssik[urdf]'",
    "urchin": "'ssik[urdf]'",
    "pink": "pin-pink daqp",
    "daqp": "pin-pink daqp",
    "toppra": "toppra",
}
"""Requirement for pip, by the imported package; rcilab itself does not need these packages."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Solver:
    """One package's inverse kinematics of one arm."""

    solve: Solve
    about: str
    """Package, version and call."""


def absent(name: str, error: ModuleNotFoundError) -> Absent:
    """Returns the row of a package that could not be imported.

    Args:
        name: Name of the row.
        error: Error of the import; raised again if it concerns another package.
    """
    requirement = _REQUIREMENTS.get((error.name or "").partition(".")[0])
    if requirement is None:
        raise error
    note = f"not installed: pip install {requirement}; or all compared packages: pip install -e '.[compare]'"
    return Absent(name=name, note=note)
