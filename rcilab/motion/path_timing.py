"""The jerk-limited motion along a path of the tool: as fast as joints, tool and arm angle allow.

Paths are followed by the closed-form inverse at every cycle, so the tool is on the path to rounding; between the cycles
the joints run as quintics with the path's own velocities and accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector, as_number, make_readonly
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import LIMIT_MARGIN, limit_touched
from rcilab.motion.hermite import quintic
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.joint import MIN_SPEED
from rcilab.motion.motion import Motion, standing
from rcilab.motion.orientation_path import ViaOrientation, turns_between
from rcilab.motion.path import Path
from rcilab.motion.path_bounds import LEAST, ROUNDNESS, PathBounds, half_planes, path_bounds
from rcilab.motion.path_infeasibility import examine, refusal
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.rows import blocks, spread
from rcilab.motion.time_parametrization import FastestLaw, TimeParametrization, smooth_law

_KNOTS = 500
"""Steps of the path between which bounds are interpolated. Tuning value: two millimetres of a line of a metre."""
_FINE_KNOTS = 4000
"""The same close to a singularity, where joints turn fast on a short way. Tuning value: the law then takes 50 ms."""
_STEP = 0.1
"""Rotation of a joint from knot to knot that can only be caused by a singularity, [rad]: 50 rad on the whole path, more
than any arm can turn."""
_ROUNDS = 8
"""How often to slow down a law locally where it exceeds a limit, and then as a whole. Measured: 1 to 5 locally."""
_SLOWEST = 4.0
"""A larger excess of a limit is caused by a jump, not by the interpolation between the knots. Tuning value."""
_INSTANTS = (0.25, 0.5, 0.75)
"""Instants of a cycle at which the curve is checked besides its start, in cycles."""
_HASTE = 1.002
"""Factor on the square of the required slowdown, applied also closely below a limit, so that few rounds are needed: 1
or 2 on nine of ten paths. Tuning value; motions become 0.06 % longer."""
_NUDGE = 1e-4
"""Share of the way over which derivatives by the way are formed. Tuning value: both their errors are below 1e-7."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Bounds:
    """Bounds of n joints, the arm angle if there is one, and the tool's turn: one a column, shape (m,)."""

    velocity: Array
    acceleration: Array
    jerk: Array
    tool: tuple[float, float, float]
    """Of the tool's translation: velocity, acceleration, jerk."""


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
        PlanningError: A pose on the way is out of reach, or a joint limit or a singularity is in the way.
        InvalidValueError: The speed is out of range.
    """
    speed = as_number(speed, "speed")
    if not MIN_SPEED <= speed <= 1.0:
        raise InvalidValueError(
            "speed", speed, f"must be from {MIN_SPEED:g} to 1: the part of the limits to use"
        ).coded("span", low=f"{MIN_SPEED:g}", high="1")
    if path.distance == 0.0:
        return standing(q, speed=speed)
    bounds = _bounds(model, LIMIT_MARGIN * speed)
    allowed = _path_bounds(path, require_path(model, q, path), bounds)
    cycles = max(2, math.ceil(_longest_reversal(bounds) / CYCLE_TIME))
    fastest, slowdown = FastestLaw(allowed), np.ones(len(allowed.knots))
    worst = 0.0
    for round_ in range(2 * _ROUNDS):
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
        # Where slowing down in places only shifts what is too fast, the whole way is slowed down.
        if round_ < _ROUNDS:
            factor = np.ones(len(law.s))
            factor[: len(excess)] = np.maximum(excess * excess * _HASTE, 1.0)
            slowdown *= spread(factor, law.s, allowed.knots, cycles + 3)
        else:
            slowdown *= float(excess.max()) * _HASTE
        if slowdown.max() > _SLOWEST:
            break
    reason = "the joints would have to jump, because a singularity is close; lead the tool around it"
    raise refusal(path, worst, PlanningError(reason).coded("jump"))


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
        PlanningError: A pose on the way is out of reach, or a joint limit or a singularity is in the way.
    """
    for knots in (_KNOTS, _FINE_KNOTS):
        shares = np.linspace(0.0, 1.0, knots + 1)
        span = f"on {100.0 / knots:g} % of the way"
        rows, obstacle = examine(model, q, path, shares, np.full(model.n, _STEP), span)
        if obstacle is None:
            return rows
        if not obstacle.is_singular:
            break
    raise refusal(path, float(shares[obstacle.row]), obstacle.reason)


def _rows_along(model: RobotModel, q: JointVector, path: Path, shares: Array) -> JointPath:
    """Returns the joint angles along a path that can be followed, the first ones q, shape (N, n), [rad]."""
    rows = np.empty((model.n, len(shares))).T
    rows[0] = q
    for block in blocks(len(shares)):
        # From the row before on, so that none of a path's steps is overlooked.
        block = slice(max(block.start - 1, 0), block.stop)
        rows[block] = inverse_path(model, *path.sample(shares[block]), rows[block.start])[0]
    rows[0] = q
    return rows


def _require_inside(model: RobotModel, path: Path, rows: JointPath, shares: Array) -> None:
    """Refuses rows that touch a joint limit between the knots."""
    limits = model.limits.joint
    outside = np.argwhere(~((limits.lower < rows) & (rows < limits.upper)))
    if outside.size:
        row, joint = outside[0].tolist()
        raise refusal(path, float(shares[row]), limit_touched(limits, joint + 1, float(rows[row, joint])))


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
    )


def _longest_reversal(bounds: _Bounds) -> float:
    """Returns the longest time from full deceleration to full acceleration, [s]."""
    _, acceleration, jerk = bounds.tool
    return 2.0 * max(float((bounds.acceleration / bounds.jerk).max()), acceleration / jerk)


def _columns(path: Path, rows: JointPath, shares: Array) -> Array:
    """Returns joint angles, the arm angle if there is one, and the tool's turn along a path, shape (N, m), [rad].

    A turn that is not even has rows of its own (`_turn_rows`) and is left out here, as zeros.
    """
    turn = 0.0 if _turns_unevenly(path) else path.turn
    if path.psi_start is None or path.psi_goal is None:
        return np.vstack((rows.T, turn * shares)).T
    return np.vstack((rows.T, (path.psi_goal - path.psi_start) * shares, turn * shares)).T


def _turns_unevenly(path: Path) -> bool:
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
    round_ = 1.0 if path.circle is None else ROUNDNESS
    parts = [(first, second, bounds.velocity, bounds.acceleration), (along, toward, velocity, round_ * acceleration)]
    if _turns_unevenly(path):
        parts.append((*_turn_rows(path, shares), bounds.velocity[-1], ROUNDNESS * bounds.acceleration[-1]))
    firsts, seconds, velocities, accelerations = zip(*parts, strict=True)
    sizes = [np.full(len(rows), limit) for rows, limit in zip(firsts, velocities, strict=True)]
    first = np.vstack(firsts)
    fastest = (np.concatenate(sizes)[:, np.newaxis] / np.maximum(np.abs(first), LEAST)).min(axis=0)
    limits = [np.full(len(rows), limit) for rows, limit in zip(firsts, accelerations, strict=True)]
    return path_bounds(shares, first, np.vstack(seconds), np.concatenate(limits)[:, np.newaxis], fastest)


def _tool_rows(path: Path) -> tuple[Array, Array]:
    """Returns the tool's path derivatives as rows that bound their norm, each of shape (1 or sides, 1), [m]."""
    if path.circle is None:
        return np.full((1, 1), math.dist(path.start.parts[1], path.goal.parts[1])), np.zeros((1, 1))
    # Along the way, and towards the centre.
    return half_planes(np.array([[path.distance, 0.0]]), np.array([[0.0, path.distance * path.circle.angle]]))


def _turn_rows(path: Path, shares: Array) -> tuple[Array, Array]:
    """Returns the path derivatives of an uneven turn as rows that bound its norm, each of shape (sides, K + 1), [rad].

    In the plane of its rotation velocity w by the share and of dw the acceleration is w s'' + dw s'^2.
    """
    R = path.sample(np.concatenate((shares[:1] - shares[1], shares, shares[-1:] + shares[1])))[0][:, :3, :3]
    turns = turns_between(R) / shares[1]
    return half_planes(0.5 * (turns[1:] + turns[:-1]), np.diff(turns, axis=0) / shares[1])


def _excess(bounds: _Bounds, path: Path, rows: JointPath, shares: Array) -> Array:
    """Returns the slowdown that each row needs to keep every bound, shape (N,); 1 or less keeps them."""
    last = len(rows) - 1
    excess = np.zeros(len(rows) + 3)
    limits = (bounds.velocity, bounds.acceleration, bounds.jerk)
    for block in blocks(len(excess)):
        # With the three rows before; the first one has stood, and the last one stands, for three more cycles.
        held = np.clip(np.arange(block.start - 3, block.stop), 0, last)
        u = shares[held]
        column, position = _columns(path, rows[held], u).T, path.positions(u).T
        for order, (limit, tool_limit) in enumerate(zip(limits, bounds.tool, strict=True), start=1):
            column, position = np.diff(column), np.diff(position)
            span = CYCLE_TIME**order
            joints = (np.abs(column) / (span * limit)[:, np.newaxis]).max(axis=0)
            tool = np.sqrt((position * position).sum(axis=0)) / (span * tool_limit)
            _raise(excess[block], np.maximum(joints, tool), order)
        if _turns_unevenly(path):
            turn = turns_between(path.sample(u)[0][:, :3, :3]).T
            for order, limit in enumerate(limits, start=1):
                _raise(excess[block], np.sqrt((turn * turn).sum(axis=0)) / (CYCLE_TIME**order * limit[-1]), order)
                turn = np.diff(turn)
    excess[last] = excess[last:].max()
    return excess[: last + 1]


def _raise(excess: Array, ratio: Array, order: int) -> None:
    """Includes the excess of backward differences; one of order n grows with the speed to the power n."""
    np.maximum(excess, ratio[3 - order :] ** (1.0 / order), out=excess)


def _excess_between(bounds: _Bounds, powers: list[Array]) -> Array:
    """Returns the slowdown that each cycle needs to keep the joints' bounds, shape (N - 1,)."""
    excess = np.zeros(len(powers[0]))
    for order, limit in enumerate((bounds.velocity, bounds.acceleration, bounds.jerk), start=1):
        powers = [float(p) * powers[p] for p in range(1, len(powers))]
        largest = np.abs(powers[0])
        for part in _INSTANTS:
            value = powers[-1].copy("K")
            for coefficient in reversed(powers[:-1]):
                value *= part * CYCLE_TIME
                value += coefficient
            np.maximum(largest, np.abs(value), out=largest)
        np.maximum(excess, (largest / limit[: largest.shape[1]]).max(axis=1) ** (1.0 / order), out=excess)
    return excess


def _quintics(
    model: RobotModel, path: Path, rows: JointPath, law: TimeParametrization
) -> Iterator[tuple[slice, list[Array]]]:
    """Yields the curve through the rows with the path's velocities and accelerations: continuous in both.

    Yields:
        Some of its N - 1 cycles, and their coefficients by ascending power, each of shape (cycles, n).
    """
    last = len(rows) - 1
    h = CYCLE_TIME
    for block in blocks(last):
        ends = slice(block.start, block.stop + 1)
        here, u = rows[ends], law.s[ends]
        before, after = (inverse_path(model, *path.sample(u + side), here[0])[0] for side in (-_NUDGE, _NUDGE))
        first, second = (after - before) / (2.0 * _NUDGE), (after - 2.0 * here + before) / _NUDGE**2
        du, ddu = law.ds[ends, np.newaxis], law.dds[ends, np.newaxis]
        v = first * du
        a = second * du**2 + first * ddu
        if block.start == 0:
            v[0] = a[0] = 0.0
        if block.stop == last:
            v[-1] = a[-1] = 0.0
        parts = quintic((here[:-1], v[:-1], a[:-1]), (here[1:], v[1:], a[1:]), h)
        yield block, [part / h**power for power, part in enumerate(parts)]


def _joined(coefficients: Array) -> PiecewisePolynomial:
    breaks = np.arange(len(coefficients) + 1, dtype=np.float64) * CYCLE_TIME
    return PiecewisePolynomial(breaks, make_readonly(coefficients))
