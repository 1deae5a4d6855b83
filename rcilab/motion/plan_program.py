"""Planner of programs: one motion through all waypoints, as fast as the limits allow, with blended corners."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointVector, as_number, as_vector, described, make_readonly
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS, require_max_rows
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.blend import Blend, build_blend
from rcilab.motion.cartesian import plan_path
from rcilab.motion.joint import DEFAULT_SPEED, JOINT_LAWS, MIN_SPEED, JointLaw, plan_joint
from rcilab.motion.motion import Motion
from rcilab.motion.motion_event import MotionEvent
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.program import Program
from rcilab.motion.program_expansion import Expansion, expand
from rcilab.motion.s_curve import STANDSTILL_DISTANCE
from rcilab.motion.segment import Segment, build_segments, naming
from rcilab.motion.segment_spline import build_segment_spline
from rcilab.motion.segment_spline_motion import plan_segment_spline
from rcilab.motion.torque_rate import plan_within_torque_rate
from rcilab.motion.waypoint import label, named_value
from rcilab.motion.waypoint_types import MOST_WAYPOINTS

FreePlanner: TypeAlias = Callable[..., Motion]
"""`(model, start, goal, *, speed, law) -> motion` from one stationary position to another."""

_NOTED_DIFFERENCE = 1e-6
"""A radius that is shortened by more than this is noted, [m]."""
_BLEND_SHARE = 0.3
"""Measured share of finding the blends in the work on a blended run."""
_GEOMETRY_SHARE = 0.3
"""Measured share of building the segments in all work."""


def plan_program(
    model: RobotModel,
    program: Program,
    *,
    speed: float = 1.0,
    start: ArrayLike | None = None,
    rounds: int = 1,
    law: JointLaw = "jerk_limited",
    progress: Callable[[float], None] | None = None,
    max_rows: int = DEFAULT_MAX_ROWS,
    free: FreePlanner | None = None,
) -> Motion:
    """Returns the motion through the waypoints of a program, from standstill to standstill.

    Lines, arcs, circles, null-space moves and the blends between them are inside the limits on joints, tool and arm
    angle. Joint moves and the blends next to them are inside the limits on joints, as with `plan_joint`. A blend uses
    the lower speed of its two segments. Without blends the motion is the sequence of those of `plan_joint`, `plan_line`
    and so on, each starting at a whole cycle.

    Instructions become `motion.events`, see `rcilab.motion.motion_event`: an output is set where its step is, without a
    stop; the motion has a short standstill for each wait for an input. Blocks are repeated; an approach is a segment of
    its own. `expand(program.waypoints)` returns the waypoint of each segment.

    `motion.segment` is the segment of each row, counted from 0: a segment ends in the middle of its blend, or, if the
    tool stops, with its dwell. A blend takes at most half of a neighbouring segment; a longer radius is shortened and
    noted in `motion.notes`.

    Args:
        model: The arm; its tool and its load apply if the program has none.
        program: The waypoints, all in base.
        speed: Factor on the speed of every waypoint, above 0 to 1.
        start: Joint angles of the stationary arm, shape (n,), [rad]. If they differ from the program's start, a joint
            move to it comes first, at the speed of the first waypoint, as segment 0. None begins at the program's
            start.
        rounds: Number of passes through the waypoints. Between two passes a joint move, a segment of its own, returns
            to the program's start.
        law: Time law of every segment, see `plan_joint`. With the S profile the tool stops at every waypoint, so blends
            are not possible.
        progress: Called with the progress, 0 to 1; an exception raised by it cancels planning.
        max_rows: Largest number of 1 ms cycles: 17 minutes by default, as a check takes 1.1 KB per cycle.
        free: Plans waypoints of the type free: `functools.partial(rcilab.plan_free, cell=cell)`.

    Raises:
        PlanningError: A target is out of reach, or a joint limit or a singularity is in the way; the message names the
            waypoint, the position and the reason. Or the motion takes too long.
        InvalidValueError: The program is for another arm, or has waypoints in frames, or an argument is out of range.
    """
    speed = _require_valid(model, program, speed, rounds, law, max_rows)
    expansion = expand(program.waypoints)
    moves = expansion.moves
    count = len(moves)
    _require_rounds(rounds, count)
    model = program.applied_to(model)
    done = 0.0

    def report(part: float) -> None:
        nonlocal done
        done = max(done, part)  # Planning again with lower limits does not reduce the progress.
        if progress is not None:
            progress(done)

    approach = None if start is None else as_vector(start, model.n, "start", "rad")
    if approach is not None and np.abs(approach - program.start).max() <= STANDSTILL_DISTANCE:
        program, approach = replace(program, start=tuple(approach.tolist())), None
    segments = build_segments(model, program.start, moves, lambda part: report(_GEOMETRY_SHARE * part))
    _require_alike(segments, expansion)
    moving = [move.waypoint.speed for move in moves if not move.waypoint.is_instruction]
    first_q, first_speed = np.array(program.start), speed * (moving or [DEFAULT_SPEED])[0]
    builder = _MotionBuilder()
    if approach is not None:
        builder.add(_plan_move(model, approach, first_q, first_speed, "the move to the start", law))
    curves: list[_Curve] = []
    done_moves = 0
    for run in _runs(segments):
        overall = partial(_overall_progress, done_moves + 1, done_moves + len(run), count)
        done_moves += len(run)
        curves.append(
            _plan_run(model, run, speed, builder.notes, law, lambda part, overall=overall: report(overall(part)), free)
        )
        report(overall(1.0))
    return_move = (
        None
        if rounds == 1
        else _plan_move(model, curves[-1].goal, first_q, first_speed, "the move back to the start", law)
    )
    for number in range(int(rounds)):
        for curve in (return_move, *curves) if return_move is not None and number else curves:
            builder.add(curve)
    motion = builder.motion(speed * max(moving or [1.0]), law)
    motion = replace(motion, events=_events(expansion, motion, int(rounds), approach is not None))
    if len(motion) > max_rows:
        raise PlanningError(
            f"the program takes {motion.duration:.0f} s, {len(motion)} rows of 1 ms, more than {max_rows}: use "
            f"fewer rounds or shorter dwells, or pass max_rows={len(motion)} (in a shell --max-rows {len(motion)})"
        ).coded("program_long", duration=f"{motion.duration:.0f}", most=f"{1e-3 * max_rows:.0f}")
    return motion


def _require_valid(
    model: RobotModel, program: Program, speed: float, rounds: int, law: JointLaw, max_rows: int
) -> float:
    """Returns the speed if the arguments of `plan_program` are valid."""
    require_model(model)
    if not isinstance(program, Program):
        raise InvalidValueError("program", described(program), "must be a Program; use Program.load")
    if program.model != model.name:
        raise InvalidValueError(
            "program", program.model, f"is the model of the program, not {model.name}; load that model"
        ).coded("program_model", theirs=program.model, ours=model.name)
    for number, waypoint in enumerate(program.waypoints, 1):
        if waypoint.frame is not None:
            problem = "is not base: plan cell.resolve(program), with the cell that has this frame"
            error = InvalidValueError("frame", waypoint.frame, problem).coded("unresolved", frame=waypoint.frame)
            raise named_value(number, waypoint.type, error)
    speed = as_number(speed, "speed")
    if not 0.0 < speed <= 1.0:
        raise InvalidValueError("speed", speed, "must be above 0, to 1: a part of the waypoints' speeds").coded(
            "span", low="0", high="1"
        )
    for number, waypoint in enumerate(program.waypoints, 1):
        if speed * waypoint.speed < MIN_SPEED and not waypoint.is_instruction:
            what = f"{label(number, waypoint)}, speed times {speed:g}"
            raise InvalidValueError(what, speed * waypoint.speed, f"must be at least {MIN_SPEED:g}").coded(
                "least", least=f"{MIN_SPEED:g}"
            )
    require_max_rows(max_rows)
    if law not in JOINT_LAWS:
        raise InvalidValueError("law", described(law), f"is unknown; known: {', '.join(JOINT_LAWS)}")
    if law == "s_profile":
        _require_stops(program)
    return speed


def _require_rounds(rounds: int, count: int) -> None:
    if not 1 <= as_number(rounds, "rounds") <= MOST_WAYPOINTS / count or int(rounds) != rounds:
        raise InvalidValueError(
            "rounds", rounds, f"must be whole, 1 to {MOST_WAYPOINTS // count} for {count} waypoints"
        ).coded("rounds", most=MOST_WAYPOINTS // count)


def _require_alike(segments: list[Segment], expansion: Expansion) -> None:
    """Requires that a repetition that may be the last one ends where the others end."""
    for event in expansion.events:
        if event.kind != "leave":
            continue
        travel = np.abs(segments[event.until].start - segments[event.move].start)
        if float(travel.max()) > STANDSTILL_DISTANCE:
            raise PlanningError(
                f"waypoint {event.row} (repeat): its repetitions end at different positions, joint "
                f"{int(travel.argmax()) + 1} {math.degrees(float(travel.max())):.3g} deg apart: end the block with a "
                "waypoint that has a target",
                waypoint=event.row,
            ).coded("repeat_apart", number=event.row, joint=int(travel.argmax()) + 1, angle=float(travel.max()))


def _events(expansion: Expansion, motion: Motion, rounds: int, is_led_in: bool) -> tuple[MotionEvent, ...]:
    """Returns the events of all rounds at their times."""
    starts, count = motion.segment_starts, len(expansion.moves)
    found: list[MotionEvent] = []
    for number in range(rounds):
        first = is_led_in + number * (count + 1)
        for event in expansion.events:
            time, until = (float(starts[first + move]) + event.delay for move in (event.move, event.until))
            found.append(
                MotionEvent(
                    event.kind, time, event.signal, event.level, event.timeout,
                    until if event.kind == "leave" else 0.0, event.row,
                )
            )  # fmt: skip
    return tuple(found)


def _overall_progress(first: int, last: int, count: int, part: float) -> float:
    """Returns the overall progress for the progress on waypoints `first` to `last` of `count`."""
    return _GEOMETRY_SHARE + (1.0 - _GEOMETRY_SHARE) * (first - 1 + (last - first + 1) * part) / count


@dataclass(frozen=True, slots=True, eq=False)
class _Curve:
    """The planned curve of the segments between two stops."""

    breaks: Array
    """Start of each piece and end of the last one, shape (S + 1,), [s]."""
    coefficients: Array
    """Coefficients of the pieces, shape (S, n, k), ascending powers of the time since each began."""
    goal: JointVector
    """Joint angles at the end, shape (n,), [rad]."""
    dwell: float = 0.0
    """Time at standstill after the end, [s]."""
    corners: tuple[float, ...] = ()
    """Times at which one segment passes to the next, [s]."""


def _require_stops(program: Program) -> None:
    for number, waypoint in enumerate(program.waypoints, 1):
        if waypoint.blend > 0.0:
            raise PlanningError(
                f"{label(number, waypoint)}: blend {1e3 * waypoint.blend:g} mm, but with the S profile the tool stops "
                "at every waypoint; set blend to 0, or use another law: law='torque_rate_limited'"
            ).coded("s_profile_blend", waypoint=number, blend=waypoint.blend)


def _runs(segments: list[Segment]) -> list[list[Segment]]:
    """Returns the segments, grouped into runs between stops."""
    runs: list[list[Segment]] = []
    continues = False
    for segment in segments:
        is_free = segment.waypoint.type == "free"
        if continues and not segment.is_stationary and not is_free:
            runs[-1].append(segment)
        else:
            runs.append([segment])
        waypoint = segment.waypoint
        continues = waypoint.blend > 0.0 and waypoint.dwell == 0.0 and not segment.is_stationary and not is_free
    return runs


def _plan_move(
    model: RobotModel, start: JointVector, goal: JointVector, speed: float, what: str, law: JointLaw
) -> _Curve:
    """Returns a joint move that does not belong to a waypoint."""
    if np.abs(goal - start).max() <= STANDSTILL_DISTANCE:
        return _dwell_at(goal)
    with naming(what):
        curve = plan_joint(model, start, goal, speed=speed, law=law).polynomial
    return _Curve(curve.breaks, curve.coefficients, goal)


def _dwell_at(goal: JointVector, dwell: float = 0.0) -> _Curve:
    return _Curve(np.zeros(1), np.zeros((0, len(goal), 1)), goal, dwell)


def _plan_run(
    model: RobotModel,
    run: list[Segment],
    scale: float,
    notes: list[str],
    law: JointLaw,
    report: Callable[[float], None],
    free: FreePlanner | None,
) -> _Curve:
    segment = run[0]
    speed = scale * segment.waypoint.speed
    if len(run) > 1:
        blends: list[Blend] = []
        for before, after in pairwise(run):
            blends.append(build_blend(model, before, after, before.waypoint.blend))
            report(_BLEND_SHARE * len(blends) / len(run))
        for before, blend in zip(run[:-1], blends, strict=True):
            requested = before.waypoint.blend
            if blend.radius < requested - _NOTED_DIFFERENCE:
                message = (
                    f"{before.label}: blend radius {1e3 * requested:.1f} mm shortened to {1e3 * blend.radius:.1f} mm: "
                    "a blend takes at most half of the segments before and after it"
                )
                notes.append(Remark(message, "blend", number=before.number, asked=requested, radius=blend.radius))
        spline, last = build_segment_spline(model, run, blends, scale), run[-1]

        def blended(arm: RobotModel) -> _Curve:
            coefficients, corners = plan_segment_spline(
                spline, arm, lambda part: report(_BLEND_SHARE + (1.0 - _BLEND_SHARE) * part)
            )
            breaks = np.arange(len(coefficients) + 1, dtype=np.float64) * CYCLE_TIME
            return _Curve(breaks, coefficients, last.goal, last.waypoint.dwell, tuple(corners))

        if law == "jerk_limited":
            return blended(model)
        return plan_within_torque_rate(
            model, blended, lambda curve: PiecewisePolynomial(curve.breaks, curve.coefficients)
        )
    if segment.is_stationary:
        return _dwell_at(segment.goal, segment.waypoint.dwell)
    with naming(segment.label, segment.number, segment.waypoint.type):
        if segment.waypoint.type == "free":
            if free is None:
                raise InvalidValueError(
                    "type", "free", "needs the cell: plan_program(..., free=partial(rcilab.plan_free, cell=cell))"
                ).coded("free_cell")
            motion = free(model, segment.start, segment.goal, speed=speed, law=law)
        elif segment.path is None:
            motion = plan_joint(model, segment.start, segment.goal, speed=speed, law=law)
        else:
            motion = plan_path(model, segment.start, segment.path, speed, law)
    curve = motion.polynomial
    return _Curve(curve.breaks, curve.coefficients, motion.goal, segment.waypoint.dwell)


class _MotionBuilder:
    """Joins the curves of a program to one motion. Owned by one call of `plan_program`."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self._starts: list[float] = []
        self._breaks: list[Array] = []
        self._pieces: list[Array] = []
        self._goal = np.zeros(0)
        self._end = 0.0

    def add(self, curve: _Curve) -> None:
        """Adds a run, which starts at the next whole cycle, and its dwell."""
        begin = _cycles(self._end) * CYCLE_TIME
        self._dwell_at(begin)
        self._starts += [begin, *(begin + corner for corner in curve.corners)]
        self._breaks.append(curve.breaks[:-1] + begin)
        self._pieces.append(curve.coefficients)
        self._end, self._goal = begin + float(curve.breaks[-1]), curve.goal
        if curve.dwell > 0.0:
            self._dwell_at((_cycles(self._end) + round(curve.dwell / CYCLE_TIME)) * CYCLE_TIME)

    def motion(self, speed: float, law: JointLaw) -> Motion:
        if not any(map(len, self._pieces)):
            self._breaks, self._pieces = [np.zeros(1)], [self._goal.reshape(1, -1, 1)]
        n, powers = self._goal.size, max(piece.shape[2] for piece in self._pieces)
        coefficients = np.zeros((sum(map(len, self._pieces)), n, powers))
        first = 0
        for piece in self._pieces:
            coefficients[first : first + len(piece), :, : piece.shape[2]] = piece
            first += len(piece)
        curve = PiecewisePolynomial(np.concatenate((*self._breaks, [self._end])), make_readonly(coefficients))
        return Motion(
            polynomial=curve, goal=self._goal, law=law, speed=speed,
            segment_starts=np.array(self._starts), notes=tuple(self.notes),
        )  # fmt: skip

    def _dwell_at(self, until: float) -> None:
        if until > self._end:
            self._breaks.append(np.array([self._end]))
            self._pieces.append(self._goal.reshape(1, -1, 1))
            self._end = until


def _cycles(time: float) -> int:
    return math.ceil(time / CYCLE_TIME - 1e-9)
