"""Selection of an arm's solver by its Denavit-Hartenberg table."""

from __future__ import annotations

from functools import lru_cache

from rcilab.core.errors import ModelError
from rcilab.model.kinematics.solvers.calibrated import CalibratedSolver
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver
from rcilab.model.kinematics.solvers.offset6.arm import build_offset_six
from rcilab.model.kinematics.solvers.offset6.solver import OffsetSix
from rcilab.model.kinematics.solvers.offset7.arm import build_offset_geometry
from rcilab.model.kinematics.solvers.offset7.solver import OffsetSeven
from rcilab.model.kinematics.solvers.parallel6 import ParallelSix, build_parallel_six
from rcilab.model.kinematics.solvers.planar5 import PlanarFive, build_planar_five
from rcilab.model.kinematics.solvers.solver import KinematicsSolver
from rcilab.model.kinematics.solvers.spherical.inverse import build_geometry
from rcilab.model.kinematics.solvers.spherical6 import SphericalSix
from rcilab.model.kinematics.solvers.spherical7 import SphericalSeven
from rcilab.robots.description import RobotDescription


@lru_cache(maxsize=16)
def build_solver(description: RobotDescription) -> KinematicsSolver:
    """Returns the closed-form solver for the geometry of an arm, or the numeric one if no closed form applies.

    A calibrated arm is solved by iteration around the solver of its table.

    Raises:
        ModelError: The arm has more than 7 joints.
    """
    if description.nominal is not None:
        return CalibratedSolver(build_solver(description.nominal), description.nominal.dh, description.dh)
    try:
        geometry = build_geometry(description)
        return SphericalSeven(geometry) if geometry.n == 7 else SphericalSix(geometry)
    except ModelError:
        pass
    try:
        return OffsetSix(description, build_offset_six(description))
    except ModelError:
        pass
    try:
        return ParallelSix(description, build_parallel_six(description))
    except ModelError:
        pass
    try:
        return PlanarFive(description, build_planar_five(description))
    except ModelError:
        pass
    try:
        return OffsetSeven(build_offset_geometry(description))
    except ModelError:
        return NumericSolver(description)
