"""The axes of the force-control frame: of reported external forces, and of the springs of Cartesian impedance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose, Rotation9, rotation_between, rotation_from_wxyz
from rcilab.model.robot_model import RobotModel
from rcilab.sim.arm_parameters import ArmParameters, ForceAxesKind

_TURN_STEP = 2.0 * math.pi * CYCLE_TIME  # [rad] in a cycle: half a turn takes 0.5 s, as long as the largest wrench does
# to be reached; a path at 1 m/s is followed without delay round any arc wider than 16 cm. A tuning value.
_STANDING = 1e-6  # [m/s] Below this the tool has no direction of its path.
_ORIGIN = (0.0, 0.0, 0.0)
_ALONG = 0.999  # Cosine of an angle above which two directions count as parallel.


class PosedTool(Protocol):
    """A tool that computes its pose on demand, as most cycles do not need it."""

    @property
    def pose(self) -> Pose:
        """Pose in base."""
        ...


class ForceAxes:
    """Follows the axes of the force-control frame. Owned by one reader, which calls `follow` once a cycle.

    WORLD: those of the base. TOOL: those of the frame itself. PATH: x along the commanded velocity of the tool (where
    it stands still, its last direction), z as near to the frame's z as that allows. Where a path begins, reverses or
    has a corner, its axes turn there by `_TURN_STEP` a cycle: a force or a soft direction that went round in one cycle
    would throw the arm.

    Attributes:
        T_tool_force: The force-control frame in the tool's.
        is_settled: Whether the axes are where the path has them.

    Args:
        model: The arm with its tool.
        parameters: What the client has configured.
    """

    def __init__(self, model: RobotModel, parameters: ArmParameters) -> None:
        self._path = (0.0, 0.0, 0.0)
        self.configure(model, parameters)

    def configure(self, model: RobotModel, parameters: ArmParameters) -> None:
        """Takes another tool or force-control frame; the direction of the path stays."""
        self.T_tool_force = model.T_flange_tool.inverse() @ parameters.T_flange_force
        self._kind = parameters.force_axes
        self.begin()

    def begin(self) -> None:
        """Lets the axes be where the path has them from the next cycle on: nothing acts along them yet."""
        self._axes: Rotation9 | None = None
        self.is_settled = True

    @property
    def is_world(self) -> bool:
        """Whether the axes are those of the base."""
        return self._kind is ForceAxesKind.WORLD

    def follow(self, velocity: Sequence[float], tool: PosedTool) -> None:
        """Takes how the tool's origin is commanded to move in this cycle, base axes, [m/s], and where the tool is."""
        speed = math.hypot(*velocity)
        if speed > _STANDING:
            x, y, z = velocity
            self._path = (x / speed, y / speed, z / speed)
        if self._kind is ForceAxesKind.PATH:
            wanted = _path_axes(self._path, self._frame(tool.pose))
            self._axes, self.is_settled = (wanted, True) if self._axes is None else _approach(self._axes, wanted)

    def rotation(self, T_base_tool: Pose) -> Rotation9:
        """Returns the axes in base, as the columns of a rotation; the base's own need not be asked for."""
        if self._kind is ForceAxesKind.PATH and self._axes is not None:
            return self._axes
        return self._frame(T_base_tool)

    def _frame(self, T_base_tool: Pose) -> Rotation9:
        return (T_base_tool @ self.T_tool_force).parts[0]


def _approach(now: Rotation9, wanted: Rotation9) -> tuple[Rotation9, bool]:
    """Returns axes a cycle later on their way to those that are wanted, and whether they have arrived."""
    x, y, z = rotation_between(now, wanted)
    angle = math.hypot(x, y, z)
    if angle <= _TURN_STEP:
        return wanted, True
    scale = math.sin(_TURN_STEP / 2.0) / angle
    step = Pose.from_parts(rotation_from_wxyz((math.cos(_TURN_STEP / 2.0), scale * x, scale * y, scale * z)), _ORIGIN)
    return (step @ Pose.from_parts(now, _ORIGIN)).parts[0], False


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
