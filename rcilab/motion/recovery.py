"""Motion back inside the joint ranges and the safety box, for an arm that stopped outside them."""

from __future__ import annotations

from math import degrees, radians

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Vector3, as_vector
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.bounds import RECOVERY_RANGE, angle_text, range_from
from rcilab.motion.cartesian import plan_line
from rcilab.motion.joint import plan_joint
from rcilab.motion.motion import Motion

RECOVERY_MARGIN = radians(1.0)
"""Distance inside its range to which a joint is moved, [rad]: the next motion then starts inside even if a compliant
arm deflects slightly."""
RECOVERY_DEPTH = 0.01
"""Distance inside the safety box to which the tool is moved, [m], for the same reason."""
RECOVERY_SPEED = 0.05
"""Part of the velocity and acceleration limits; low, because the arm has just been stopped."""


def plan_recovery(
    model: RobotModel, q: ArrayLike, box: SafetyBox | None = None, *, speed: float = RECOVERY_SPEED
) -> Motion:
    """Returns the motion that moves joints outside their range back inside, by 1 degree, and stops there.

    Each of these joints moves straight inwards; all others stay. If all are inside and the tool is outside its safety
    box, the tool moves straight back in, by 1 cm. `check` accepts the motion, and `execute` runs it. If nothing is
    outside, the motion has zero length. A controller that has stopped for a joint limit also switches motor power off:
    call `power_off()`, `power_on()`, then run this motion. `recover()` instead of `power_off()` is refused if a joint
    is more than 1 degree outside.

    Args:
        model: The arm; soft limits, if set, define the range.
        q: Current commanded joint angles, `state.q_c`, shape (n,), [rad]. A joint may be outside by at most
            `RECOVERY_RANGE`, 20 degrees.
        box: The controller's safety box, such as `robot.safety_box`; None: no box.
        speed: Part of the velocity and acceleration limits to use, 0.001 to 1.

    Raises:
        PlanningError: A joint is farther outside; guide the arm by hand, or move it by its panel.
        InvalidValueError: Wrong shape, not finite, or a speed out of range.
    """
    limits = require_model(model).limits.joint
    start = as_vector(q, model.n, "q", "rad")
    beyond = np.maximum(limits.lower - start, start - limits.upper)
    farthest = int(beyond.argmax())
    if beyond[farthest] > RECOVERY_RANGE:
        raise _too_far(limits, farthest + 1, float(start[farthest]), float(beyond[farthest]))
    if box is not None and beyond[farthest] < 0.0:
        T = model.forward(start)
        if box.active and box.excess(T.parts[1]) > 0.0:
            return plan_line(model, start, Pose(_nearest_inside(box, T.position), T.wxyz), speed=speed)
    margin = np.minimum(RECOVERY_MARGIN, (limits.upper - limits.lower) / 2.0)
    goal = np.where(beyond >= 0.0, np.clip(start, limits.lower + margin, limits.upper - margin), start)
    widened = range_from(limits, start)
    arm = model.with_joint_limits(widened.lower, widened.upper)
    return plan_joint(arm, start, goal, speed=speed, law="torque_rate_limited")


def _too_far(limits: JointLimits, joint: int, angle: float, beyond: float) -> PlanningError:
    soft, most = limits.exceeded_soft_limit(joint, angle), f"{degrees(RECOVERY_RANGE):g}"
    facts = {"joint": joint, "angle": angle, "beyond": beyond, "most": RECOVERY_RANGE}
    where = "its range" if soft is None else f"the soft limit of {degrees(soft):.2f}° that was set"
    message = (
        f"joint {joint}: {angle_text(angle)} is {degrees(beyond):.2f}° outside {where}, and plan_recovery works "
        f"up to {most}°; guide the arm back by hand"
    )
    if soft is None:
        return PlanningError(message).coded("recovery_range", **facts)
    message += ", or widen the soft limit"
    return PlanningError(message).coded("recovery_range_soft", **facts, limit=soft)


def _nearest_inside(box: SafetyBox, position: Vector3) -> Vector3:
    """Returns the nearest point `RECOVERY_DEPTH` inside the box, or its middle if it is thinner, shape (3,), [m]."""
    half_size = np.array(box.size) / 2.0
    half_size -= np.minimum(RECOVERY_DEPTH, half_size)
    T_box_base = box.T_base_box.inverse()
    return box.T_base_box @ np.clip(T_box_base @ position, -half_size, half_size)
