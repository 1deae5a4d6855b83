"""What programs command: smooth motions from the present commanded values and back."""

from __future__ import annotations

import math

from tests.peers.franka import wire
from tests.peers.franka.robot import Callback, Output
from tests.peers.franka.wire import State

CYCLE = 0.001  # [s]
LEVER = 0.3  # [m] Motions of the tool are smaller than those of a joint.
ZERO = (0.0,) * 7


def bump(k: int, cycles: int, height: float) -> float:
    """Returns a path there and back, with velocity and acceleration zero at both ends."""
    u = min(k, cycles) / cycles
    return height * 64.0 * (u * (1.0 - u)) ** 3


def bump_rate(k: int, cycles: int, height: float) -> float:
    """Returns the backward difference of `bump`, per second."""
    return (bump(k, cycles, height) - bump(max(k - 1, 0), cycles, height)) / CYCLE


def with_offset(values: tuple[float, ...], place: int, offset: float) -> tuple[float, ...]:
    """Returns numbers with one of them moved."""
    return (*values[:place], values[place] + offset, *values[place + 1 :])


def motion(
    start: State, generator: int, *, cycles: int = 200, height: float = 0.01, elbow: bool = False, joint: int = 3
) -> Callback:
    """Returns a program for a motion generator: one joint, or the tool along z, there and back.

    Args:
        start: The state of `Robot.move`.
        generator: As in Move.
        cycles: Duration of the motion.
        height: Of the farthest angles, [rad]; the tool's are `LEVER` times that, [m].
        elbow: Whether the elbow is commanded beside the tool, moved alike.
        joint: The joint, from 0.
    """
    q, pose, q3 = start.q_d, start.O_T_EE_c, start.elbow_c
    tool = LEVER * height

    def callback(_: State, k: int) -> Output:
        path, rate = bump(k, cycles, height), bump_rate(k, cycles, height)
        side = with_offset(q3, 0, path) if elbow else None
        match generator:
            case wire.JOINT_POSITION:
                return Output(q=with_offset(q, joint, path), tau=ZERO)
            case wire.JOINT_VELOCITY:
                return Output(dq=with_offset(ZERO, joint, rate), tau=ZERO)
            case wire.CARTESIAN_POSE:
                return Output(pose=with_offset(pose, 14, bump(k, cycles, tool)), elbow=side, tau=ZERO)
            case wire.CARTESIAN_VELOCITY:
                return Output(twist=(0.0, 0.0, bump_rate(k, cycles, tool), 0.0, 0.0, 0.0), elbow=side, tau=ZERO)
            case _:
                return Output(tau=with_offset(ZERO, 6, 0.2 * math.sin(2.0 * math.pi * k / cycles)))

    return callback
