"""Check of commanded tool poses, cycle by cycle, in plain floats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import TOOL_CONDITIONS
from rcilab.conformance.divided_differences import difference_times, tool_norms
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box
from rcilab.core.spatial import IDENTITY, Pose, rotation_between

_FULL_TURN = 2.0 * math.pi  # [rad]
Six: TypeAlias = tuple[float, float, float, float, float, float]
Four: TypeAlias = tuple[float, float, float, float]

_ZERO: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_NO_BOX = -1.0  # [m] Excess if there is no box: inside.


class CartesianMonitor:
    """Checks one commanded tool pose per cycle, and the arm angle if one is commanded.

    Owned by the thread that runs the cycle. Twist, acceleration and jerk are backward differences over one cycle in
    base axes; translation and rotation are checked by their norms. Differences of the arm angle are taken in the
    shorter direction, so that passing pi is not a jump. After a gap they are divided differences, as in `JointMonitor`.

    Attributes:
        twist: Velocity of the tool, linear first, 6 floats, [m/s, rad/s].
        acceleration: Its backward difference, 6 floats, [m/s^2, rad/s^2].
        jerk: The acceleration's backward difference, 6 floats, [m/s^3, rad/s^3].
        arm_angle: The arm angle and its first, second and third difference, [rad, rad/s, rad/s^2, rad/s^3]; None if it
            is not commanded.

    Args:
        limits: Bounds of the tool and the arm angle.
        box: The safety box; None, or an inactive box, is no bound; an `EntryBox` for a tool that starts outside. The
            monitor starts at standstill at the base; `reset` sets another state.
        rows: The conditions, in the order of `TOOL_CONDITIONS`; see `JointMonitor`.
    """

    def __init__(
        self, limits: Limits, box: SafetyBox | EntryBox | None = None, rows: Sequence[Condition] = TOOL_CONDITIONS
    ) -> None:
        self._box = box if isinstance(box, EntryBox) else active_box(box)
        self._rows = BoundsTable(rows, limits)
        self.reset(IDENTITY)

    def reset(self, pose: Pose, psi: float | None = None) -> None:
        """Restarts the history at standstill at `pose` and `psi`.

        Args:
            pose: Pose of the tool in base.
            psi: Arm angle, [rad]; None if it is not commanded.
        """
        self._pose = pose
        self._spacing = (1, 1)
        self.twist: Six = _ZERO
        self.acceleration: Six = _ZERO
        self.jerk: Six = _ZERO
        self.arm_angle: Four | None = None if psi is None else (psi, 0.0, 0.0, 0.0)
        self._values: tuple[float, ...] = self._signals(_NO_BOX)

    def step(self, pose: Pose, psi: float | None = None, cycles: int = 1) -> list[LimitViolation]:
        """Checks the commanded pose of this cycle and returns its violations, in the order of the rows.

        NaN violates every condition on it. The history advances in any case; after a violation the caller must
        `reset`.

        Args:
            pose: Pose of the tool in base.
            psi: Arm angle, [rad]; None is not checked, and the history of the next one starts at standstill.
            cycles: Cycles since the last step, 1 or more.
        """
        times = difference_times(cycles, self._spacing)
        h, second, third = times
        self._spacing = (cycles, self._spacing[0])
        rotation, (x, y, z) = pose.parts
        last_rotation, (last_x, last_y, last_z) = self._pose.parts
        wx, wy, wz = rotation_between(last_rotation, rotation)
        twist = ((x - last_x) / h, (y - last_y) / h, (z - last_z) / h, wx / h, wy / h, wz / h)
        acceleration = _difference(twist, self.twist, second)
        self.jerk = _difference(acceleration, self.acceleration, third)
        self._pose, self.twist, self.acceleration = pose, twist, acceleration
        self.arm_angle = _arm_angle_differences(self.arm_angle, psi, times)
        self._values = self._signals(_NO_BOX if self._box is None else self._box.excess(pose.parts[1]))
        return self._rows.evaluate(self._values)

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step."""
        return self._rows.violations(self._values)

    def _signals(self, excess: float) -> tuple[float, ...]:
        """Returns the value of every row; `excess` is the tool's distance outside the box, [m]."""
        angle = self.arm_angle or (0.0, 0.0, 0.0, 0.0)
        return (
            excess,
            *angle,
            *tool_norms(self.twist),
            *tool_norms(self.acceleration),
            *tool_norms(self.jerk),
        )


def _difference(new: Six, old: Six, h: float) -> Six:
    a, b, c, d, e, f = new
    p, q, r, s, t, u = old
    return (a - p) / h, (b - q) / h, (c - r) / h, (d - s) / h, (e - t) / h, (f - u) / h


def _arm_angle_differences(previous: Four | None, psi: float | None, times: tuple[float, float, float]) -> Four | None:
    if psi is None:
        return None
    if previous is None:
        return psi, 0.0, 0.0, 0.0
    step = psi - previous[0]
    if not -math.pi <= step <= math.pi and math.isfinite(step):
        step = math.remainder(step, _FULL_TURN)
    first, second, third = times
    dpsi = step / first
    ddpsi = (dpsi - previous[1]) / second
    return psi, dpsi, ddpsi, (ddpsi - previous[2]) / third
