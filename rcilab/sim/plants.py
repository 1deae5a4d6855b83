"""The plants by name."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from rcilab.cell.cell import Cell
from rcilab.core.errors import UsageError
from rcilab.model.robot_model import RobotModel
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.plant import Plant

Realism: TypeAlias = Literal["off", "real"]
"""Whether joints have the friction and torque sensors of real ones."""
REALISMS: tuple[Realism, ...] = get_args(Realism)


def build_plant(kind: str, model: RobotModel, realism: Realism = "off", cell: Cell | None = None) -> Plant:
    """Returns the plant of a kind: "mujoco" or "ideal".

    Args:
        kind: Its name.
        model: The arm.
        realism: "real" for the friction and torque sensors of real joints; of "mujoco" alone.
        cell: The cell of the arm, which "mujoco" makes solid; None without one.

    Raises:
        UsageError: There are no figures of real joints of this arm.
    """
    if kind == "mujoco":
        from rcilab.sim.mujoco_plant import MuJoCoPlant

        imperfections = model.description.imperfections if realism == "real" else None
        if realism == "real" and imperfections is None:
            raise UsageError(f"realism: nothing is known of friction and torque sensors of an {model.name}; use off")
        return MuJoCoPlant(model, imperfections=imperfections, cell=cell)
    return IdealPlant(model)
