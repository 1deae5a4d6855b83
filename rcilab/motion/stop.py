"""The fastest stop from any state, for controller and client."""

from __future__ import annotations

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.motion import _ruckig
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.motion import Motion, stationary_motion


def plan_stop(limits: JointLimits, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> Motion:
    """Returns the motion on which every joint stops independently, as fast as its limits allow.

    Any finite state is possible, also outside the limits: an acceleration above its limit is first reduced to it, a
    velocity above its limit decreases at once. The stop position follows from the state; a joint that moves towards
    its position limit at full speed exceeds it (see `motion.goal`). Takes about 0.13 ms; the first access to
    `motion.q`, the rows to send, takes another 0.04 ms.

    Args:
        limits: Bounds of the joints.
        q: Commanded joint angles, shape (n,), [rad].
        dq: Their velocities, shape (n,), [rad/s]: derivatives, not backward differences; see
            `derivatives_from_differences` for what a robot reports.
        ddq: Their accelerations, shape (n,), [rad/s^2], likewise.

    Raises:
        InvalidValueError: The state is not n finite numbers each, or `limits` is not JointLimits.
        PlanningError: The velocities are far beyond any robot's.
    """
    if not isinstance(limits, JointLimits):
        raise InvalidValueError("limits", described(limits), "must be JointLimits; pass model.limits.joint")
    n = len(limits.velocity)
    q, dq, ddq = as_vector(q, n, "q", "rad"), as_vector(dq, n, "dq", "rad/s"), as_vector(ddq, n, "ddq", "rad/s^2")
    if not dq.any() and not ddq.any():
        return stationary_motion(q, law="stop")
    curve = _ruckig.plan_standstill(q, dq, ddq, LIMIT_MARGIN * limits.acceleration, LIMIT_MARGIN * limits.jerk)
    return Motion(polynomial=curve, goal=curve.at_end()[0], law="stop")
