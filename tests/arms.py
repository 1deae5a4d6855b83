"""Groups of arms for tests over all of them."""

from __future__ import annotations

from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver
from rcilab.robots import ROBOT_NAMES, ROBOTS_BY_MAKER, describe_robot

ANY_POSE = tuple(name for name in ROBOT_NAMES if describe_robot(name).n >= 6)
"""The arms whose tool can have any pose in reach; one with 5 axes turns its tool only in the plane of the arm."""
CLOSED_FORM = tuple(name for name in ANY_POSE if not isinstance(build_solver(describe_robot(name)), NumericSolver))
"""Those of them that are solved in closed form: the others are not followed exactly at the limit of reach."""
REPRESENTATIVE = (*ROBOTS_BY_MAKER["rokae"], *ROBOTS_BY_MAKER["franka"], "xArm6", "RM65")
"""Arms that stand for all where a test takes long: those commanded every millisecond, and one of each other maker."""
