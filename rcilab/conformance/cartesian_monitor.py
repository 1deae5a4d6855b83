"""The conditions on commanded tool poses, cycle by cycle, in plain floats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import TOOL_CONDITIONS
from rcilab.conformance.divided_differences import spans
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box
from rcilab.core.spatial import IDENTITY, Pose, rotation_between

_TURN = 2.0 * math.pi  # [rad]
Six: TypeAlias = tuple[float, float, float, float, float, float]
Four: TypeAlias = tuple[float, float, float, float]

_REST: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_NO_BOX = -1.0  # [m] Inside, when there is no box to be outside of.


class CartesianMonitor:
    """Checks one commanded tool pose a cycle, and the arm angle when one is commanded.

    Owned by the thread that runs the cycle. Twist, acceleration and jerk are backward differences over one cycle in
    base axes; translation and rotation are checked by their norms. An arm angle's differences are taken the short way
    round, so that passing pi is not a jump. Behind a gap they are divided differences, as those of `JointMonitor`.

    Attributes:
        twist: Velocity of the tool, linear first, 6 floats, [m/s, rad/s].
        acceleration: Its backward difference, 6 floats, [m/s^2, rad/s^2].
        jerk: The acceleration's backward difference, 6 floats, [m/s^3, rad/s^3].
        arm_angle: The arm angle and its first, second and third difference, [rad, rad/s, rad/s^2, rad/s^3]; None while
            it is not commanded.

    Args:
        limits: Bounds of the tool and the arm angle.
        box: Where the tool shall stay; None, or one that is not active, bounds nothing; an `EntryBox` for a tool
            that starts outside. The monitor starts at standstill at the base; `reset` moves it.
        rows: The conditions, in the order of `TOOL_CONDITIONS`; see `JointMonitor`.
    """

    def __init__(
        self, limits: Limits, box: SafetyBox | EntryBox | None = None, rows: Sequence[Condition] = TOOL_CONDITIONS
    ) -> None:
        self._box = box if isinstance(box, EntryBox) else active_box(box)
        self._rows = BoundsTable(rows, limits)
        self.reset(IDENTITY)

    def reset(self, pose: Pose, psi: float | None = None) -> None:
        """Restarts the history: the tool stands at `pose`, the elbow at `psi`.

        Args:
            pose: Pose of the tool in the base.
            psi: Arm angle, [rad]; None while it is not commanded.
        """
        self._pose = pose
        self._spacing = (1, 1)
        self.twist: Six = _REST
        self.acceleration: Six = _REST
        self.jerk: Six = _REST
        self.arm_angle: Four | None = None if psi is None else (psi, 0.0, 0.0, 0.0)
        self._values: tuple[float, ...] = self._signals(_NO_BOX)

    def step(self, pose: Pose, psi: float | None = None, cycles: int = 1) -> list[LimitViolation]:
        """Takes the commanded pose of this cycle and returns what it breaks, in the order of the rows.

        A value that is not a number breaks every condition on it. The history advances in any case; after a violation
        the caller has to `reset`.

        Args:
            pose: Pose of the tool in the base.
            psi: Arm angle, [rad]; None is not checked, and the next one counts as at standstill.
            cycles: Cycles since the last step, 1 or more.
        """
        times = spans(cycles, self._spacing)
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

    def broken(self) -> list[LimitViolation]:
        """Returns what the last step broke."""
        return self._rows.broken(self._values)

    def _signals(self, outside: float) -> tuple[float, ...]:
        """Returns the value of every row; `outside` is how far the tool is outside the box, [m]."""
        angle = self.arm_angle or (0.0, 0.0, 0.0, 0.0)
        return (
            outside,
            *angle,
            *_norms(self.twist),
            *_norms(self.acceleration),
            *_norms(self.jerk),
        )


def _difference(new: Six, old: Six, h: float) -> Six:
    a, b, c, d, e, f = new
    p, q, r, s, t, u = old
    return (a - p) / h, (b - q) / h, (c - r) / h, (d - s) / h, (e - t) / h, (f - u) / h


def _norms(values: Six) -> tuple[float, float]:
    a, b, c, d, e, f = values
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)


def _arm_angle_differences(last: Four | None, psi: float | None, times: tuple[float, float, float]) -> Four | None:
    if psi is None:
        return None
    if last is None:
        return psi, 0.0, 0.0, 0.0
    step = psi - last[0]
    if not -math.pi <= step <= math.pi and math.isfinite(step):
        step = math.remainder(step, _TURN)
    first, second, third = times
    dpsi = step / first
    ddpsi = (dpsi - last[1]) / second
    return psi, dpsi, ddpsi, (ddpsi - last[2]) / third
