"""The errors of RealMan's controllers that a session can provoke, each by the shortest stream or request.

A request that is refused, and a stream of poses, are sent by the maker's client library to an arm that stands still.

The other errors are failures of hardware: of a drive, a brake, a bus, a board, a sensor, a power supply.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.fault import FaultCode
from rcilab.makers.realman.bounds import LARGEST_STREAM_STEP, MOST_SENSITIVE, SPEED_ALLOWANCE
from rcilab.makers.realman.errors import RealManError, errors_of_codes
from rcilab.makers.realman.wire.units import pose_for_client
from rcilab.makers.scenario import Callback, FaultScenario, Scene
from rcilab.makers.scenario_streams import (
    PAUSE,
    joint_stream,
    last_joint_narrowed,
    over_the_end,
    path,
    planned,
    struck,
    turned,
)

_SLACK = 0.15  # [m] From the tool to the side of the fence.
_FAR = 2.0  # [m] To its other sides, which no link reaches.
_SLOW = 0.4  # [rad/s] Largest speed that joint 1 gets.
_TOO_FAST = 1.5  # Of the speed at which a joint is too fast.
_JUMP = 1.2  # Of the largest step.
_PUSH = 60.0  # [N]
_UNREACHABLE = 3.0  # [m] Length that no arm has.
_PERCENT = 10  # Speed of motions, which do not begin.
_DISABLED = 3  # The joint, from 1.
_TOOL_SPEED, _TOOL_ACCELERATION = 0.05, 0.2  # [m/s], [m/s^2] Largest ones that the tool gets, each for its own error.
_ANY_SPEED, _ANY_ACCELERATION = 10.0, 100.0  # [m/s], [m/s^2]; [rad/s], [rad/s^2].
_TWICE = 2.0  # Of the largest speed or acceleration, in a stream of poses.
_SMOOTH = 0.5  # [m/s^2] With which such a stream becomes fast.
_POSES, _POSE_PERIOD = 100, 0.005  # Of such a stream, and [s] from one to the next.
_FITTED = 1  # Trajectory mode: on a curve.
_READS = 200  # Of the errors, until a request has its effect.
_BOX, _INSIDE, _WHOLE_ARM = 1, 0, 0  # Form, side and region of a fence.
_FOLDED_DEG = {
    "RM65": (0, -80, -130, 0, -75, 0),
    "RM75": (0, 80, 0, 130, 0, 90, 0),
    "RML63-III": (0, -20, 140, 0, 90, 0),
    "ECO65": (0, 20, 130, 95, 5, 0),
    "ECO63": (0, 20, 145, 85, 15, 0),
    "GEN72": (0, 70, 0, -145, 0, -15, 0),
}
"""Inside every range, with the last links in the first ones."""


def _avoiding(scene: Scene) -> Scene:
    scene.commands.set_self_collision(True)
    return scene


def _fold(scene: Scene) -> Callback:
    return planned(scene, np.radians(_FOLDED_DEG[scene.robot.model.name]), 0.3)


def _fenced(scene: Scene) -> Scene:
    side = float(scene.start.T_base_tool_c.position[1]) + _SLACK
    library, api = scene.commands.library, scene.commands.api
    box = library.rm_fence_config_cube_t(-_FAR, _FAR, -_FAR, side, -_FAR, _FAR)
    api.rm_set_electronic_fence_config(library.rm_fence_config_t(_BOX, "", cube=box))
    api.rm_set_electronic_fence_enable(library.rm_electronic_fence_enable_t(True, _INSIDE, _WHOLE_ARM))
    return scene


def _open(scene: Scene) -> None:
    library = scene.commands.library
    off = library.rm_electronic_fence_enable_t(False, _INSIDE, _WHOLE_ARM)
    scene.commands.api.rm_set_electronic_fence_enable(off)


def _leave(scene: Scene) -> Callback:
    return planned(scene, turned(scene), 0.15)


def _slowed(scene: Scene) -> Scene:
    speeds = np.array(scene.limits.joint.velocity)
    speeds[0] = _SLOW
    scene.commands.set_joint_velocities(speeds)
    speeds *= SPEED_ALLOWANCE
    return replace(
        scene, limits=replace(scene.limits, joint=replace(scene.limits.joint, velocity=readonly_copy(speeds)))
    )


def _hurry(scene: Scene) -> Callback:
    top = 0.5 * float(scene.limits.joint.acceleration[0])
    accelerated = round(_TOO_FAST * scene.limits.joint.velocity[0] / (top * CYCLE_TIME))
    second = np.concatenate((np.zeros(PAUSE), np.full(accelerated, top), np.zeros(300)))
    return joint_stream(scene.start.q_c, 0, path(second))


def _jump(scene: Scene) -> Callback:
    size = np.radians(_JUMP * LARGEST_STREAM_STEP)
    return joint_stream(scene.start.q_c, 0, np.where(np.arange(10 * PAUSE) < 5 * PAUSE, 0.0, size))


def _sensitive(scene: Scene) -> Scene:
    scene.commands.set_collision_stage(MOST_SENSITIVE)
    return scene


def _hit(scene: Scene) -> Callback:
    """Pushes the tool back while it moves: the controller compares torques only then."""
    return struck(scene, _PUSH, 0.1)


def _reach_too_far(scene: Scene) -> tuple[FaultCode, ...]:
    pose = [_UNREACHABLE, 0.0, 0.0, 0.0, 0.0, 0.0]
    scene.commands.api.rm_movel(pose, _PERCENT, 0, 0, 0)
    return _errors(scene)


def _draw_a_line(scene: Scene) -> tuple[FaultCode, ...]:
    """Commands an arc through three points on a line."""
    start = pose_for_client(scene.start.T_base_tool_c)
    via, end = ([start[0], start[1], start[2] + up, *start[3:]] for up in (0.05, 0.1))
    scene.commands.api.rm_movec(via, end, _PERCENT, 0, 0, 0, 0)
    return _errors(scene)


def _change_work_frame(scene: Scene) -> tuple[FaultCode, ...]:
    scene.commands.api.rm_change_work_frame("missing")
    return _errors(scene)


def _change_tool_frame(scene: Scene) -> tuple[FaultCode, ...]:
    scene.commands.api.rm_change_tool_frame("missing")
    return _errors(scene)


def _move_a_disabled_joint(scene: Scene) -> tuple[FaultCode, ...]:
    api = scene.commands.api
    api.rm_set_joint_en_state(_DISABLED, 0)
    api.rm_movej(np.degrees(scene.start.q_c).tolist(), _PERCENT, 0, 0, 0)
    return _errors(scene)


def _tool_slowed(scene: Scene) -> Scene:
    scene.commands.set_tool_limits(_TOOL_SPEED, _ANY_ACCELERATION, _ANY_SPEED, _ANY_ACCELERATION)
    return scene


def _tool_softened(scene: Scene) -> Scene:
    scene.commands.set_tool_limits(_ANY_SPEED, _TOOL_ACCELERATION, _ANY_SPEED, _ANY_ACCELERATION)
    return scene


def _hurry_down(scene: Scene) -> tuple[FaultCode, ...]:
    return _stream_down(scene, _TWICE * _TOOL_SPEED, _SMOOTH)


def _rush_down(scene: Scene) -> tuple[FaultCode, ...]:
    return _stream_down(scene, _ANY_SPEED, _TWICE * _TOOL_ACCELERATION)


def _stream_down(scene: Scene, speed: float, acceleration: float) -> tuple[FaultCode, ...]:
    """Streams poses below the start, with a constant acceleration up to a speed."""
    start, begin = pose_for_client(scene.start.T_base_tool_c), time.monotonic()
    for t in _POSE_PERIOD * np.arange(_POSES):
        time.sleep(max(0.0, begin + t - time.monotonic()))
        ramp = min(t, speed / acceleration)
        below = acceleration * ramp * (t - 0.5 * ramp)
        scene.commands.api.rm_movep_canfd([*start[:2], start[2] - below, *start[3:]], True, _FITTED, 0)
    return _errors(scene)


def _errors(scene: Scene) -> tuple[FaultCode, ...]:
    """Returns the errors of the system, as soon as there are some."""
    for _ in range(_READS):
        found = errors_of_codes(map(int, scene.commands.api.rm_get_current_arm_state()[1]["err"]["err"]), ())
        if found:
            return found
    return ()


def _refused(fault: RealManError, request: Callable[[Scene], tuple[FaultCode, ...]]) -> FaultScenario:
    return FaultScenario(fault=fault, group="command", mode="joint_position", request=request)


_SCENARIOS = (
    FaultScenario(
        fault=RealManError.TARGET_OVER_LIMIT, group="position", mode="joint_position", prepare=last_joint_narrowed,
        act=over_the_end, is_commanded=True,
    ),
    FaultScenario(
        fault=RealManError.SELF_COLLISION, group="position", mode="joint_position", prepare=_avoiding, act=_fold
    ),
    FaultScenario(
        fault=RealManError.FENCE, group="position", mode="joint_position", prepare=_fenced, act=_leave, restore=_open
    ),
    FaultScenario(
        fault=RealManError.JOINT_OVERSPEED, group="velocity", mode="joint_position", prepare=_slowed, act=_hurry
    ),
    FaultScenario(
        fault=RealManError.JOINT_POSITION_STEP, group="velocity", mode="joint_position", act=_jump, is_commanded=True
    ),
    FaultScenario(
        fault=RealManError.OVERSPEED, group="velocity", mode="joint_position", prepare=_tool_slowed,
        request=_hurry_down,
    ),
    FaultScenario(
        fault=RealManError.OVERACCELERATION, group="acceleration", mode="joint_position", prepare=_tool_softened,
        request=_rush_down,
    ),
    _refused(RealManError.UNREACHABLE, _reach_too_far),
    _refused(RealManError.CIRCLE, _draw_a_line),
    _refused(RealManError.NO_WORK_FRAME, _change_work_frame),
    _refused(RealManError.NO_TOOL_FRAME, _change_tool_frame),
    _refused(RealManError.JOINT_DISABLED, _move_a_disabled_joint),
    FaultScenario(
        fault=RealManError.COLLISION, group="contact", mode="joint_position", prepare=_sensitive, act=_hit
    ),
)  # fmt: skip


def scenarios() -> tuple[FaultScenario, ...]:
    """Returns the scenarios of every arm, in display order."""
    return _SCENARIOS
