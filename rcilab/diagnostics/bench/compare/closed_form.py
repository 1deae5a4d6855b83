"""Closed-form solvers: the inverse kinematics of rcilab, and the solvers that ssik generates from a URDF."""

from __future__ import annotations

from contextlib import redirect_stderr
from functools import lru_cache
from importlib.metadata import version
from importlib.util import module_from_spec, spec_from_file_location
from io import StringIO
from math import tau
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.compare.peer import Solver
from rcilab.model.robot_model import RobotModel
from rcilab.robots.urdf import build_urdf

ARM_ANGLES = 16
"""Number of equally spaced arm angles, the same as ssik samples by default."""
_PSI = np.arange(ARM_ANGLES) * (tau / ARM_ANGLES)


def rcilab_nearest(model: RobotModel) -> Solver:
    """Returns the solver of rcilab for the branch nearest to the arm's position."""

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [model.inverse(Pose.from_matrix(T), near=near).nearest(near)]

    return Solver(solve=solve, about="rcilab, inverse(T, near=q).nearest(q)")


def rcilab_branches(model: RobotModel) -> Solver:
    """Returns the solver of rcilab for all branches inside the limits at `ARM_ANGLES` arm angles."""

    def solve(T: Array, near: JointVector) -> Array:
        found = model.inverse_batch(np.broadcast_to(T, (ARM_ANGLES, 4, 4)), _PSI)
        return found.q[found.inside]

    return Solver(solve=solve, about=f"rcilab, inverse_batch of one pose at {ARM_ANGLES} arm angles")


def ssik_nearest(model: RobotModel) -> Solver:
    """Returns the solver of ssik for the branch nearest to the arm's position.

    Raises:
        ModuleNotFoundError: ssik, or its library for URDFs, is not installed.
    """
    module = _ssik_module(build_urdf(model.description))

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [found.q for found in module.solve(T, max_solutions=1, q_seed=near)]

    return Solver(solve=solve, about=f"{_ssik_version()}, solve(T, max_solutions=1, q_seed=q)")


def ssik_branches(model: RobotModel) -> Solver:
    """Returns the solver of ssik for all solutions inside the limits, without additional full turns.

    Raises:
        ModuleNotFoundError: ssik, or its library for URDFs, is not installed.
    """
    module = _ssik_module(build_urdf(model.description))

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [found.q for found in module.solve(T, enumerate_windings=False)]

    return Solver(solve=solve, about=f"{_ssik_version()}, solve(T, enumerate_windings=False)")


def _ssik_version() -> str:
    return f"ssik {version('ssik')} (C++), built from the URDF of rcilab"


@lru_cache(maxsize=1)
def _ssik_module(urdf: str) -> ModuleType:
    """Returns the module that `ssik build` generates for an arm, as its authors recommend."""
    import urchin  # noqa: F401  # pyright: ignore[reportMissingImports]  # ssik needs it to read URDFs.
    from ssik.cli import main  # pyright: ignore[reportMissingImports]

    with TemporaryDirectory() as directory:
        path, written = Path(directory) / "arm.urdf", Path(directory) / "arm_ik.py"
        path.write_text(urdf, encoding="utf-8")
        arguments = ["build", str(path), "--base", "base", "--ee", "flange", "--out", str(written), "--no-validate"]
        with redirect_stderr(StringIO()) as output:  # It prints every step.
            failed = main(arguments)
        if failed:
            raise RuntimeError(f"ssik built no solver from the URDF of rcilab: {output.getvalue()}")
        spec = spec_from_file_location("arm_ik", written)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    return module
