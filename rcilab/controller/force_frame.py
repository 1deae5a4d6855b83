"""The axes of setFcCoor: in which outside forces are reported, and in which Cartesian impedance yields and presses."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rcilab.controller.settings import Settings
from rcilab.model import RobotModel
from rcilab.protocols.rci import ForceFrame
from rcilab.spatial import Pose, Rotation9

_STANDING = 1e-6  # [m/s] Below this the tool has no direction of its path.
_ALONG = 0.999  # Cosine of an angle above which two directions count as parallel.


class ForceAxes:
    """Follows the axes of the force-control frame. Owned by one reader, which passes the velocity once a cycle.

    WORLD: those of the base. TOOL: those of the frame itself. PATH: x along the commanded velocity of the tool (where
    it stands still, its last direction), z as near to the frame's z as that allows.

    Attributes:
        T_tool_force: The force-control frame in the tool's.

    Args:
        model: The arm with its tool.
        settings: What the client has set.
    """

    def __init__(self, model: RobotModel, settings: Settings) -> None:
        self._path = (0.0, 0.0, 0.0)
        self.configure(model, settings)

    def configure(self, model: RobotModel, settings: Settings) -> None:
        """Takes another tool or force-control frame; the direction of the path stays."""
        self.T_tool_force = model.T_flange_tool.inverse() @ settings.T_flange_force
        self._kind = settings.force_frame

    @property
    def is_world(self) -> bool:
        """Whether the axes are those of the base."""
        return self._kind is ForceFrame.WORLD

    def follow(self, velocity: Sequence[float]) -> None:
        """Takes the commanded velocity of the tool's origin in this cycle, base axes, [m/s]."""
        speed = math.hypot(*velocity)
        if speed > _STANDING:
            x, y, z = velocity
            self._path = (x / speed, y / speed, z / speed)

    def rotation(self, T_base_tool: Pose) -> Rotation9:
        """Returns the axes in base, as the columns of a rotation; the base's own need not be asked for."""
        r = (T_base_tool @ self.T_tool_force).parts[0]
        return _path_axes(self._path, r) if self._kind is ForceFrame.PATH else r


def _path_axes(x: tuple[float, float, float], r: Rotation9) -> Rotation9:
    """Returns axes with x along a path and z as near as possible to the force frame's z, or its y if that is along x.

    Before the first motion there is no path, and the axes are those of the force frame.
    """
    ax, ay, az = x
    if not any(x):
        return r
    near = (r[2], r[5], r[8])
    if abs(near[0] * ax + near[1] * ay + near[2] * az) > _ALONG:
        near = (r[1], r[4], r[7])
    along = near[0] * ax + near[1] * ay + near[2] * az
    cx, cy, cz = near[0] - along * ax, near[1] - along * ay, near[2] - along * az
    length = math.hypot(cx, cy, cz)
    cx, cy, cz = cx / length, cy / length, cz / length
    return (
        ax, cy * az - cz * ay, cx,
        ay, cz * ax - cx * az, cy,
        az, cx * ay - cy * ax, cz,
    )  # fmt: skip
