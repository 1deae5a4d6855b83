"""From the commanded pose to joint angles: the branch the arm is on, followed without jumps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import cos, degrees, hypot, pi, remainder, sin, sqrt, tau

from rcilab.errors import SingularError
from rcilab.kinematics.inverse import ArmGeometry, build_geometry, inverse_seven, inverse_six
from rcilab.model import RobotModel
from rcilab.spatial import IDENTITY, Pose

SINGULAR = (
    0.02  # Sine of an angle, or share of the reach: about one degree from a singularity counts as on it; a choice.
)
_STEP = 0.1  # [rad] What no joint passes in a cycle, by far: an arm bent more than that stays bent to the same side.


class Follower:
    """The inverse of one arm with its tool, for poses that follow each other. Owned by a motion generator.

    Joint limits are not its business: it stays on the branch that is nearest to the last angles, and whoever judges
    joint angles says where that leaves the range.

    Args:
        model: The arm with its tool.
    """

    def __init__(self, model: RobotModel) -> None:
        self._geometry = build_geometry(model.description)
        self._T_tool_flange = model.T_flange_tool.inverse()
        self._has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
        self._bends = (1, 3, 5) if model.n == 7 else (2, 4)

    def solve(self, T_base_tool: Pose, psi: float, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of a pose, [rad]: those closest to `near`, full turns counted.

        Args:
            T_base_tool: Pose of the tool in base.
            psi: Arm angle of a 7-axis arm, [rad]; of no meaning for 6 axes.
            near: Last joint angles, n plain floats, [rad].

        Raises:
            UnreachableError: The pose is out of reach, whatever the joint limits are.
            SingularError: The arm is at a singularity there; the message says at which.
        """
        flange = T_base_tool @ self._T_tool_flange if self._has_tool else T_base_tool
        if self._geometry.n == 7:
            branches = inverse_seven(self._geometry, flange, psi, near, self._near_flips(near))
        else:
            branches = inverse_six(self._geometry, flange, near)
        best: list[float] = []
        least = float("inf")
        bends, here_bends = self._bends, [near[i] for i in self._bends]
        for branch in branches:
            # Where the arm bends it cannot turn round and round, so a look there tells most branches off.
            if sum([(branch[i] - here) ** 2 for i, here in zip(bends, here_bends, strict=True)]) >= least:
                continue
            turns = [remainder(angle - here, tau) for angle, here in zip(branch, near, strict=True)]
            distance = sum([turn * turn for turn in turns])
            if distance < least:
                least, best = distance, turns
        q = [here + turn for here, turn in zip(near, best, strict=True)]
        singularity = find_singularity(self._geometry, q)
        if singularity is not None:
            raise SingularError(singularity)
        return q

    def _near_flips(self, near: Sequence[float]) -> list[tuple[float, ...]]:
        """Returns the branches that a step from `near` may end on: those of its own sides, and of both next to zero."""
        offsets = self._geometry.offsets
        sides = [_sides(near[i] - offsets[i]) for i in (1, 3, 5)]
        return list(product(*sides))


def _sides(bend: float) -> tuple[float, ...]:
    if abs(bend) < _STEP:
        return 0.0, pi
    return (pi,) if remainder(bend, tau) < 0.0 else (0.0,)


def find_singularity(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    """Returns which singularity an arm is at, in words, or None where it can move its tool in every direction.

    7 axes lose a direction where sin q4 = 0; sin q2 = cos q3 = 0; cos q5 = sin q6 = 0; or sin q2 = sin q6 = 0. Because
    poses are followed at an arm angle, it counts as well when shoulder and wrist are above each other. 6 axes: sin q3 =
    0, sin q5 = 0, and the wrist on axis 1 (Siciliano et al., Robotics, 2009, section 3.3).

    Args:
        arm: From `rcilab.kinematics.inverse.build_geometry`.
        q: Joint angles, n plain floats, [rad].
    """
    upright = [angle - offset for angle, offset in zip(q, arm.offsets, strict=True)]
    if arm.n == 7:
        return _singular_seven(arm, upright)
    return _singular_six(arm, upright)


def _singular_seven(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    s2, s4, s6 = abs(sin(q[1])), abs(sin(q[3])), abs(sin(q[5]))
    if s4 < SINGULAR:
        return f"the arm is stretched or folded: joint 4 is at {degrees(q[3]):.2f} deg"
    if s2 < SINGULAR and abs(cos(q[2])) < SINGULAR:
        return f"axes 1 and 3 are in line: joints 2 and 3 are at {degrees(q[1]):.2f} and {degrees(q[2]):.2f} deg"
    if s6 < SINGULAR and abs(cos(q[4])) < SINGULAR:
        return f"axes 5 and 7 are in line: joints 5 and 6 are at {degrees(q[4]):.2f} and {degrees(q[5]):.2f} deg"
    if s2 < SINGULAR and s6 < SINGULAR:
        return f"shoulder and wrist are in line: joints 2 and 6 are at {degrees(q[1]):.2f} and {degrees(q[5]):.2f} deg"
    c2, c3, c4 = cos(q[1]), cos(q[2]), cos(q[3])
    side, along = arm.fore * sin(q[3]), arm.upper + arm.fore * c4
    # Wrist from shoulder in the plane of the upper arm; its distance from the vertical through the shoulder.
    horizontal = hypot(sin(q[1]) * along + c2 * c3 * side, sin(q[2]) * side)
    if horizontal < SINGULAR * sqrt(side * side + along * along):
        return "shoulder and wrist are above each other, where the arm angle has no meaning"
    return None


def _singular_six(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    if abs(sin(q[2])) < SINGULAR:
        return f"the arm is stretched or folded: joint 3 is at {degrees(q[2]):.2f} deg"
    if abs(sin(q[4])) < SINGULAR:
        return f"axes 4 and 6 are in line: joint 5 is at {degrees(q[4]):.2f} deg"
    radius = arm.upper * sin(q[1]) + arm.fore * sin(q[1] + q[2])
    if abs(radius) < SINGULAR * (arm.upper + arm.fore):
        return "the wrist is on axis 1"
    return None
