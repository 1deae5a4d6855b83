"""The errors of Franka's interface that a session can provoke, each by the shortest stream that raises it.

A session itself refuses a motion that does not begin where the arm is; those errors have no scenario.

Commanded poses are those of an arm of which one joint moves, so that the tool or that joint exceeds its bound first.
The elbow is commanded to the Panda only: pylibfranka, which drives the FR3, cannot command it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition
from rcilab.core.state import Mode, RobotState
from rcilab.makers.franka.bounds import LARGEST_THRESHOLD
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.scenario import Callback, FaultScenario, Group, Scene
from rcilab.makers.scenario_streams import (
    LONGEST,
    PAUSE,
    cut_off,
    joint_stream,
    over_the_end,
    path,
    planned,
    pushed,
    rise,
    torque_stream,
)
from rcilab.model.robot_model import RobotModel

_NEAR_END = 0.02  # [rad] From the end of the range of joint 7.
_PAST = 1.01  # Factor on the bound: beyond it by more than the rounding of single precision.
_TOUCHY = 8.0  # [N m] Collision threshold of the joints.
_LAST, _ELBOW = 6, 2  # Joints, from 0.
_FOLDED = {"Panda": (0.0, 1.616, 0.0, -2.606, 0.0, 1.801, 0.785), "FR3": (0.0, 1.174, 0.0, -2.849, 0.0, 3.813, 0.785)}
"""Inside every range, with the wrist in the base, [rad]."""


def _at(*angles: float) -> Callable[[RobotModel], JointVector]:
    return lambda model: readonly_copy(angles)


_almost_stretched = _at(0.0, -0.3, 0.2, -0.65, 0.1, 1.5, 0.785)


def _near_the_end(model: RobotModel) -> JointVector:
    q = np.array(model.home)
    q[_LAST] = model.limits.joint.upper[_LAST] - _NEAR_END
    return readonly_copy(q)


def _pose_stream(scene: Scene, joint: int, displacement: Array, *, elbow: Array | None = None) -> Callback:
    """Returns a callback with the poses of an arm of which one joint, counted from 0, moves by a displacement, [rad].

    The Panda's elbow is commanded, too: that of the start and `elbow`, [rad].
    """
    model, arm, q = scene.robot.model, scene.robot.model.name, np.array(scene.start.q_c)
    rows = np.tile(q, (len(displacement), 1))
    rows[:, joint] += displacement
    poses = model.forward_path(rows)

    def callback(state: RobotState, t: float) -> CartesianPosition:
        cycle = round(t / CYCLE_TIME)
        row = min(cycle, len(poses) - 1)
        psi = None if arm == "FR3" else float(q[_ELBOW] + (0.0 if elbow is None else elbow[row]))
        return CartesianPosition(readonly_copy(poses[row]), psi=psi, finished=cycle >= len(poses))

    return callback


def _too_fast() -> Array:
    return path(rise(0.5, 8.03, 800))


def _too_strong() -> Array:
    return path(rise(0.97, 60.0, 80))


def _jump(size: float) -> Array:
    """Displacement with an acceleration that jumps after the pause."""
    return path(np.where(np.arange(60) < PAUSE, 0.0, size))


def _elbow_jump(scene: Scene) -> Callback:
    return _pose_stream(scene, 0, np.zeros(60), elbow=np.where(np.arange(60) < PAUSE, 0.0, 0.3))


def _pose_over_the_end(scene: Scene) -> Callback:
    return _pose_stream(scene, _LAST, path(rise(0.01, 0.2, 1200)))


def _fold(scene: Scene) -> Callback:
    """Goes on a correct path to a pose in which the wrist would be in the base."""
    return planned(scene, _FOLDED[scene.robot.model.name], 0.3)


def _joint_velocity(scene: Scene) -> Callback:
    return joint_stream(scene.start.q_c, 0, _too_fast())


def _joint_acceleration(scene: Scene) -> Callback:
    return joint_stream(scene.start.q_c, 3, _too_strong())


def _joint_jerk(scene: Scene) -> Callback:
    return joint_stream(scene.start.q_c, 3, _jump(_PAST * 1.1 * scene.limits.joint.jerk[3] * CYCLE_TIME))


def _tool_velocity(scene: Scene) -> Callback:
    return _pose_stream(scene, _LAST, _too_fast())


def _tool_acceleration(scene: Scene) -> Callback:
    """The last step passes the tool's bound from below that of joint 7."""
    below = 0.97 * scene.limits.joint.acceleration[_LAST]
    second = np.concatenate((rise(below / 4.0, below, PAUSE + 6), np.full(20, _PAST * _turn(scene, 2))))
    return _pose_stream(scene, _LAST, path(second))


def _tool_jerk(scene: Scene) -> Callback:
    return _pose_stream(scene, _LAST, _jump(1.02 * _turn(scene, 3) * CYCLE_TIME))


def _turn(scene: Scene, order: int) -> float:
    limits = scene.limits.cartesian
    return limits.rotation_acceleration if order == 2 else limits.rotation_jerk


def _inverse_velocity(scene: Scene) -> Callback:
    return _pose_stream(scene, 0, _too_fast())


def _inverse_acceleration(scene: Scene) -> Callback:
    return _pose_stream(scene, 3, _too_strong())


def _inverse_jerk(scene: Scene) -> Callback:
    return _pose_stream(scene, 3, _jump(_PAST * 1.1 * scene.limits.joint.jerk[3] * CYCLE_TIME))


def _stretch(scene: Scene) -> Callback:
    return _pose_stream(scene, 3, path(rise(0.005, 0.1, 3000)))


def _torque_jump(scene: Scene) -> Callback:
    step = _PAST * scene.limits.joint.torque_rate[_LAST] * CYCLE_TIME
    return torque_stream(7, _LAST, np.where(np.arange(40) < PAUSE, 0.0, step))


def _drift(scene: Scene) -> Callback:
    """Takes joint 7 over the end of its range, so slowly that it is not too fast."""
    return torque_stream(7, _LAST, np.minimum(0.002 * np.maximum(np.arange(LONGEST) - PAUSE, 0), 0.02))


def _swing(scene: Scene) -> Callback:
    return torque_stream(7, _LAST, np.minimum(0.5 * np.maximum(np.arange(LONGEST) - PAUSE, 0), 11.0))


def _touchy(scene: Scene) -> Scene:
    forces = np.full(6, LARGEST_THRESHOLD)
    torques = np.full(7, _TOUCHY)
    scene.commands.set_collision_behavior(torques, torques, forces, forces)
    return scene.guarded(torques)


def _hit(scene: Scene) -> Callback:
    return pushed(scene, lambda since: (0.0, 0.0, -60.0, 0.0, 0.0, 0.0), tool=False)


def _command(
    fault: FrankaError,
    group: Group,
    act: Callable[[Scene], Callback],
    start: Callable[[RobotModel], JointVector] = lambda model: model.home,
) -> FaultScenario:
    """Returns the scenario of a wrong command: a joint angle, or a pose where the error says so."""
    mode: Mode = "cartesian_position" if fault.name.startswith("CARTESIAN") else "joint_position"
    return FaultScenario(fault=fault, group=group, mode=mode, act=act, start=start, is_commanded=True)


_COMMON = (
    FaultScenario(
        fault=FrankaError.JOINT_POSITION_LIMITS_VIOLATION, group="position", mode="torque", act=_drift,
        start=_near_the_end,
    ),
    FaultScenario(
        fault=FrankaError.SELF_COLLISION_AVOIDANCE_VIOLATION, group="position", mode="joint_position", act=_fold,
    ),
    _command(FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION, "velocity", _tool_velocity),
    FaultScenario(fault=FrankaError.JOINT_VELOCITY_VIOLATION, group="velocity", mode="torque", act=_swing),
    _command(FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY, "acceleration", _joint_acceleration),
    _command(FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY, "acceleration", _joint_jerk),
    _command(FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_DISCONTINUITY, "acceleration", _tool_acceleration),
    _command(FrankaError.CARTESIAN_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY, "acceleration", _tool_jerk),
    _command(
        FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_DISCONTINUITY, "acceleration", _inverse_acceleration
    ),
    _command(FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_ACCELERATION_DISCONTINUITY, "acceleration", _inverse_jerk),
    FaultScenario(
        fault=FrankaError.CONTROLLER_TORQUE_DISCONTINUITY, group="command", mode="torque", act=_torque_jump,
    ),
    FaultScenario(
        fault=FrankaError.JOINT_REFLEX, group="contact", mode="joint_position", prepare=_touchy, act=_hit,
    ),
    FaultScenario(
        fault=FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION, group="contact", mode="joint_position", act=cut_off,
        cuts_network=True,
    ),
)  # fmt: skip
_ONLY = {
    "Panda": (
        _command(
            FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION, "position", over_the_end, _near_the_end
        ),
        _command(
            FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_POSITION_LIMITS_VIOLATION, "position", _pose_over_the_end,
            _near_the_end,
        ),
        _command(FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION, "position", _elbow_jump),
        _command(FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION, "velocity", _joint_velocity),
        _command(
            FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_LIMITS_VIOLATION, "velocity", _inverse_velocity
        ),
        _command(
            FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG, "command", _stretch, _almost_stretched
        ),
    ),
    "FR3": (
        _command(
            FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION, "velocity", over_the_end, _near_the_end
        ),
    ),
}  # fmt: skip
"""Those of one of the arms. The FR3's velocity bounds decrease towards the ends of its ranges, where they stop it."""


def scenarios_of(arm: str) -> tuple[FaultScenario, ...]:
    """Returns the scenarios of an arm, by its name, in display order."""
    return (*_ONLY[arm], *_COMMON)
