"""The axes of the force-control frame: of reported external forces, and of the springs of Cartesian impedance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose, Rotation9, rotation_between, rotation_from_wxyz
from rcilab.model.robot_model import RobotModel
from rcilab.sim.arm_parameters import ArmParameters, ForceAxesKind

_TURN_STEP = (
    2.0 * math.pi * CYCLE_TIME
)  # [rad] Per cycle: half a turn takes 0.5 s, like the ramp to the largest wrench;
# a path at 1 m/s is followed without delay on arcs with a radius above 16 cm. A tuning value.
_STANDSTILL = 1e-6  # [m/s] Below this the path of the tool has no direction.
_ORIGIN = (0.0, 0.0, 0.0)
_ALONG = 0.999  # Cosine of an angle above which two directions count as parallel.


class PosedTool(Protocol):
    """A tool that computes its pose on demand: most cycles do not need it."""

    @property
    def pose(self) -> Pose:
        """Pose in base."""
        ...


class ForceAxes:
    """Computes the axes of the force-control frame. Owned by one reader, which calls `follow` once per cycle.

    WORLD: the axes of the base. TOOL: the axes of the frame itself. PATH: x along the commanded velocity of the tool,
    or at standstill its last direction, z as close as possible to the frame's z. Where a path begins, reverses or has a
    corner, its axes rotate by `_TURN_STEP` per cycle: a sudden rotation of a force or a soft direction would accelerate
    the arm.

    Attributes:
        T_tool_force: The force-control frame in the tool's.
        is_settled: Whether the axes have reached those of the path.

    Args:
        model: The arm with its tool.
        parameters: The configuration from the client.
    """

    def __init__(self, model: RobotModel, parameters: ArmParameters) -> None:
        self._path = (0.0, 0.0, 0.0)
        self.configure(model, parameters)

    def configure(self, model: RobotModel, parameters: ArmParameters) -> None:
        """Sets another tool or force-control frame; the direction of the path is kept."""
        self.T_tool_force = model.T_flange_tool.inverse() @ parameters.T_flange_force
        self._kind = parameters.force_axes
        self.begin()

    def begin(self) -> None:
        """Resets the axes to those of the path in the next cycle: nothing acts along them yet."""
        self._axes: Rotation9 | None = None
        self.is_settled = True

    @property
    def is_world(self) -> bool:
        """Whether the axes are those of the base."""
        return self._kind is ForceAxesKind.WORLD

    def follow(self, velocity: Sequence[float], tool: PosedTool) -> None:
        """Updates the axes from the commanded velocity of the tool, base axes, [m/s], and its pose."""
        speed = math.hypot(*velocity)
        if speed > _STANDSTILL:
            x, y, z = velocity
            self._path = (x / speed, y / speed, z / speed)
        if self._kind is ForceAxesKind.PATH:
            requested = _path_axes(self._path, self._frame(tool.pose))
            self._axes, self.is_settled = (requested, True) if self._axes is None else _approach(self._axes, requested)

    def rotation(self, T_base_tool: Pose) -> Rotation9:
        """Returns the axes in base, as the columns of a rotation; not needed for WORLD."""
        if self._kind is ForceAxesKind.PATH and self._axes is not None:
            return self._axes
        return self._frame(T_base_tool)

    def _frame(self, T_base_tool: Pose) -> Rotation9:
        return (T_base_tool @ self.T_tool_force).parts[0]


def _approach(now: Rotation9, requested: Rotation9) -> tuple[Rotation9, bool]:
    """Returns the axes one cycle closer to the requested ones, and whether they have reached them."""
    x, y, z = rotation_between(now, requested)
    angle = math.hypot(x, y, z)
    if angle <= _TURN_STEP:
        return requested, True
    scale = math.sin(_TURN_STEP / 2.0) / angle
    step = Pose.from_parts(rotation_from_wxyz((math.cos(_TURN_STEP / 2.0), scale * x, scale * y, scale * z)), _ORIGIN)
    return (step @ Pose.from_parts(now, _ORIGIN)).parts[0], False


def _path_axes(x: tuple[float, float, float], r: Rotation9) -> Rotation9:
    """Returns axes with x along a path and z as near as possible to the force frame's z, or its y if that is along x.

    Before the first motion the axes are those of the force frame.
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
