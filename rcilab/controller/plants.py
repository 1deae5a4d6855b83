"""Which plants there are, by the name they are chosen by."""

from __future__ import annotations

from rcilab.controller.ideal_plant import IdealPlant
from rcilab.controller.plant import Plant
from rcilab.model import RobotModel


def build_plant(kind: str, model: RobotModel) -> Plant:
    """Returns the arm that a controller moves: "mujoco", or the ideal one."""
    if kind == "mujoco":
        from rcilab.controller.mujoco_plant import MuJoCoPlant

        return MuJoCoPlant(model)
    return IdealPlant(model)
