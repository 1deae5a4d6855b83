"""From the commanded pose to joint angles: the branch the arm is on, followed without jumps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import pi, remainder, tau

from rcilab.core.errors import SingularError
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.kinematics.inverse import Angles, build_geometry, inverse_seven, inverse_six
from rcilab.model.kinematics.singularity import find_singularity
from rcilab.model.robot_model import RobotModel

_SIDES = ((0.0,), (pi,), (0.0, pi))  # Flips of a joint bent to its positive side, to its negative one, or next to zero.
_FLIPS = [[[list(product(a, b, c)) for c in _SIDES] for b in _SIDES] for a in _SIDES]
_STEP = 0.1  # [rad] What no joint passes in a cycle, by far: an arm bent more than that stays bent to the same side.


class IkTracker:
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
        branch = branches[0] if len(branches) == 1 else self._nearest(branches, near)
        q = [here + remainder(angle - here, tau) for angle, here in zip(branch, near, strict=True)]
        singularity = find_singularity(self._geometry, q)
        if singularity is not None:
            raise SingularError(singularity)
        return q

    def _nearest(self, branches: list[Angles], near: Sequence[float]) -> Angles:
        best, least = branches[0], float("inf")
        bends, here_bends = self._bends, [near[i] for i in self._bends]
        for branch in branches:
            # Where the arm bends it cannot turn round and round, so a look there tells most branches off.
            if sum([(branch[i] - here) ** 2 for i, here in zip(bends, here_bends, strict=True)]) >= least:
                continue
            distance = sum([remainder(angle - here, tau) ** 2 for angle, here in zip(branch, near, strict=True)])
            if distance < least:
                least, best = distance, branch
        return best

    def _near_flips(self, near: Sequence[float]) -> list[tuple[float, ...]]:
        """Returns the branches that a step from `near` may end on: those of its own sides, and of both next to zero."""
        _, offset_2, _, offset_4, _, offset_6, _ = self._geometry.offsets
        _, q2, _, q4, _, q6, _ = near
        return _FLIPS[_side(q2 - offset_2)][_side(q4 - offset_4)][_side(q6 - offset_6)]


def _side(bend: float) -> int:
    """Returns which of `_SIDES` an upright joint is on."""
    if abs(bend) < _STEP:
        return 2
    return 1 if remainder(bend, tau) < 0.0 else 0
