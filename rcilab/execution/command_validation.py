"""Validation of a callback's commands before they are sent: their type and values, and the start of the motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.rotation import as_rotation9
from rcilab.core.spatial import find_rotation_error
from rcilab.core.state import RobotState

START_TOLERANCE = 1e-6  # [rad] or [m] A first command this far off makes a jerk of 1000 rad/s^3, below every limit.
_ARRIVED = 1e-12  # [rad] The commanded angles come back over the wire bit by bit; this is for a sign of zero.
_POSE_ARRIVED = 1e-9  # [m], or an element of a rotation: a controller may normalise what it was sent.


def check_command(command: Any, kind: type[Command], n: int, t: float) -> Command:
    """Returns a valid command with copies of its arrays, so that the caller may reuse them.

    Args:
        command: The return value of a callback.
        kind: The type of command of the mode.
        n: Number of joints.
        t: Motion time it is for, [s], to name in an error.

    Raises:
        InvalidValueError: It is of another kind, of the wrong shape, or not finite.
    """
    name = f"command at t = {t:.3f} s"
    if not isinstance(command, kind):
        raise InvalidValueError(name, command, f"must be a {kind.__name__} in this mode")
    if isinstance(command, JointPosition):
        return JointPosition(_numbers(name, command.q, (n,), "rad"), command.finished)
    if isinstance(command, JointTorque):
        return JointTorque(_numbers(name, command.tau, (n,), "N m"), command.finished)
    if command.psi is not None and not math.isfinite(command.psi):
        raise InvalidValueError("psi", command.psi, "must be finite [rad], or None")
    T = _numbers(name, command.T_base_tool, (4, 4), "m")
    error = find_rotation_error(as_rotation9(T[:3, :3]))
    if error is not None:
        raise InvalidValueError(name, "T_base_tool", error)
    return CartesianPosition(T, command.psi, command.finished)


def require_first(command: Command, state: RobotState, limits: Limits, *, has_psi: bool) -> None:
    """Rejects a first command that differs from the commanded state: the arm would jump.

    Args:
        command: The first command of a motion.
        state: The state that it answers.
        limits: Bounds of the arm: torques begin at zero, so the first ones are at most one cycle's rate away from it.
        has_psi: Whether the arm has a redundancy, whose angle counts.

    Raises:
        InvalidValueError: It differs; the message names the joint, both values and the tolerance.
    """
    if isinstance(command, JointPosition):
        off = np.abs(command.q - state.q_c)
        joint = int(off.argmax())
        if off[joint] > START_TOLERANCE:
            raise InvalidValueError(
                "first command",
                np.degrees(command.q).round(3).tolist(),
                f"deg must be where the arm is: joint {joint + 1} is commanded to "
                f"{math.degrees(command.q[joint]):.4f} deg and stands at {math.degrees(state.q_c[joint]):.4f} deg, "
                f"{math.degrees(off[joint]):.4f} deg apart (tolerance {math.degrees(START_TOLERANCE):.1g} deg); "
                "begin with state.q_c",
            )
    elif isinstance(command, CartesianPosition):
        off = float(np.abs(command.T_base_tool - state.T_base_tool_c.matrix).max())
        if off > START_TOLERANCE:
            raise InvalidValueError(
                "first command",
                command.T_base_tool[:3, 3].tolist(),
                f"must be the pose the arm is at: an element differs by {off:.3g} (tolerance {START_TOLERANCE:g}); "
                "begin with state.T_base_tool_c",
            )
        if command.psi is not None and has_psi:
            off = abs(math.remainder(command.psi - state.psi_c, math.tau))
            if off > START_TOLERANCE:
                raise InvalidValueError(
                    "psi of the first command",
                    round(math.degrees(command.psi), 4),
                    f"deg must be where the arm is: its arm angle is {math.degrees(state.psi_c):.4f} deg, "
                    f"{math.degrees(off):.4f} deg apart (tolerance {math.degrees(START_TOLERANCE):.1g} deg); begin "
                    "with state.psi_c, or with None to keep it",
                )
    else:
        off = np.abs(command.tau) - limits.joint.torque_rate * CYCLE_TIME
        joint = int(off.argmax())
        if off[joint] >= 0.0:
            bound = limits.joint.torque_rate[joint] * CYCLE_TIME
            raise InvalidValueError(
                "first command",
                command.tau.tolist(),
                f"N m must be near zero: joint {joint + 1} begins with {command.tau[joint]:.4g} N m, and the torque "
                f"rate allows less than {bound:g} N m at first; begin with zeros, or give rate_limit='manual'",
            )


def distance_to(state: RobotState, command: Command, *, has_psi: bool) -> float:
    """Returns the distance of the controller's commanded state from a command; 0 for torques.

    Returns:
        The largest difference of a joint angle or a commanded arm angle, [rad], or of an element of the pose, [m]; 0
        where none counts.
    """
    if isinstance(command, JointPosition):
        off = float(np.abs(state.q_c - command.q).max())
        return 0.0 if off <= _ARRIVED else off
    if isinstance(command, CartesianPosition):
        off = max(
            float(np.abs(state.T_base_tool_c.matrix - command.T_base_tool).max()), _turned(state, command, has_psi)
        )
        return 0.0 if off <= _POSE_ARRIVED else off
    return 0.0


def _turned(state: RobotState, command: CartesianPosition, has_psi: bool) -> float:
    """Returns how far the commanded arm angle is from a command, [rad]; 0 where it was left to the controller."""
    if command.psi is None or not has_psi:
        return 0.0
    return abs(math.remainder(command.psi - state.psi_c, math.tau))


def describe_distance(state: RobotState, command: Command, *, has_psi: bool) -> str:
    """Returns the distance from a command as text: "joint 2 is 11.46 deg"."""
    if isinstance(command, JointPosition):
        off = np.abs(state.q_c - command.q)
        joint = int(off.argmax())
        return f"joint {joint + 1} is {math.degrees(off[joint]):.4g} deg"
    assert isinstance(command, CartesianPosition)  # Torques are always there.
    length = float(np.linalg.norm(state.T_base_tool_c.position - command.T_base_tool[:3, 3]))
    turned = _turned(state, command, has_psi)
    if turned > length:
        return f"the arm angle is {math.degrees(turned):.4g} deg"
    return f"the tool is {1e3 * length:.4g} mm"


def _numbers(name: str, values: Any, shape: tuple[int, ...], unit: str) -> Array:
    try:
        numbers = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValueError(name, values, f"is not {shape} numbers [{unit}]") from error
    if numbers.shape != shape:
        raise InvalidValueError(name, values, f"has shape {numbers.shape}, needs {shape} [{unit}]")
    if not np.isfinite(numbers).all():
        place = np.argwhere(~np.isfinite(numbers))[0].tolist()
        where = f"joint {place[0] + 1}" if len(shape) == 1 else f"element {place}"
        raise InvalidValueError(name, numbers[tuple(place)], f"in {where}: must be finite [{unit}]")
    return numbers
