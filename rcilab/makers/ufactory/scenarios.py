"""The errors of UFACTORY's controllers that a session can provoke, each by the shortest stream that raises it.

The client library refuses targets outside the joints' ranges, so that C23 has no scenario. The states have no external
torques, by which a record would show C31.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import JointPosition
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotState
from rcilab.makers.scenario import Callback, FaultScenario, Scene
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.motion import plan_joint

_EDGE = 0.3  # [m] Of the boundary around the tool.
_AWAY = 1.2  # [rad] Of joint 1: the tool leaves the boundary.
_FOLDED = {
    "xArm5": (0.0, -0.21, 0.14, 1.51, 0.0),
    "xArm6": (0.0, -0.21, 0.14, 0.0, 1.51, 0.0),
    "xArm7": (0.0, 0.37, 0.0, -0.07, 0.0, 1.67, 0.0),
    "Lite6": (0.0, 0.74, 0.06, 0.0, 1.34, 0.0),
    "850": (0.0, -0.88, 0.0, 0.0, -1.65, 0.0),
}
"""Inside every range, with the last link in the first or in the base, [rad]."""


def _planned(scene: Scene, goal: ArrayLike, speed: float) -> Callback:
    rows = plan_joint(scene.robot.model, scene.start.q_c, goal, speed=speed).q

    def callback(state: RobotState, t: float) -> JointPosition:
        cycle = round(t / CYCLE_TIME)
        return JointPosition(readonly_copy(rows[min(cycle, len(rows) - 1)]), finished=cycle >= len(rows))

    return callback


def _fold(scene: Scene) -> Callback:
    return _planned(scene, _FOLDED[scene.robot.model.name], 0.3)


def _bounded(scene: Scene) -> Scene:
    box = SafetyBox(size=(_EDGE,) * 3, T_base_box=Pose(np.round(scene.start.T_base_tool_c.position, 3)))
    scene.robot.set_safety_box(box)
    return replace(scene, box=box)


def _leave(scene: Scene) -> Callback:
    return _planned(scene, scene.start.q_c + _AWAY * _joint_1(scene), 0.2)


def _joint_1(scene: Scene) -> JointVector:
    return readonly_copy(np.eye(scene.robot.model.n)[0])


def scenarios_of(arm: str) -> tuple[FaultScenario, ...]:
    """Returns the scenarios of an arm, by its name, in display order."""
    return (
        FaultScenario(
            fault=UfactoryError.SAFETY_BOUNDARY, group="position", mode="joint_position", prepare=_bounded, act=_leave
        ),
        FaultScenario(fault=UfactoryError.SELF_COLLISION, group="position", mode="joint_position", act=_fold),
    )
