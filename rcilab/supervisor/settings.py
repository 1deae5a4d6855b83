"""What the control process is told at its start, through JSON and back."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.client.identify import dh_lengths
from rcilab.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.spatial import IDENTITY, Pose

if TYPE_CHECKING:
    from rcilab.model import RobotModel


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
    sends_tool: bool
    """Whether to tell the controller of the tool."""
    load: tuple[float, list[float], list[list[float]]] | None
    """Mass [kg], centre [m] and inertia [kg m^2], to be sent to the controller; None to send none."""


def build_settings(model: RobotModel, *, is_virtual: bool) -> dict[str, Any]:
    """Returns what to write into the block.

    Args:
        model: The arm.
        is_virtual: Whether the controller is ours: then it is told of tool and load. A real one has its own settings.
    """
    limits = model.limits
    has_tool = is_virtual and not model.T_flange_tool.is_close(IDENTITY, 0.0)
    has_load = is_virtual and model.load.mass > 0.0
    load = model.load
    return {
        "name": model.name,
        "lengths": [list(row) for row in dh_lengths(model.description.dh)],
        "n": model.n,
        "joint": {name: getattr(limits.joint, name).tolist() for name in JointLimits.__slots__},
        "cartesian": asdict(limits.cartesian),
        "arm_angle": asdict(limits.arm_angle) if limits.arm_angle else None,
        "tool": model.T_flange_tool.as_row_major(),
        "sends_tool": has_tool,
        "load": [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()] if has_load else None,
    }


def parse_settings(settings: dict[str, Any]) -> WorkerSettings:
    """Returns what `build_settings` wrote."""
    arm_angle, load = settings["arm_angle"], settings["load"]
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
        sends_tool=settings["sends_tool"],
        load=None if load is None else (load[0], load[1], load[2]),
    )
