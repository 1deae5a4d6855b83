"""The jerk-limited motion along a path of the tool: as fast as the limits on joints, tool and arm angle allow.

The closed-form inverse at every cycle keeps the tool on the path within rounding. Between the cycles the joints follow
quintics with the path's own velocities and accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector, as_number, make_readonly
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.limits import JointLimits
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import LIMIT_MARGIN, limit_touched
from rcilab.motion.cycle_quintics import cycle_quintics, peak_derivatives
from rcilab.motion.end_velocity import bounds_along, end_excess, find_blocked
from rcilab.motion.hermite import central_state
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.joint import MIN_SPEED
from rcilab.motion.motion import Motion, stationary_motion
from rcilab.motion.orientation_path import ViaOrientation, turns_between
from rcilab.motion.path import Path
from rcilab.motion.path_bounds import MIN_SLOPE, POLYGON_FACTOR, PathBounds, half_planes, path_bounds
from rcilab.motion.path_infeasibility import path_error, solve_path
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.rows import OVERCORRECTION, blocks, spread
from rcilab.motion.time_parametrization import FastestLaw, TimeParametrization, smooth_law

_KNOTS = 500
"""Number of steps between which bounds are interpolated. Tuning value: 2 mm on a line of 1 m."""
_FINE_KNOTS = 4000
"""The same close to a singularity, where joints turn fast over a short distance. Tuning value: planning takes 50 ms."""
_MAX_STEP = 0.1
"""A larger step of a joint from knot to knot is caused by a singularity, [rad]: it would be 50 rad on the whole path,
more than any arm can turn."""
_ROUNDS = 8
"""Largest number of local slowdowns of a time law that exceeds a limit, and then of global ones. Measured: 1 to 5."""
_MAX_SLOWDOWN = 4.0
"""A larger slowdown is required by a jump, not by the interpolation between the knots. Tuning value."""
_DIFFERENCE_TIME = 2e-5
"""Time between the poses of a finite difference, [s]. Tuning value: it adds 0.4 % of the jerk to the jerk between the
cycles, and the inverse's rounding 0.2 rad/s^3. Five times as much would add 10 %."""
_MIN_DIFFERENCE_STEP = 1e-6
"""Smallest step of a finite difference, as a share of the path. It is used near standstill, where velocity and
acceleration hardly depend on it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Bounds:
    """Bounds of n joints, the arm angle if there is one, and the tool's rotation, as columns, shape (m,)."""

    velocity: Array
    acceleration: Array
    jerk: Array
    tool: tuple[float, float, float]
    """Velocity, acceleration and jerk of the tool's translation."""
    ends: JointLimits | None
    """The joints' limits if their velocity bounds decrease towards the ends of the ranges; else None."""


def plan_along(model: RobotModel, q: JointVector, path: Path, speed: float) -> Motion:
    """Returns the fastest motion along a path, from standstill to standstill, within all limits.

    The limits hold as the controller checks them, by backward differences at 1 ms, with `LIMIT_MARGIN`.

    Args:
        model: The arm, with its tool.
        q: Joint angles at the start of the path, shape (n,), [rad]: they choose the branch.
        path: The path.
        speed: Part of the velocity and acceleration limits to use, from `MIN_SPEED` to 1; the jerk limit is used in
            full.

    Raises:
        PlanningError: A pose on the path is out of reach, or a joint limit or a singularity is in the way.
        InvalidValueError: The speed is out of range.
    """
    speed = as_number(speed, "speed")
    if not MIN_SPEED <= speed <= 1.0:
        raise InvalidValueError(
            "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the limits to use"
        ).coded("span", low=f"{MIN_SPEED:g}", high="1")
    if path.distance == 0.0:
        return stationary_motion(q, speed=speed)
    bounds = _bounds(model, LIMIT_MARGIN * speed)
    knots = require_path(model, q, path)
    blocked = find_blocked(model.limits.joint, knots)
    if blocked is not None:
        row, error = blocked
        raise path_error(path, row / (len(knots) - 1), error)
    allowed = _path_bounds(path, knots, bounds)
    fastest, slowdown = FastestLaw(allowed), np.ones(len(allowed.knots))
    reversal = _longest_reversal(bounds, path, allowed.knots, fastest.slowed(slowdown))
    cycles = max(2, math.ceil(reversal / CYCLE_TIME))
    worst = 0.0
    for attempt in range(2 * _ROUNDS):
        law = smooth_law(allowed.knots, fastest.slowed(slowdown), cycles)
        rows = _rows_along(model, q, path, law.s)
        excess = _excess(bounds, path, rows, law.s)
        if excess.max() <= 1.0:
            coefficients, excess = np.empty((len(rows) - 1, model.n, 6)), np.zeros(len(rows) - 1)
            for block, powers in _quintics(model, path, rows, law):
                coefficients[block] = np.stack(powers, axis=2)
                excess[block] = _excess_between(bounds, powers)
            if excess.max() <= 1.0:
                _require_inside(model, path, rows, law.s)
                curve = _joined(coefficients)
                return Motion(polynomial=curve, goal=rows[-1], law="jerk_limited", speed=speed)
        worst = float(law.s[excess.argmax()])
        # If local slowdowns only move the excess, slow down the whole path.
        if attempt < _ROUNDS:
            factor = np.ones(len(law.s))
            factor[: len(excess)] = np.maximum(excess * excess * OVERCORRECTION, 1.0)
            slowdown *= spread(factor, law.s, allowed.knots, cycles + 3)
        else:
            slowdown *= float(excess.max()) * OVERCORRECTION
        if slowdown.max() > _MAX_SLOWDOWN:
            break
    reason = "the joints would have to jump, because a singularity is close; move the tool around it"
    raise path_error(path, worst, PlanningError(reason).coded("jump"))


def curve_through(model: RobotModel, path: Path, rows: JointPath, law: TimeParametrization) -> PiecewisePolynomial:
    """Returns the curve through joint angles along a path, between standstills, with continuous acceleration.

    Args:
        model: The arm, with its tool.
        path: The path.
        rows: Joint angles at every cycle of the law, shape (N, n), N >= 2, [rad].
        law: Position and rate of each row on the path.
    """
    coefficients = np.empty((len(rows) - 1, model.n, 6))
    for block, powers in _quintics(model, path, rows, law):
        coefficients[block] = np.stack(powers, axis=2)
    return _joined(coefficients)


def require_path(model: RobotModel, q: JointVector, path: Path) -> JointPath:
    """Returns the joint angles at evenly spaced knots of a path that can be followed, shape (M + 1, n), [rad].

    Raises:
        PlanningError: A pose on the path is out of reach, or a joint limit or a singularity is in the way.
    """
    for knots in (_KNOTS, _FINE_KNOTS):
        shares = np.linspace(0.0, 1.0, knots + 1)
        span = f"on {100.0 / knots:g} % of the path"
        rows, infeasible = solve_path(model, q, path, shares, np.full(model.n, _MAX_STEP), span)
        if infeasible is None:
            return rows
        if not infeasible.is_singular:
            break
    raise path_error(path, float(shares[infeasible.row]), infeasible.reason)


def _rows_along(model: RobotModel, q: JointVector, path: Path, shares: Array) -> JointPath:
    """Returns the joint angles along a path that can be followed, the first ones q, shape (N, n), [rad]."""
    rows = np.empty((model.n, len(shares))).T
    rows[0] = q
    for block in blocks(len(shares)):
        # From the previous row on, so that every step is covered.
        block = slice(max(block.start - 1, 0), block.stop)
        rows[block] = inverse_path(model, *path.sample(shares[block]), rows[block.start])[0]
    rows[0] = q
    return rows


def _require_inside(model: RobotModel, path: Path, rows: JointPath, shares: Array) -> None:
    """Requires rows inside the joint limits between the knots, too."""
    limits = model.limits.joint
    outside = np.argwhere(~((limits.lower < rows) & (rows < limits.upper)))
    if outside.size:
        row, joint = outside[0].tolist()
        raise path_error(path, float(shares[row]), limit_touched(limits, joint + 1, float(rows[row, joint])))


def _bounds(model: RobotModel, part: float) -> _Bounds:
    joint, tool, arm_angle = model.limits.joint, model.limits.cartesian, model.limits.arm_angle
    elbow = [] if arm_angle is None else [(arm_angle.velocity, arm_angle.acceleration, arm_angle.jerk)]
    extra = np.array([*elbow, (tool.rotation_velocity, tool.rotation_acceleration, tool.rotation_jerk)])
    return _Bounds(
        velocity=part * np.concatenate((joint.velocity, extra[:, 0])),
        acceleration=part * np.concatenate((joint.acceleration, extra[:, 1])),
        jerk=LIMIT_MARGIN * np.concatenate((joint.jerk, extra[:, 2])),
        tool=(
            part * tool.translation_velocity,
            part * tool.translation_acceleration,
            LIMIT_MARGIN * tool.translation_jerk,
        ),
        ends=None if joint.near_ends is None else joint,
    )


def _longest_reversal(bounds: _Bounds, path: Path, knots: Array, squares: Array) -> float:
    """Returns the longest time from full deceleration to full acceleration, [s].

    The tool's is that of the acceleration on this path: an xArm's tool may have 50 m/s^2, more than its joints allow,
    which would take 1 s to reverse.

    Args:
        bounds: Bounds of joints and tool.
        path: The path.
        knots: Values of s, shape (K + 1,).
        squares: Largest squares of s' at the knots, shape (K + 1,), [1/s^2].
    """
    _, acceleration, jerk = bounds.tool
    along, toward = (float(np.abs(rows).max()) for rows in _tool_rows(path))
    rate_change = float(np.abs(np.diff(squares) / (2.0 * np.diff(knots))).max())
    reached = min(acceleration, along * rate_change + toward * float(squares.max()))
    return 2.0 * max(float((bounds.acceleration / bounds.jerk).max()), reached / jerk)


def _columns(path: Path, rows: JointPath, shares: Array) -> Array:
    """Returns joint angles, the arm angle if there is one, and the tool's rotation along a path, shape (N, m), [rad].

    A rotation through a via orientation has rows of its own (`_turn_rows`) and is zero here.
    """
    turn = 0.0 if _has_via_orientation(path) else path.turn
    if path.psi_start is None or path.psi_goal is None:
        return np.vstack((rows.T, turn * shares)).T
    return np.vstack((rows.T, (path.psi_goal - path.psi_start) * shares, turn * shares)).T


def _has_via_orientation(path: Path) -> bool:
    return isinstance(path.turning, ViaOrientation)


def _path_bounds(path: Path, knots: JointPath, bounds: _Bounds) -> PathBounds:
    shares = np.linspace(0.0, 1.0, len(knots))
    columns = _columns(path, knots, shares).T
    step = shares[1]
    first = np.gradient(columns, step, axis=1, edge_order=2)
    second = np.empty_like(columns)
    second[:, 1:-1] = (columns[:, 2:] - 2.0 * columns[:, 1:-1] + columns[:, :-2]) / step**2
    second[:, 0], second[:, -1] = second[:, 1], second[:, -2]
    velocity, acceleration, _ = bounds.tool
    along, toward = (np.tile(rows, len(knots)) for rows in _tool_rows(path))
    factor = 1.0 if path.circle is None else POLYGON_FACTOR
    parts = [(first, second, bounds.velocity, bounds.acceleration), (along, toward, velocity, factor * acceleration)]
    if _has_via_orientation(path):
        parts.append((*_turn_rows(path, shares), bounds.velocity[-1], POLYGON_FACTOR * bounds.acceleration[-1]))
    firsts, seconds, velocities, accelerations = zip(*parts, strict=True)
    sizes = [np.full(len(rows), limit) for rows, limit in zip(firsts, velocities, strict=True)]
    first = np.vstack(firsts)
    fastest = (np.concatenate(sizes)[:, np.newaxis] / np.maximum(np.abs(first), MIN_SLOPE)).min(axis=0)
    if bounds.ends is not None:
        slopes = first[: knots.shape[1]].T
        allowed = LIMIT_MARGIN * bounds_along(bounds.ends, knots, slopes)
        np.minimum(fastest, (allowed / np.maximum(np.abs(slopes), MIN_SLOPE)).min(axis=1), out=fastest)
    limits = [np.full(len(rows), limit) for rows, limit in zip(firsts, accelerations, strict=True)]
    return path_bounds(shares, first, np.vstack(seconds), np.concatenate(limits)[:, np.newaxis], fastest)


def _tool_rows(path: Path) -> tuple[Array, Array]:
    """Returns the tool's path derivatives as rows that bound their norm, each of shape (1 or sides, 1), [m]."""
    if path.circle is None:
        return np.full((1, 1), math.dist(path.start.parts[1], path.goal.parts[1])), np.zeros((1, 1))
    # Along the path, and towards the centre.
    return half_planes(np.array([[path.distance, 0.0]]), np.array([[0.0, path.distance * path.circle.angle]]))


def _turn_rows(path: Path, shares: Array) -> tuple[Array, Array]:
    """Returns the derivatives of a non-uniform rotation as rows that bound its norm, (sides, K + 1) each, [rad].

    With the rotation velocity w by the share, the acceleration is w s'' + dw s'^2.
    """
    R = path.sample(np.concatenate((shares[:1] - shares[1], shares, shares[-1:] + shares[1])))[0][:, :3, :3]
    turns = turns_between(R) / shares[1]
    return half_planes(0.5 * (turns[1:] + turns[:-1]), np.diff(turns, axis=0) / shares[1])


def _excess(bounds: _Bounds, path: Path, rows: JointPath, shares: Array) -> Array:
    """Returns the slowdown that each row needs to be inside every bound, shape (N,); 1 or less is inside."""
    last = len(rows) - 1
    excess = np.zeros(len(rows) + 3)
    limits = (bounds.velocity, bounds.acceleration, bounds.jerk)
    for block in blocks(len(excess)):
        # With the three previous rows; before the first and after the last row there are three cycles of standstill.
        clamped = np.clip(np.arange(block.start - 3, block.stop), 0, last)
        u = shares[clamped]
        column, position = _columns(path, rows[clamped], u).T, path.positions(u).T
        for order, (limit, tool_limit) in enumerate(zip(limits, bounds.tool, strict=True), start=1):
            column, position = np.diff(column), np.diff(position)
            span = CYCLE_TIME**order
            joints = (np.abs(column) / (span * limit)[:, np.newaxis]).max(axis=0)
            tool = np.sqrt((position * position).sum(axis=0)) / (span * tool_limit)
            ratio = np.maximum(joints, tool)
            if order == 1 and bounds.ends is not None:
                np.maximum(ratio, end_excess(bounds.ends, rows[clamped]), out=ratio)
            _accumulate(excess[block], ratio, order)
        if _has_via_orientation(path):
            turn = turns_between(path.sample(u)[0][:, :3, :3]).T
            for order, limit in enumerate(limits, start=1):
                _accumulate(excess[block], np.sqrt((turn * turn).sum(axis=0)) / (CYCLE_TIME**order * limit[-1]), order)
                turn = np.diff(turn)
    excess[last] = excess[last:].max()
    return excess[: last + 1]


def _accumulate(excess: Array, ratio: Array, order: int) -> None:
    """Includes the excess of backward differences; those of order n grow with the speed to the power n."""
    np.maximum(excess, ratio[3 - order :] ** (1.0 / order), out=excess)


def _excess_between(bounds: _Bounds, powers: list[Array]) -> Array:
    """Returns the slowdown that each cycle needs to be inside the joints' bounds, shape (N - 1,)."""
    excess = np.zeros(len(powers[0]))
    limits = bounds.velocity, bounds.acceleration, bounds.jerk
    for order, (limit, largest) in enumerate(zip(limits, peak_derivatives(powers), strict=True), start=1):
        np.maximum(excess, (largest / limit[: largest.shape[1]]).max(axis=1) ** (1.0 / order), out=excess)
    return excess


def _quintics(
    model: RobotModel, path: Path, rows: JointPath, law: TimeParametrization
) -> Iterator[tuple[slice, list[Array]]]:
    """Yields the curve through the rows with the path's velocities and accelerations, block by block.

    Yields:
        A block of its N - 1 cycles, and their coefficients by ascending power, each of shape (cycles, n).
    """
    last: tuple[Array, ...] = ()
    for block in blocks(len(rows) - 1):
        ends = slice(block.start, block.stop + 1)
        here, u = rows[ends], law.s[ends]
        step = np.maximum(law.ds[ends] * _DIFFERENCE_TIME, _MIN_DIFFERENCE_STEP)
        before, after = (inverse_path(model, *path.sample(u + side), here[0])[0] for side in (-step, step))
        state = central_state(before, here, after, step=step[:, np.newaxis])
        for derivative, row in zip(state[1:], last, strict=False):
            derivative[0] = row  # As at the end of the previous block, where the inverse may be rounded differently.
        last = tuple(derivative[-1].copy() for derivative in state[1:])
        yield block, cycle_quintics(state, law, ends)


def _joined(coefficients: Array) -> PiecewisePolynomial:
    breaks = np.arange(len(coefficients) + 1, dtype=np.float64) * CYCLE_TIME
    return PiecewisePolynomial(breaks, make_readonly(coefficients))
