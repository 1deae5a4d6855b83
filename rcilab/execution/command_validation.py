"""Validation of commands before they are sent: their type and values, and the start of a motion or of a callback."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.core.arrays import Array, JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.rotation import as_rotation9
from rcilab.core.spatial import IDENTITY, Pose, as_pose, find_rotation_error
from rcilab.core.state import RobotState

START_TOLERANCE = 1e-6  # [rad] or [m] Such an offset makes a jerk of 1000 rad/s^3, below every limit.
_ARRIVED = 1e-12  # [rad] Commanded angles return over the wire unchanged, except for the sign of zero.
_POSE_ARRIVED = 1e-9  # [m], or an element of a rotation: a controller may normalise the pose.
_LONGEST_TOOL = 0.5  # [m] Tuning value: a longer one is another pose rather than another tool.
_TOOL_STEP, _TOOL_ROUNDING = 1e-4, 1e-6  # [m] Tools are given in tenths of a millimetre; positions may be rounded.
_START_ADVICE = (
    "plan the motion from robot.state.q_c, or move the arm to its start first: "
    "robot.execute(plan_joint(robot.model, robot.state.q_c, motion.q[0]))"
)


def require_command(command: Any, kind: type[Command], n: int, t: float) -> Command:
    """Returns a valid command with copies of its arrays, so that the caller may reuse them.

    Args:
        command: The return value of a callback.
        kind: The type of command of the mode.
        n: Number of joints.
        t: Its motion time, [s], for errors.

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


def find_start_mismatch(
    start: JointVector, q_c: JointVector, tolerance: float = START_POSITION_TOLERANCE, advice: str = _START_ADVICE
) -> str | None:
    """Returns a message if a motion does not start at the arm's position, or None.

    Args:
        start: Start of the motion, shape (n,), [rad].
        q_c: Commanded joint angles of the arm, [rad].
        tolerance: Largest distance, [rad]: that of the arm, `start_tolerance_of`.
        advice: End of the message: what to do.
    """
    if len(start) != len(q_c):
        return f"the motion is for {len(start)} joints and the arm has {len(q_c)}; plan it for the right model"
    off = np.abs(np.asarray(start) - q_c)
    if float(off.max()) <= tolerance:
        return None
    joint = int(off.argmax())
    others = int((off > tolerance).sum()) - 1
    shown = np.format_float_scientific(tolerance, precision=1, trim="-", exp_digits=1)  # "1e-9"
    more = f" (and {others} more joint{'s' if others > 1 else ''})" if others else ""
    return (
        f"the motion does not start at the arm's position: joint {joint + 1} starts at "
        f"{math.degrees(start[joint]):.4f} deg and is at {math.degrees(q_c[joint]):.4f} deg, "
        f"{math.degrees(off[joint]):.2g} deg apart{more} (tolerance {shown} rad); "
        f"{advice}"
    )


def require_start(
    command: Command,
    state: RobotState,
    limits: Limits,
    *,
    has_psi: bool,
    T_flange_tool: Pose = IDENTITY,
    resolution: float = 0.0,
) -> None:
    """Rejects a first command that differs from the commanded state: the arm would jump.

    Args:
        command: The first command of a motion.
        state: The state for which it was computed.
        limits: Bounds of the arm: the first torques may differ from zero by one cycle's rate.
        has_psi: Whether the arm has a redundancy; its angle is then checked.
        T_flange_tool: The tool of the controller, for the cause of a difference.
        resolution: Rounding of commanded positions in states, [rad] or [m].

    Raises:
        InvalidValueError: It differs; the message names the joint, both values and the tolerance.
    """
    tolerance = max(START_TOLERANCE, resolution)
    if isinstance(command, JointPosition):
        off = np.abs(command.q - state.q_c)
        joint = int(off.argmax())
        if off[joint] > tolerance:
            raise InvalidValueError(
                "first command",
                np.degrees(command.q).round(3).tolist(),
                f"deg must be the present position: joint {joint + 1} is commanded to "
                f"{math.degrees(command.q[joint]):.4f} deg and is at {math.degrees(state.q_c[joint]):.4f} deg, "
                f"{math.degrees(off[joint]):.4f} deg apart (tolerance {math.degrees(tolerance):.5f} deg); "
                "begin with state.q_c",
            )
    elif isinstance(command, CartesianPosition):
        off = float(np.abs(command.T_base_tool - state.T_base_tool_c.matrix).max())
        if off > tolerance:
            raise InvalidValueError(
                "first command",
                command.T_base_tool[:3, 3].tolist(),
                f"must be the present pose: an element differs by {off:.3g} (tolerance {tolerance:g}); "
                f"begin with state.T_base_tool_c{_describe_other_tool(command, state, T_flange_tool)}",
            )
        if command.psi is not None and has_psi:
            off = abs(math.remainder(command.psi - state.psi_c, math.tau))
            if off > tolerance:
                raise InvalidValueError(
                    "psi of the first command",
                    round(math.degrees(command.psi), 4),
                    f"deg must be the present one: the arm angle is {math.degrees(state.psi_c):.4f} deg, "
                    f"{math.degrees(off):.4f} deg apart (tolerance {math.degrees(tolerance):.5f} deg); begin "
                    "with state.psi_c, or with None to hold it",
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
                f"rate allows less than {bound:g} N m in the first cycle; begin with zeros, or set rate_limit='manual'",
            )


def _describe_other_tool(command: CartesianPosition, state: RobotState, T_flange_tool: Pose) -> str:
    """Returns which tool gives the commanded pose at the arm's angles, if that may be the cause of a difference.

    Any other pose gives a tool, too, but hardly one that its user could have typed.
    """
    T_base_flange = state.T_base_tool_c @ T_flange_tool.inverse()
    implied = (T_base_flange.inverse() @ as_pose(command.T_base_tool)).position
    is_typed = np.abs(implied - _TOOL_STEP * np.round(implied / _TOOL_STEP)).max() < _TOOL_ROUNDING
    is_other = np.abs(implied - T_flange_tool.position).max() > _TOOL_ROUNDING
    if not (is_typed and is_other) or float(np.linalg.norm(implied)) > _LONGEST_TOOL:
        return ""
    positions = np.round(1e3 * np.array((implied, T_flange_tool.position)), 1) + 0.0  # No minus sign before zero.
    theirs, ours = (", ".join(map(str, position)) for position in positions.tolist())
    return (
        f". If it was computed at the arm's present angles, then with a tool at ({theirs}) mm in the flange, but the "
        f"controller has one at ({ours}) mm: robot.model has the controller's tool, robot.set_tool sets another"
    )


def distance_to(state: RobotState, command: Command, *, has_psi: bool) -> float:
    """Returns the distance of the controller's commanded state from a command; 0 for torques.

    Returns:
        The largest difference of a joint angle or a commanded arm angle, [rad], or of an element of the pose, [m]; 0
        within rounding.
    """
    if isinstance(command, JointPosition):
        off = float(np.abs(state.q_c - command.q).max())
        return 0.0 if off <= _ARRIVED else off
    if isinstance(command, CartesianPosition):
        off = max(
            float(np.abs(state.T_base_tool_c.matrix - command.T_base_tool).max()),
            _arm_angle_offset(state, command, has_psi),
        )
        return 0.0 if off <= _POSE_ARRIVED else off
    return 0.0


def _arm_angle_offset(state: RobotState, command: CartesianPosition, has_psi: bool) -> float:
    """Returns the difference of the commanded arm angle from a command, [rad]; 0 if the controller chooses it."""
    if command.psi is None or not has_psi:
        return 0.0
    return abs(math.remainder(command.psi - state.psi_c, math.tau))


def describe_distance(state: RobotState, command: Command, *, has_psi: bool) -> str:
    """Returns the distance from a command as text: "joint 2 is 11.46 deg"."""
    if isinstance(command, JointPosition):
        off = np.abs(state.q_c - command.q)
        joint = int(off.argmax())
        return f"joint {joint + 1} is {math.degrees(off[joint]):.4g} deg"
    assert isinstance(command, CartesianPosition)  # Torques have no distance.
    length = float(np.linalg.norm(state.T_base_tool_c.position - command.T_base_tool[:3, 3]))
    turn = _arm_angle_offset(state, command, has_psi)
    if turn > length:
        return f"the arm angle is {math.degrees(turn):.4g} deg"
    return f"the tool is {1e3 * length:.4g} mm"


def _numbers(name: str, values: Any, shape: tuple[int, ...], unit: str) -> Array:
    try:
        numbers = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValueError(name, values, f"must be an array of {shape} numbers [{unit}]") from error
    if numbers.shape != shape:
        raise InvalidValueError(name, values, f"must have shape {shape} [{unit}], not {numbers.shape}")
    if not np.isfinite(numbers).all():
        index = np.argwhere(~np.isfinite(numbers))[0].tolist()
        where = f"joint {index[0] + 1}" if len(shape) == 1 else f"element {index}"
        raise InvalidValueError(name, numbers[tuple(index)], f"in {where}: must be finite [{unit}]")
    return numbers
