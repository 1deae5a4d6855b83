"""Segments and blends as one curve of a parameter s, continuous up to the second derivative.

Every blend has length 1 in s, and between two blends the rate of a segment's share changes smoothly from the one that
the first blend needs to that of the second. Small and large radii, metres and radians thus share one parameter. Paths
of the tool are inverted at closely spaced knots, with their first two derivatives; the quintics between the knots are
accurate to far below a micrometre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.errors import PlanningError, RcilabError
from rcilab.model.robot_model import RobotModel
from rcilab.motion.blend import LENGTH, Blend
from rcilab.motion.hermite import DIFFERENCE_STEP, State, central_state, derivative, evaluate, quintic
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.segment import Segment

_BODY_KNOTS = 24
"""Smallest number of knots on a segment. Tuning value: the fastest time law switches at knots."""
_BLEND_KNOTS = 16
_MOST_KNOTS = 4000
_MAX_STEP = 0.03
"""Intended step of a joint from knot to knot, [rad]. Tuning value: the tool is then within a nanometre of its path."""
_MAX_JUMP = 0.3
"""A larger step of a joint from knot to knot is caused by a singularity, [rad]."""


Rows: TypeAlias = NDArray[np.intp]
"""One index per row, shape (N,)."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SegmentSpline:
    """A curve in s with C columns: joint angles, arm angle, position of the tool and integral of its rotation.

    The derivative of the last three columns is the tool's rotation by s, in base axes. On joint moves and the blends
    next to them only the joint angles are valid.
    """

    knots: Array
    """Values of s, shape (K + 1,), increasing, first 0."""
    powers: tuple[Array, ...]
    """Coefficients by ascending power of s since the knot, each of shape (K, C)."""
    n: int
    """Number of joints."""
    moves_tool: Array
    """Whether the limits on tool and arm angle apply, 1 or 0, for each interval, shape (K,)."""
    speed: Array
    """Part of the limits to use, for each interval, shape (K,)."""
    corners: Array
    """Values of s at which one segment ends and the next begins, shape (segments - 1,)."""
    segments: tuple[Segment, ...]

    def sample(self, s: Array, columns: slice = slice(None)) -> State:
        """Returns values and first two derivatives of some columns, or all, each of shape (N, number of columns)."""
        c, tau = self._at(s, columns)
        first = c[1] + tau * (2.0 * c[2] + tau * (3.0 * c[3] + tau * (4.0 * c[4] + tau * (5.0 * c[5]))))
        second = 2.0 * c[2] + tau * (6.0 * c[3] + tau * (12.0 * c[4] + tau * (20.0 * c[5])))
        return _horner(c, tau), first, second

    def values(self, s: Array, columns: slice) -> Array:
        """Returns the values of some columns, shape (N, number of columns)."""
        return _horner(*self._at(s, columns))

    def _at(self, s: Array, columns: slice) -> tuple[list[Array], Array]:
        interval = self.interval(s)
        return [power[:, columns][interval] for power in self.powers], (s - self.knots[interval])[:, np.newaxis]

    def interval(self, s: Array) -> Rows:
        """Returns the index of the interval of each s, shape (N,)."""
        return np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.knots) - 2)

    def segment_at(self, s: float) -> Segment:
        """Returns the segment at s."""
        return self.segments[int(np.searchsorted(self.corners, s, side="right"))]

    def describe_position(self, s: float) -> str:
        """Returns segment and tool position at s as text."""
        segment = self.segment_at(s)
        x, y, z = self.sample(np.array([s]))[0][0, self.n + 1 : self.n + 4].tolist()
        return segment.label if segment.path is None else f"{segment.label}, tool at {x:.3f}, {y:.3f}, {z:.3f} m"


def _horner(c: list[Array], tau: Array) -> Array:
    return c[0] + tau * (c[1] + tau * (c[2] + tau * (c[3] + tau * (c[4] + tau * c[5]))))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Piece:
    """A segment between its blends, or a blend, sampled at its knots."""

    segment: Segment
    """For a blend the previous segment."""
    blend: Blend | None
    length: float
    """Length in s."""
    local: Array
    """Share of the segment or the blend at the knots, shape (k + 1,)."""
    rate: Array
    """First derivative of the share by s."""
    change: Array
    """Second derivative of the share by s."""
    s: Array
    """Values of s at the knots, from the start of the piece."""
    speed: float

    @property
    def moves_tool(self) -> bool:
        return self.segment.path is not None if self.blend is None else self.blend.corner is not None

    def poses(self, local: Array) -> tuple[Array, Array]:
        if self.blend is not None:
            return self.blend.poses(local)
        assert self.segment.path is not None
        T, psi = self.segment.path.sample(local)
        return T, np.zeros(len(T)) if psi is None else psi


def build_segment_spline(
    model: RobotModel, segments: list[Segment], blends: list[Blend], scale: float
) -> SegmentSpline:
    """Returns the spline of segments that are joined by blends.

    Args:
        model: The arm, with its tool.
        segments: The segments, two or more.
        blends: The blends between them.
        scale: Factor on the segments' speeds.

    Raises:
        PlanningError: A blend is out of reach or close to a singularity; the message names the waypoint.
    """
    pieces = _pieces(segments, blends, scale)
    columns = model.n + 7
    counts = [len(piece.s) - 1 for piece in pieces]
    ends = np.cumsum([0, *counts])
    states = tuple(np.zeros((ends[-1] + 1, columns)) for _ in range(3))
    first = 0
    while first < len(pieces):
        last = first + 1
        if pieces[first].moves_tool:
            while last < len(pieces) and pieces[last].moves_tool:
                last += 1
            _write_tool_paths(model, pieces[first:last], states, int(ends[first]))
        else:
            _write_joint_move(pieces[first], states, int(ends[first]))
        first = last
    # The inverse meets both ends only within rounding.
    states[0][0, : model.n], states[0][-1, : model.n] = segments[0].start, segments[-1].goal
    starts = np.concatenate(([0.0], np.cumsum([piece.length for piece in pieces])))
    knots = np.concatenate([[0.0], *(start + piece.s[1:] for start, piece in zip(starts, pieces, strict=False))])
    steps = np.diff(knots)[:, np.newaxis]
    left, right = tuple(state[:-1] for state in states), tuple(state[1:] for state in states)
    powers = quintic((left[0], left[1], left[2]), (right[0], right[1], right[2]), steps)
    corners = [start + LENGTH / 2.0 for start, piece in zip(starts, pieces, strict=False) if piece.blend is not None]
    return SegmentSpline(
        knots=knots,
        powers=tuple(power / steps**order for order, power in enumerate(powers)),
        n=model.n,
        moves_tool=np.repeat([float(piece.moves_tool) for piece in pieces], counts),
        speed=np.repeat([piece.speed for piece in pieces], counts),
        corners=np.array(corners),
        segments=tuple(segments),
    )


def _pieces(segments: list[Segment], blends: list[Blend], scale: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for i, segment in enumerate(segments):
        before, after = (blends[i - 1] if i else None), (blends[i] if i < len(blends) else None)
        start, end = (before.entry_share if before else 0.0), (after.exit_share if after else 1.0)
        speed = scale * segment.waypoint.speed
        if end > start:
            pieces.append(_body(segment, start, end, before, after, speed))
        if after is not None:
            pieces.append(_corner(segment, segments[i + 1], after, min(speed, scale * segments[i + 1].waypoint.speed)))
    return pieces


def _body(
    segment: Segment, start: float, end: float, before: Blend | None, after: Blend | None, speed: float
) -> _Piece:
    """Returns a segment between its blends, whose rates its share takes on at either end."""
    rates = [2.0 * before.entry_share / LENGTH] if before else []
    rates += [2.0 * (1.0 - after.exit_share) / LENGTH] if after else []
    first, last = rates[0], rates[-1]
    length = 2.0 * (end - start) / (first + last)
    peak_ratio = 2.0 * max(first, last) / (first + last)
    x = np.linspace(0.0, 1.0, max(_BODY_KNOTS, _count(_joint_rate(segment) * (end - start) * peak_ratio)) + 1)
    share = start + length * (first * x + (last - first) * x**3 * (1.0 - x / 2.0))
    share[-1] = end
    return _Piece(
        segment=segment, blend=None, length=length, local=share, speed=speed, s=length * x,
        rate=first + (last - first) * x * x * (3.0 - 2.0 * x),
        change=(last - first) * 6.0 * x * (1.0 - x) / length,
    )  # fmt: skip


def _corner(before: Segment, after: Segment, blend: Blend, speed: float) -> _Piece:
    joint_rate = _joint_rate(before) * (1.0 - blend.exit_share) + _joint_rate(after) * blend.entry_share
    part = np.linspace(0.0, 1.0, max(_BLEND_KNOTS, _count(joint_rate)) + 1)
    rate = np.full(len(part), 1.0 / LENGTH)
    return _Piece(
        segment=before, blend=blend, length=LENGTH, local=part, rate=rate, change=np.zeros(len(part)),
        s=LENGTH * part, speed=speed,
    )  # fmt: skip


def _joint_rate(segment: Segment) -> float:
    """Returns the largest rate of a joint by the share, [rad]; 0 in joint space, where no knots are needed."""
    if segment.path is None:
        return 0.0
    return float(np.abs(np.diff(segment.knots, axis=0)).max()) * (len(segment.knots) - 1)


def _count(turn: float) -> int:
    return min(math.ceil(turn / _MAX_STEP), _MOST_KNOTS)


def _write_joint_move(piece: _Piece, states: tuple[Array, ...], row: int) -> None:
    """Writes the states of a joint move, or of a blend in joint space."""
    rows = slice(row, row + len(piece.s))
    n = len(piece.segment.start)
    if piece.blend is None:
        distance = piece.segment.goal - piece.segment.start
        values = piece.segment.start + piece.local[:, np.newaxis] * distance
        firsts, seconds = piece.rate[:, np.newaxis] * distance, piece.change[:, np.newaxis] * distance
    else:
        powers = piece.blend.powers
        slopes = derivative(powers, LENGTH)
        values, firsts = evaluate(powers, piece.local), evaluate(slopes, piece.local)
        seconds = evaluate(derivative(slopes, LENGTH), piece.local)
    for state, found in zip(states, (values, firsts, seconds), strict=True):
        state[rows, :n] = found


def _write_tool_paths(model: RobotModel, pieces: list[_Piece], states: tuple[Array, ...], row: int) -> None:
    """Writes the states of consecutive paths and blends of the tool, on one branch."""
    row_pieces: list[_Piece] = []
    T_parts, psi_parts, rates, changes = [], [], [], []
    for number, piece in enumerate(pieces):
        local = piece.local[1:] if number else piece.local
        T, psi = piece.poses((local[:, np.newaxis] + DIFFERENCE_STEP * np.array([-1.0, 0.0, 1.0])).ravel())
        T_parts.append(T)
        psi_parts.append(psi)
        rates.append(piece.rate[-len(local) :])
        changes.append(piece.change[-len(local) :])
        row_pieces += [piece] * len(local)
    T, psi = np.concatenate(T_parts), np.asarray(np.unwrap(np.concatenate(psi_parts)), np.float64)
    first_share = pieces[0].local[0] if pieces[0].blend is None else pieces[0].blend.exit_share
    joints_near = pieces[0].segment.joints_near(float(first_share))
    q, branch_end = inverse_path(model, T, psi if model.redundancy else None, joints_near)
    if branch_end is not None:
        raise _path_error(row_pieces[branch_end.row // 3], T[branch_end.row], branch_end.reason)
    jumps = np.abs(np.diff(q[1::3], axis=0)).max(axis=1, initial=0.0)
    if jumps.size and jumps.max() > _MAX_JUMP:
        index = int(jumps.argmax()) + 1
        reason = "the joints would have to jump, because a singularity is close; move the tool around it"
        raise _path_error(row_pieces[index], T[3 * index + 1], PlanningError(reason).coded("jump"))
    rate, change = np.concatenate(rates)[:, np.newaxis], np.concatenate(changes)[:, np.newaxis]
    rows = slice(row, row + len(row_pieces))
    n = model.n
    table = np.hstack((q, psi[:, np.newaxis], T[:, :3, 3])).reshape(len(row_pieces), 3, n + 4)
    here, slope, bend = central_state(table[:, 0], table[:, 1], table[:, 2])
    states[0][rows, : n + 4] = here
    states[1][rows, : n + 4] = slope * rate
    states[2][rows, : n + 4] = slope * change + bend * rate**2
    back, ahead = _turns(T[0::3], T[1::3]), _turns(T[1::3], T[2::3])
    slope, bend = (ahead + back) / (2.0 * DIFFERENCE_STEP), (ahead - back) / DIFFERENCE_STEP**2
    states[1][rows, n + 4 :] = slope * rate
    states[2][rows, n + 4 :] = slope * change + bend * rate**2
    steps = np.concatenate([np.diff(piece.s) for piece in pieces])[:, np.newaxis]
    turn_rate, turn_acceleration = states[1][rows, n + 4 :], states[2][rows, n + 4 :]
    # Euler-Maclaurin formula: the trapezoidal rule with its first correction.
    sums = (
        steps * (turn_rate[:-1] + turn_rate[1:]) / 2.0
        + steps**2 * (turn_acceleration[:-1] - turn_acceleration[1:]) / 12.0
    )
    states[0][row + 1 : row + len(row_pieces), n + 4 :] = np.cumsum(sums, axis=0)


def _turns(before: Array, after: Array) -> Array:
    """Returns the small rotation vectors from poses to poses, in base axes, shape (N, 3), [rad]."""
    R = after[:, :3, :3] @ before[:, :3, :3].transpose(0, 2, 1)
    return np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1) / 2.0


def _path_error(piece: _Piece, T: Array, reason: RcilabError) -> PlanningError:
    x, y, z = T[:3, 3].tolist()
    where = f"with the tool at {x:.3f}, {y:.3f}, {z:.3f} m"
    facts: dict[str, object] = {"number": piece.segment.number, "kind": piece.segment.waypoint.type, "reason": reason}
    facts["place"] = (float(x), float(y), float(z))
    if piece.blend is None:
        return PlanningError(
            f"{piece.segment.label}: cannot be followed {where}: {reason}", waypoint=piece.segment.number
        ).coded("way", **facts)
    return PlanningError(
        f"{piece.segment.label}: its blend cannot be followed {where}: {reason}, or use a smaller blend radius",
        waypoint=piece.segment.number,
    ).coded("blend", **facts)


def knot_derivatives(spline: SegmentSpline) -> tuple[Array, Array, Array]:
    """Returns the derivatives by s at the knots, (K + 1, C) each; of the third the larger size of both sides."""
    steps = np.diff(spline.knots)[:, np.newaxis]
    _, first, second = spline.sample(spline.knots)
    start = np.abs(6.0 * spline.powers[3])
    end = np.abs(6.0 * spline.powers[3] + steps * (24.0 * spline.powers[4] + steps * (60.0 * spline.powers[5])))
    third = np.zeros_like(first)
    third[:-1] = start
    np.maximum(third[1:], end, out=third[1:])
    return first, second, third
