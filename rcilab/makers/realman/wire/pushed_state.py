"""The pushed state of an arm: bytes of a datagram to numbers. Other members than those read here are ignored."""

from __future__ import annotations

import msgspec

from rcilab.core.errors import DecodeError


class JointStatus(msgspec.Struct, frozen=True):
    """What a controller reports of each joint, n numbers each."""

    joint_position: list[int]
    """[0.001 deg]."""
    joint_en_flag: list[int]
    """1: enabled."""
    joint_err_code: list[int]
    """Error word."""
    joint_speed: list[int] | None = None
    """[0.02 RPM]; None: not pushed."""


class Waypoint(msgspec.Struct, frozen=True):
    """The pose of the tool in the current work frame."""

    position: list[int]
    """[0.000001 m]."""
    quat: list[int]
    """w, x, y, z, [0.000001]."""


class PushedState(msgspec.Struct, frozen=True):
    """A pushed state."""

    state: str
    joint_status: JointStatus
    waypoint: Waypoint
    err: list[int]
    """Errors of the system; 0: no error."""
    arm_current_status: str = ""
    """What the arm does; "": not pushed."""


_DECODER = msgspec.json.Decoder(PushedState)


def decode_push(datagram: bytes, n: int) -> PushedState:
    """Returns the state in a datagram.

    Args:
        datagram: The datagram.
        n: Number of joints.

    Raises:
        DecodeError: It is not a state of an arm with n joints.
    """
    try:
        pushed = _DECODER.decode(datagram)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DecodeError(f"not a pushed state: {error}") from error
    joints = pushed.joint_status
    lengths = {len(joints.joint_position), len(joints.joint_en_flag), len(joints.joint_err_code)}
    lengths |= set() if joints.joint_speed is None else {len(joints.joint_speed)}
    if pushed.state != "realtime_arm_joint_state" or lengths != {n}:
        raise DecodeError(f"not a pushed state of an arm with {n} joints")
    if len(pushed.waypoint.position) != 3 or len(pushed.waypoint.quat) != 4 or not any(pushed.waypoint.quat):
        raise DecodeError("the pose of a pushed state is not valid")
    return pushed
