"""Segments and blends in a chain: joint angles as one curve of a parameter s, continuous up to the second derivative.

Every blend has length 1 in s, and a segment's share runs from blend to blend at the rate that each of them needs, so
that small and large radii, metres and radians meet in one measure. Paths of the tool are inverted at knots close to
each other, with their first two derivatives; in between, quintics are exact to far below a micrometre.
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
from rcilab.motion.hermite import State, derived, evaluate, quintic
from rcilab.motion.inverse_path import inverse_path
from rcilab.motion.segment import Segment

_BODY_KNOTS = 24
"""Fewest knots on a segment. Tuning value: the fastest law switches at knots."""
_BLEND_KNOTS = 16
_MOST_KNOTS = 4000
_TURN = 0.03
"""Turn of a joint from knot to knot to aim at, [rad]. Tuning value: the tool is then within a nanometre of its path."""
_JUMP = 0.3
"""The same beyond which a singularity is in the way, [rad]."""
_NUDGE = 3e-4
"""Part of a segment or blend over which derivatives are formed. Tuning value: both their errors are below 1e-7."""


Rows: TypeAlias = NDArray[np.intp]
"""One index a row, shape (N,)."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SegmentSpline:
    """A curve in s through C columns: joint angles, arm angle, the tool's position and its turn summed up.

    The turn's derivative is the tool's rotation by s, in base axes. On joint moves and beside them only the joint
    angles mean something.
    """

    knots: Array
    """Values of s, shape (K + 1,), increasing, first 0."""
    powers: tuple[Array, ...]
    """Coefficients by ascending power of s since the knot, each of shape (K, C)."""
    n: int
    """Number of joints."""
    leads_tool: Array
    """Whether the tool's and the arm angle's limits count, 1 or 0, for each interval, shape (K,)."""
    speed: Array
    """Part of the limits to use, for each interval, shape (K,)."""
    middles: Array
    """Values of s at the corners, where one segment counts as ended, shape (segments - 1,)."""
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
        """Returns in which interval each s is, shape (N,)."""
        return np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, len(self.knots) - 2)

    def segment_at(self, s: float) -> Segment:
        """Returns the segment that this is on."""
        return self.segments[int(np.searchsorted(self.middles, s, side="right"))]

    def place(self, s: float) -> str:
        """Returns where that is, for people."""
        segment = self.segment_at(s)
        x, y, z = self.sample(np.array([s]))[0][0, self.n + 1 : self.n + 4].tolist()
        return segment.label if segment.path is None else f"{segment.label}, tool at {x:.3f}, {y:.3f}, {z:.3f} m"


def _horner(c: list[Array], tau: Array) -> Array:
    return c[0] + tau * (c[1] + tau * (c[2] + tau * (c[3] + tau * (c[4] + tau * c[5]))))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Piece:
    """A segment between its blends, or a blend, sampled at its knots."""

    segment: Segment
    """The blend's is the one before."""
    blend: Blend | None
    length: float
    """In s."""
    local: Array
    """Its own parameter at the knots, the share or the part of the blend, shape (k + 1,)."""
    rate: Array
    """Derivative of that by s."""
    change: Array
    """Second derivative of that by s."""
    s: Array
    """Since the start of the piece."""
    speed: float

    @property
    def leads_tool(self) -> bool:
        return self.segment.path is not None if self.blend is None else self.blend.corner is not None

    def poses(self, local: Array) -> tuple[Array, Array]:
        if self.blend is not None:
            return self.blend.poses(local)
        assert self.segment.path is not None
        T, psi = self.segment.path.sample(local)
        return T, np.zeros(len(T)) if psi is None else psi


def build_chain(model: RobotModel, segments: list[Segment], blends: list[Blend], scale: float) -> SegmentSpline:
    """Returns the chain of segments that are joined by blends.

    Args:
        model: The arm, with its tool.
        segments: Two or more.
        blends: One less.
        scale: What to multiply the segments' speeds by.

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
        if pieces[first].leads_tool:
            while last < len(pieces) and pieces[last].leads_tool:
                last += 1
            _lead_tool(model, pieces[first:last], states, int(ends[first]))
        else:
            _turn_joints(pieces[first], states, int(ends[first]))
        first = last
    # The inverse gives both ends to rounding.
    states[0][0, : model.n], states[0][-1, : model.n] = segments[0].start, segments[-1].goal
    starts = np.concatenate(([0.0], np.cumsum([piece.length for piece in pieces])))
    knots = np.concatenate([[0.0], *(start + piece.s[1:] for start, piece in zip(starts, pieces, strict=False))])
    steps = np.diff(knots)[:, np.newaxis]
    left, right = tuple(state[:-1] for state in states), tuple(state[1:] for state in states)
    powers = quintic((left[0], left[1], left[2]), (right[0], right[1], right[2]), steps)
    middles = [start + LENGTH / 2.0 for start, piece in zip(starts, pieces, strict=False) if piece.blend is not None]
    return SegmentSpline(
        knots=knots,
        powers=tuple(power / steps**order for order, power in enumerate(powers)),
        n=model.n,
        leads_tool=np.repeat([float(piece.leads_tool) for piece in pieces], counts),
        speed=np.repeat([piece.speed for piece in pieces], counts),
        middles=np.array(middles),
        segments=tuple(segments),
    )


def _pieces(segments: list[Segment], blends: list[Blend], scale: float) -> list[_Piece]:
    pieces: list[_Piece] = []
    for i, segment in enumerate(segments):
        before, after = (blends[i - 1] if i else None), (blends[i] if i < len(blends) else None)
        start, end = (before.join if before else 0.0), (after.leave if after else 1.0)
        speed = scale * segment.waypoint.speed
        if end > start:
            pieces.append(_body(segment, start, end, before, after, speed))
        if after is not None:
            pieces.append(_corner(segment, segments[i + 1], after, min(speed, scale * segments[i + 1].waypoint.speed)))
    return pieces


def _body(
    segment: Segment, start: float, end: float, before: Blend | None, after: Blend | None, speed: float
) -> _Piece:
    """Returns a segment between its blends; the rate of the share goes smoothly from the one's to the other's."""
    rates = [2.0 * before.join / LENGTH] if before else []
    rates += [2.0 * (1.0 - after.leave) / LENGTH] if after else []
    first, last = rates[0], rates[-1]
    length = 2.0 * (end - start) / (first + last)
    uneven = 2.0 * max(first, last) / (first + last)
    x = np.linspace(0.0, 1.0, max(_BODY_KNOTS, _count(_turning(segment) * (end - start) * uneven)) + 1)
    share = start + length * (first * x + (last - first) * x**3 * (1.0 - x / 2.0))
    share[-1] = end
    return _Piece(
        segment=segment, blend=None, length=length, local=share, speed=speed, s=length * x,
        rate=first + (last - first) * x * x * (3.0 - 2.0 * x),
        change=(last - first) * 6.0 * x * (1.0 - x) / length,
    )  # fmt: skip


def _corner(before: Segment, after: Segment, blend: Blend, speed: float) -> _Piece:
    turning = _turning(before) * (1.0 - blend.leave) + _turning(after) * blend.join
    part = np.linspace(0.0, 1.0, max(_BLEND_KNOTS, _count(turning)) + 1)
    even = np.full(len(part), 1.0 / LENGTH)
    return _Piece(
        segment=before, blend=blend, length=LENGTH, local=part, rate=even, change=np.zeros(len(part)),
        s=LENGTH * part, speed=speed,
    )  # fmt: skip


def _turning(segment: Segment) -> float:
    """Returns the fastest turn of a joint by the share, [rad]; nothing where a straight line needs no knots."""
    if segment.path is None:
        return 0.0
    return float(np.abs(np.diff(segment.knots, axis=0)).max()) * (len(segment.knots) - 1)


def _count(turn: float) -> int:
    return min(math.ceil(turn / _TURN), _MOST_KNOTS)


def _turn_joints(piece: _Piece, states: tuple[Array, ...], row: int) -> None:
    """Writes a joint move, or a blend in joint space; what is at its ends already stays."""
    rows = slice(row, row + len(piece.s))
    n = len(piece.segment.start)
    if piece.blend is None:
        way = piece.segment.goal - piece.segment.start
        values = piece.segment.start + piece.local[:, np.newaxis] * way
        firsts, seconds = piece.rate[:, np.newaxis] * way, piece.change[:, np.newaxis] * way
    else:
        powers = piece.blend.powers
        slopes = derived(powers, LENGTH)
        values, firsts = evaluate(powers, piece.local), evaluate(slopes, piece.local)
        seconds = evaluate(derived(slopes, LENGTH), piece.local)
    for state, found in zip(states, (values, firsts, seconds), strict=True):
        state[rows, :n] = found


def _lead_tool(model: RobotModel, pieces: list[_Piece], states: tuple[Array, ...], row: int) -> None:
    """Writes consecutive paths and blends of the tool, followed on one branch."""
    owners: list[_Piece] = []
    T_parts, psi_parts, rates, changes = [], [], [], []
    for number, piece in enumerate(pieces):
        local = piece.local[1:] if number else piece.local
        T, psi = piece.poses((local[:, np.newaxis] + _NUDGE * np.array([-1.0, 0.0, 1.0])).ravel())
        T_parts.append(T)
        psi_parts.append(psi)
        rates.append(piece.rate[-len(local) :])
        changes.append(piece.change[-len(local) :])
        owners += [piece] * len(local)
    T, psi = np.concatenate(T_parts), np.asarray(np.unwrap(np.concatenate(psi_parts)), np.float64)
    first_share = pieces[0].local[0] if pieces[0].blend is None else pieces[0].blend.leave
    near = pieces[0].segment.near(float(first_share))
    q, loss = inverse_path(model, T, psi if model.redundancy else None, near)
    if loss is not None:
        raise _refusal(owners[loss.row // 3], T[loss.row], loss.reason)
    jumps = np.abs(np.diff(q[1::3], axis=0)).max(axis=1, initial=0.0)
    if jumps.size and jumps.max() > _JUMP:
        place = int(jumps.argmax()) + 1
        reason = "the joints would have to jump, because a singularity is close; lead the tool around it"
        raise _refusal(owners[place], T[3 * place + 1], PlanningError(reason).coded("jump"))
    rate, change = np.concatenate(rates)[:, np.newaxis], np.concatenate(changes)[:, np.newaxis]
    rows = slice(row, row + len(owners))
    n = model.n
    table = np.hstack((q, psi[:, np.newaxis], T[:, :3, 3])).reshape(len(owners), 3, n + 4)
    before, here, after = table[:, 0], table[:, 1], table[:, 2]
    slope, bend = (after - before) / (2.0 * _NUDGE), (after - 2.0 * here + before) / _NUDGE**2
    states[0][rows, : n + 4] = here
    states[1][rows, : n + 4] = slope * rate
    states[2][rows, : n + 4] = slope * change + bend * rate**2
    back, ahead = _turns(T[0::3], T[1::3]), _turns(T[1::3], T[2::3])
    slope, bend = (ahead + back) / (2.0 * _NUDGE), (ahead - back) / _NUDGE**2
    states[1][rows, n + 4 :] = slope * rate
    states[2][rows, n + 4 :] = slope * change + bend * rate**2
    steps = np.concatenate([np.diff(piece.s) for piece in pieces])[:, np.newaxis]
    turned, bent = states[1][rows, n + 4 :], states[2][rows, n + 4 :]
    # Euler-Maclaurin: the trapezoidal rule with its first correction.
    sums = steps * (turned[:-1] + turned[1:]) / 2.0 + steps**2 * (bent[:-1] - bent[1:]) / 12.0
    states[0][row + 1 : row + len(owners), n + 4 :] = np.cumsum(sums, axis=0)


def _turns(before: Array, after: Array) -> Array:
    """Returns the small rotation vectors from poses to poses, in base axes, shape (N, 3), [rad]."""
    R = after[:, :3, :3] @ before[:, :3, :3].transpose(0, 2, 1)
    return np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1) / 2.0


def _refusal(piece: _Piece, T: Array, reason: RcilabError) -> PlanningError:
    x, y, z = T[:3, 3].tolist()
    where = f"with the tool at {x:.3f}, {y:.3f}, {z:.3f} m"
    facts: dict[str, object] = {"number": piece.segment.number, "kind": piece.segment.waypoint.type, "reason": reason}
    facts["place"] = (float(x), float(y), float(z))
    if piece.blend is None:
        return PlanningError(
            f"{piece.segment.label}: cannot be followed {where}: {reason}", waypoint=piece.segment.number
        ).coded("way", **facts)
    return PlanningError(
        f"{piece.segment.label}: its blend cannot be followed {where}: {reason}, or give it a smaller blend radius",
        waypoint=piece.segment.number,
    ).coded("blend", **facts)


def derivatives_at_knots(chain: SegmentSpline) -> tuple[Array, Array, Array]:
    """Returns the derivatives by s at the knots, each of shape (K + 1, C); of the third the size, the larger one's."""
    steps = np.diff(chain.knots)[:, np.newaxis]
    _, first, second = chain.sample(chain.knots)
    start = np.abs(6.0 * chain.powers[3])
    end = np.abs(6.0 * chain.powers[3] + steps * (24.0 * chain.powers[4] + steps * (60.0 * chain.powers[5])))
    third = np.zeros_like(first)
    third[:-1] = start
    np.maximum(third[1:], end, out=third[1:])
    return first, second, third
