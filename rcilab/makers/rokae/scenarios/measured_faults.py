"""Faults of the arm with correct commands: it is pushed, accelerated by torques or hit, or the connection is lost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.scenarios.command_faults import box_around_tool, lively_elbow, soften_joint_1
from rcilab.makers.scenario import Callback, FaultScenario, Scene
from rcilab.makers.scenario_streams import LONGEST, PAUSE, cut_off, pushed, ramp_of, torque_stream

_ELBOW_LINK = 4


def _soft_joints(scene: Scene) -> Scene:
    n = scene.robot.model.n
    scene.commands.set_joint_impedance([100.0] * (n - 3) + [20.0] * 3)
    return scene.yielding()


def _loose_tool(scene: Scene) -> Scene:
    """The tool keeps its position and turns freely."""
    scene.commands.set_cartesian_impedance([1000.0] * 3 + [0.0] * 3)
    return scene.yielding()


def _firm_tool(scene: Scene) -> Scene:
    scene.commands.set_cartesian_impedance([3000.0] * 3 + [300.0] * 3)
    return scene.yielding()


def _touchy(scene: Scene) -> Scene:
    thresholds = np.full(scene.robot.model.n, 10.0)
    scene.commands.set_collision_behavior(thresholds)
    return scene.guarded(thresholds)


def _sideways(scene: Scene) -> Callback:
    return pushed(scene, ramp_of((0.0, 1.0, 0.0, 0.0, 0.0, 0.0), 300.0, 40.0), tool=False)


def _down(scene: Scene) -> Callback:
    return pushed(scene, ramp_of((0.0, 0.0, -1.0, 0.0, 0.0, 0.0), 300.0, 40.0), tool=False)


def _elbow(scene: Scene) -> Callback:
    """Along the only path of the elbow while the tool is held."""
    model, q = scene.robot.model, scene.start.q
    still = np.linalg.svd(model.jacobian(q))[2][-1]
    direction = model.rigid_body.link_jacobian(q, _ELBOW_LINK, np.zeros(3))[:3] @ still
    force = direction / np.linalg.norm(direction)
    return pushed(scene, ramp_of((*force.tolist(), 0.0, 0.0, 0.0), 500.0, 90.0), link=_ELBOW_LINK, tool=True)


def _swing(scene: Scene) -> Callback:
    ramp = np.minimum(0.01 * np.maximum(np.arange(LONGEST) - PAUSE, 0), 0.1)
    return torque_stream(scene.robot.model.n, scene.robot.model.n - 1, ramp)


def _turn(scene: Scene) -> Callback:
    axis = scene.start.T_base_tool.rotation[:, 2]
    return pushed(scene, ramp_of((0.0, 0.0, 0.0, *axis.tolist()), 5.0, 0.12), tool=True)


def _throw(scene: Scene) -> Callback:
    ramp = np.minimum(0.9 * np.maximum(np.arange(LONGEST) - PAUSE, 0), 30.0)
    return torque_stream(scene.robot.model.n, scene.robot.model.n - 3, ramp)


def _twist(scene: Scene) -> Callback:
    axis = scene.start.T_base_tool.rotation[:, 2]
    return pushed(scene, lambda since: (0.0, 0.0, 0.0, *(1.8 * axis).tolist()), tool=True)


def _hit(scene: Scene) -> Callback:
    return pushed(scene, lambda since: (0.0, 0.0, -60.0, 0.0, 0.0, 0.0), tool=False)


def _both(first: Callable[[Scene], Scene], second: Callable[[Scene], Scene]) -> Callable[[Scene], Scene]:
    return lambda scene: second(first(scene))


MEASURED_SCENARIOS = (
    FaultScenario(
        fault=Fault.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION, group="position", mode="joint_impedance",
        prepare=_both(_soft_joints, soften_joint_1), act=_sideways,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION, group="position", mode="joint_impedance",
        prepare=_both(_soft_joints, box_around_tool), act=_down,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION, group="position",
        mode="cartesian_impedance", prepare=_firm_tool, act=_elbow, needs_elbow=True,
        start=lively_elbow,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION, group="velocity", mode="torque", prepare=Scene.yielding,
        act=_swing,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION, group="velocity", mode="cartesian_impedance",
        prepare=_loose_tool, act=_turn,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION, group="acceleration", mode="torque",
        prepare=Scene.yielding, act=_throw,
    ),
    FaultScenario(
        fault=Fault.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION, group="acceleration", mode="cartesian_impedance",
        prepare=_loose_tool, act=_twist,
    ),
    FaultScenario(
        fault=Fault.COLLISION, group="contact", mode="joint_position", prepare=_touchy, act=_hit,
    ),
    FaultScenario(
        fault=Fault.INSTABILITY_DETECTION, group="contact", mode="joint_position", act=cut_off,
        cuts_network=True,
    ),
)  # fmt: skip
"""Every fault of the arm itself."""
