"""Speed and acceleration of the tool in a stream of poses: their means, compared with the largest that are set.

Poses come in steps, of 0.001 rad for angles, and at irregular times. Over a single cycle, or the few milliseconds of a
period, both would count as large accelerations. The curve is that of the stream, which the joints may not reach.
"""

from __future__ import annotations

from collections import deque
from math import hypot

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import CartesianLimits
from rcilab.makers.realman.bounds import SPEED_ALLOWANCE
from rcilab.makers.realman.conditions import REALMAN_CONDITIONS
from rcilab.model.robot_model import RobotModel

_WINDOW = 80  # [cycles] Of a mean; a tuning value. An acceleration to the largest speed takes 150 ms.
_TIME = _WINDOW * CYCLE_TIME
_ROWS = {row.id: row for row in REALMAN_CONDITIONS.cartesian}


class ToolWatch:
    """Observes the tool along the curve of a stream. Owned by the drive.

    Args:
        model: The arm with its tool.
        limits: Those of the tool in force.
        q: Joint angles at the start of the curve, shape (n,), [rad].
    """

    def __init__(self, model: RobotModel, limits: CartesianLimits, q: JointVector) -> None:
        self._body, self._q = model.rigid_body, q
        bounds = {
            "cartesian.velocity.translation": limits.translation_velocity,
            "cartesian.velocity.rotation": limits.rotation_velocity,
            "cartesian.acceleration.translation": limits.translation_acceleration,
            "cartesian.acceleration.rotation": limits.rotation_acceleration,
        }
        self._rows = tuple((_ROWS[name], SPEED_ALLOWANCE * bound) for name, bound in bounds.items())
        size = 2 * _WINDOW + 1
        self._path = deque([[0.0] * 6] * size, size)  # Integral of the twist, [m, rad].

    def step(self, q: JointVector) -> tuple[LimitViolation, ...]:
        """Returns which bounds the tool exceeds.

        Args:
            q: Joint angles of the curve in this cycle, shape (n,), [rad].
        """
        path, twist = self._path, self._body.tool_terms(q, (q - self._q) / CYCLE_TIME).twist
        self._q = q
        path.append([x + CYCLE_TIME * v for x, v in zip(path[-1], twist, strict=True)])
        first, middle, last = path[0], path[_WINDOW], path[-1]
        v = [(c - b) / _TIME for b, c in zip(middle, last, strict=True)]
        dv = [(c - 2.0 * b + a) / _TIME**2 for a, b, c in zip(first, middle, last, strict=True)]
        values = hypot(*v[:3]), hypot(*v[3:]), hypot(*dv[:3]), hypot(*dv[3:])
        return tuple(
            LimitViolation(row, 0, value, bound)
            for (row, bound), value in zip(self._rows, values, strict=True)
            if value > bound
        )
