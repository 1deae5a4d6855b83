"""What the control process is told at its start, through JSON and back."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.core.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.driver.identify import dh_lengths

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerSettings:
    """The arm as far as the control process needs it."""

    name: str
    """Name of the arm, to compare with the controller's."""
    lengths: list[list[float]]
    """Its Denavit-Hartenberg a and d, one row a joint, [m]; also to compare."""
    n: int
    limits: Limits
    T_flange_tool: Pose


def build_settings(model: RobotModel) -> dict[str, Any]:
    """Returns what to write into the block.

    Args:
        model: The arm.
    """
    limits = model.limits
    return {
        "name": model.name,
        "lengths": [list(row) for row in dh_lengths(model.description.dh)],
        "n": model.n,
        "joint": {name: getattr(limits.joint, name).tolist() for name in JointLimits.__slots__},
        "cartesian": asdict(limits.cartesian),
        "arm_angle": asdict(limits.arm_angle) if limits.arm_angle else None,
        "tool": model.T_flange_tool.as_row_major(),
    }


def parse_settings(settings: dict[str, Any]) -> WorkerSettings:
    """Returns what `build_settings` wrote."""
    arm_angle = settings["arm_angle"]
    return WorkerSettings(
        name=settings["name"],
        lengths=settings["lengths"],
        n=settings["n"],
        limits=Limits(
            joint=JointLimits(**{name: np.array(values) for name, values in settings["joint"].items()}),
            cartesian=CartesianLimits(**settings["cartesian"]),
            arm_angle=ArmAngleLimits(**arm_angle) if arm_angle else None,
        ),
        T_flange_tool=Pose.from_row_major(settings["tool"]),
    )
