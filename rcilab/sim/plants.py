"""The plants by name."""

from __future__ import annotations

from rcilab.model.robot_model import RobotModel
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.plant import Plant


def build_plant(kind: str, model: RobotModel) -> Plant:
    """Returns the plant of a kind: "mujoco" or "ideal"."""
    if kind == "mujoco":
        from rcilab.sim.mujoco_plant import MuJoCoPlant

        return MuJoCoPlant(model)
    return IdealPlant(model)
