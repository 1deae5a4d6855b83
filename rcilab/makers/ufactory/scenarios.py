"""The errors of UFACTORY's controllers that a session can provoke, each by the shortest stream that raises it.

A session sends joint targets of mode 1. For these the client library refuses angles outside the joints' own ranges, so
that C23 is that of narrower ranges; the controller solves no poses and keeps to the joints' speeds, so that C21, C24,
C25 and C40 have no scenario. An emergency stop (C1, C2) has no condition that a record could show.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import JointPosition
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.makers.scenario import Callback, FaultScenario, Scene
from rcilab.makers.scenario_streams import PAUSE, last_joint_narrowed, over_the_end, planned, struck, turned
from rcilab.makers.ufactory.bounds import COLLISION_SENSITIVITIES, SENSITIVITY_STEP, SERVO_SPEED_FACTOR
from rcilab.makers.ufactory.errors import UfactoryError

_EDGE = 0.3  # [m] Of the boundary around the tool.
_FOLDED = {
    "xArm5": (0.0, -0.21, 0.14, 1.51, 0.0),
    "xArm6": (0.0, -0.21, 0.14, 0.0, 1.51, 0.0),
    "xArm7": (0.0, 0.37, 0.0, -0.07, 0.0, 1.67, 0.0),
    "Lite6": (0.0, 0.74, 0.06, 0.0, 1.34, 0.0),
    "850": (0.0, -0.88, 0.0, 0.0, -1.65, 0.0),
}
"""Inside every range, with the last link in the first or in the base, [rad]."""
_TOO_FAST = 1.8  # Of the largest speed of the tool in servo mode.
_CHASE = 0.4  # [s] Of these targets.
_BLOW = 6.0  # Of the threshold of joint 1: at once, so that the record shows it, of which every fifth cycle is one.


def _fold(scene: Scene) -> Callback:
    return planned(scene, _FOLDED[scene.robot.model.name], 0.15)


def _bounded(scene: Scene) -> Scene:
    box = SafetyBox(size=(_EDGE,) * 3, T_base_box=Pose(np.round(scene.start.T_base_tool_c.position, 3)))
    scene.robot.set_safety_box(box)
    return replace(scene, box=box)


def _leave(scene: Scene) -> Callback:
    return planned(scene, turned(scene), 0.2)


def _too_fast(scene: Scene) -> Callback:
    """Targets that move at once with a speed that the arm reaches later, so that every one of them is too fast."""
    start, joint = scene.start.q_c, scene.limits.joint
    _, most, directions = np.linalg.svd(scene.robot.model.jacobian(start)[:3])  # The fastest tool for its joints.
    inwards = np.copysign(1.0, directions[0] @ (joint.lower + joint.upper - 2.0 * start))
    speed = _TOO_FAST * SERVO_SPEED_FACTOR * scene.limits.cartesian.translation_velocity / most[0]
    dq = readonly_copy(inwards * speed * directions[0])

    def callback(state: RobotState, t: float) -> JointPosition:
        since = max(0.0, min(t, _CHASE) - PAUSE * CYCLE_TIME)
        return JointPosition(readonly_copy(start + since * dq), finished=t > _CHASE)

    return callback


def _sensitive(scene: Scene) -> Scene:
    most = COLLISION_SENSITIVITIES[1]
    scene.commands.set_collision_sensitivity(most)
    share = 1.0 - SENSITIVITY_STEP * (most - 1)
    return scene.guarded(readonly_copy(share * scene.robot.model.limits.joint.torque))


def _hit(scene: Scene) -> Callback:
    """Pushes the tool back while it moves: the controller compares torques only then."""
    x, y, _ = scene.start.T_base_tool_c.position
    return struck(scene, float(_BLOW * scene.limits.joint.collision_threshold[0] / np.hypot(x, y)), 0.1)


def scenarios_of(arm: str) -> tuple[FaultScenario, ...]:
    """Returns the scenarios of an arm, by its name, in display order."""
    return (
        FaultScenario(
            fault=UfactoryError.JOINT_RANGE, group="position", mode="joint_position", prepare=last_joint_narrowed,
            act=over_the_end, is_commanded=True,
        ),
        FaultScenario(
            fault=UfactoryError.SAFETY_BOUNDARY, group="position", mode="joint_position", prepare=_bounded, act=_leave
        ),
        FaultScenario(fault=UfactoryError.SELF_COLLISION, group="position", mode="joint_position", act=_fold),
        FaultScenario(
            fault=UfactoryError.SERVO_LINEAR_SPEED, group="velocity", mode="joint_position", act=_too_fast
        ),
        FaultScenario(
            fault=UfactoryError.COLLISION, group="contact", mode="joint_position", prepare=_sensitive, act=_hit
        ),
    )  # fmt: skip
