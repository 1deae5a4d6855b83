"""The configuration of an arm: its joint angles and the settings of its teach pendant, as at power-up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, tau

import numpy as np

from rcilab.core.arrays import as_vector
from rcilab.core.clearance import ClearanceLimit, LinkPair
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel
from rcilab.sim.arm_parameters import ArmParameters, Floats
from rcilab.sim.plant import Plant

JOINT_ANGLES = "joint angles"
"""Name of `ArmSetup.q` in errors."""
_CONTACT = ClearanceLimit(floor_height=None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmSetup:
    """What is set up outside of any client, and survives a reboot; None leaves a part as it is."""

    q: Floats | None = None
    """Joint angles of the stationary arm, shape (n,), [rad]."""
    T_flange_tool: Pose | None = None
    load: Payload | None = None
    safety_box: SafetyBox | None = None
    soft_limits: tuple[Floats, Floats] | None = None
    """Lower and upper bounds of the joints, shape (n,) each, [rad]."""

    @property
    def is_empty(self) -> bool:
        """Whether it sets nothing."""
        parts = (self.q, self.T_flange_tool, self.load, self.safety_box, self.soft_limits)
        return all(part is None for part in parts)


def require_stand(model: RobotModel, q: Sequence[float], parameters: ArmParameters, plant: Plant) -> None:
    """Requires joint angles at which an arm can stand.

    Args:
        model: The arm with its tool.
        q: Joint angles, shape (n,), [rad].
        parameters: With soft limits and safety box.
        plant: With obstacles.

    Raises:
        InvalidValueError: Not n finite numbers; a joint is outside its range; links overlap each other or an obstacle
            of the plant; or the tool is below the lower face of the active safety box.
    """
    angles = as_vector(q, model.n, JOINT_ANGLES, "rad")
    shown = [round(angle, 2) for angle in np.degrees(angles).tolist()]
    bounds = zip(angles.tolist(), parameters.joint_lower, parameters.joint_upper, strict=True)
    for number, (angle, lower, upper) in enumerate(bounds, 1):
        if not lower <= angle <= upper:
            span = f"{degrees(lower):.6g} to {degrees(upper):.6g} deg"
            advice = "; angles without a unit are in rad" if np.abs(angles).max() > tau else ""
            problem = f"deg: joint {number} at {degrees(angle):.6g} deg is outside its range of {span}{advice}"
            raise InvalidValueError(JOINT_ANGLES, shown, problem)
    clearance = model.clearance(angles, _CONTACT)
    if clearance.distance <= 0.0:
        pair, depth = LinkPair(*clearance.links.tolist()), -1e3 * float(clearance.distance)
        raise InvalidValueError(JOINT_ANGLES, shown, f"deg: {pair} overlap by {depth:.3g} mm; they must not touch")
    overlap = plant.find_overlap(angles)
    if overlap is not None:
        raise InvalidValueError(JOINT_ANGLES, shown, f"deg: {overlap}; remove it or choose other angles")
    box = parameters.safety_box
    if box is not None and box.active:
        tool = box.T_base_box.inverse() @ Pose(model.forward(angles).position)
        depth = -float(tool.position[2]) - 0.5 * box.size[2]
        if depth > 0.0:
            problem = f"deg: the tool is {1e3 * depth:.0f} mm below the floor of the safety box; it must be above"
            raise InvalidValueError(JOINT_ANGLES, shown, problem)
