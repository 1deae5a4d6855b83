"""Solvers that know every branch of an arm in closed form: ours, and the ones that ssik writes for a URDF."""

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
"""Arm angles all round at which branches are asked for: as many as ssik samples of its own accord."""
_PSI = np.arange(ARM_ANGLES) * (tau / ARM_ANGLES)


def ours(model: RobotModel) -> Solver:
    """Returns our own inverse, asked for the branch next to where the arm is."""

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [model.inverse(Pose.from_matrix(T), near=near).nearest(near)]

    return Solver(solve=solve, about="rcilab, inverse(T, near=q).nearest(q)")


def ours_all_round(model: RobotModel) -> Solver:
    """Returns our own inverse, asked for every branch inside the limits at `ARM_ANGLES` arm angles."""

    def solve(T: Array, near: JointVector) -> Array:
        found = model.inverse_batch(np.broadcast_to(T, (ARM_ANGLES, 4, 4)), _PSI)
        return found.q[found.inside]

    return Solver(solve=solve, about=f"rcilab, inverse_batch of one pose at {ARM_ANGLES} arm angles")


def ssik(model: RobotModel) -> Solver:
    """Returns ssik's inverse, asked for the branch next to where the arm is.

    Raises:
        ModuleNotFoundError: ssik is not installed, or not what it reads URDFs with.
    """
    module = _ssik_module(build_urdf(model.description))

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [found.q for found in module.solve(T, max_solutions=1, q_seed=near)]

    return Solver(solve=solve, about=f"{_ssik_version()}, solve(T, max_solutions=1, q_seed=q)")


def ssik_all_round(model: RobotModel) -> Solver:
    """Returns ssik's inverse, asked for all that it finds inside the limits, full turns counted once.

    Raises:
        ModuleNotFoundError: ssik is not installed, or not what it reads URDFs with.
    """
    module = _ssik_module(build_urdf(model.description))

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        return [found.q for found in module.solve(T, enumerate_windings=False)]

    return Solver(solve=solve, about=f"{_ssik_version()}, solve(T, enumerate_windings=False)")


def _ssik_version() -> str:
    return f"ssik {version('ssik')} (C++), built from our URDF"


@lru_cache(maxsize=1)
def _ssik_module(urdf: str) -> ModuleType:
    """Returns the module that `ssik build` writes for an arm: the way its authors recommend for use."""
    import urchin  # noqa: F401  # pyright: ignore[reportMissingImports]  # ssik reads URDFs with it.
    from ssik.cli import main  # pyright: ignore[reportMissingImports]

    with TemporaryDirectory() as directory:
        path, written = Path(directory) / "arm.urdf", Path(directory) / "arm_ik.py"
        path.write_text(urdf, encoding="utf-8")
        arguments = ["build", str(path), "--base", "base", "--ee", "flange", "--out", str(written), "--no-validate"]
        with redirect_stderr(StringIO()) as output:  # It reports every step.
            failed = main(arguments)
        if failed:
            raise RuntimeError(f"ssik built no solver from our URDF: {output.getvalue()}")
        spec = spec_from_file_location("arm_ik", written)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    return module
