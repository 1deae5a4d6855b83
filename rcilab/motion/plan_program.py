"""The planner of programs: one motion through all waypoints, as fast as the limits allow, with blended corners."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

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
from rcilab.motion.joint import JOINT_LAWS, MIN_SPEED, JointLaw, plan_joint
from rcilab.motion.motion import Motion
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.program import Program
from rcilab.motion.s_curve import STANDSTILL_DISTANCE
from rcilab.motion.segment import Segment, build_segments, naming
from rcilab.motion.segment_spline import build_chain
from rcilab.motion.segment_spline_motion import plan_chain
from rcilab.motion.torque_rate import plan_within_torque_rate
from rcilab.motion.waypoint import MOST_WAYPOINTS, label

_SHORTENED = 1e-6
"""How much shorter than asked a radius must be to be mentioned, [m]."""
_BLENDS = 0.3
"""Share of the work on a blended run that finding the blends takes, as measured."""
_GEOMETRY = 0.3
"""Share of the work that building the segments takes, as measured."""


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
) -> Motion:
    """Returns the motion through the waypoints of a program, from standstill to standstill.

    On lines, arcs, circles and null-space moves, and on blends between them, the limits on joints, tool and arm angle
    are kept; on joint moves and on the blends next to them those on the joints, as by `plan_joint`. A blend uses the
    lower speed of its neighbours. Without blends the motion is that of `plan_joint`, `plan_line` and so on, one after
    the other, each starting at a whole cycle.

    `motion.segment` is the segment of each row, counted from 0: a segment ends in the middle of its blend, or, if the
    tool stops, with its dwell. A blend takes at most half of a neighbouring segment; a longer radius is shortened and
    noted in `motion.notes`.

    Args:
        model: The arm; with its own tool, unless the program has one.
        program: The waypoints.
        speed: Factor on the speed of every waypoint, above 0 to 1.
        start: Joint angles of the standing arm, shape (n,), [rad]: if they are not those of the program's start, a
            joint move there comes first, at the speed of the first waypoint, as segment 0. None begins at the program's
            start.
        rounds: Number of passes through the waypoints. Between two passes a joint move, a segment of its own, returns
            to the program's start.
        law: How every segment runs, see `plan_joint`. By the S profile the tool stops at every waypoint, so that there
            can be no blends.
        progress: Called with the progress, 0 to 1; an exception that it raises ends the planning.
        max_rows: Largest number of 1 ms cycles: 17 minutes by default, as a check takes 1.1 KB per cycle.

    Raises:
        PlanningError: A target is out of reach, or a joint limit or a singularity is in the way; the message names the
            waypoint, the place and the reason. Or the motion takes too long.
        InvalidValueError: The program is for another arm, or an argument is out of range.
    """
    require_model(model)
    if not isinstance(program, Program):
        raise InvalidValueError("program", described(program), "must be a Program; use Program.load")
    if program.model != model.name:
        raise InvalidValueError(
            "program", program.model, f"is the arm it is for, not {model.name}; load that model"
        ).coded("program_model", theirs=program.model, ours=model.name)
    speed = as_number(speed, "speed")
    if not 0.0 < speed <= 1.0:
        raise InvalidValueError("speed", speed, "must be above 0, to 1: a part of the waypoints' speeds").coded(
            "span", low="0", high="1"
        )
    for number, waypoint in enumerate(program.waypoints, 1):
        if speed * waypoint.speed < MIN_SPEED:
            what = f"{label(number, waypoint)}, speed times {speed:g}"
            raise InvalidValueError(what, speed * waypoint.speed, f"must be at least {MIN_SPEED:g}").coded(
                "least", least=f"{MIN_SPEED:g}"
            )
    count = len(program.waypoints)
    if not 1 <= as_number(rounds, "rounds") <= MOST_WAYPOINTS / count or int(rounds) != rounds:
        raise InvalidValueError(
            "rounds", rounds, f"must be whole, 1 to {MOST_WAYPOINTS // count} for {count} waypoints"
        ).coded("rounds", most=MOST_WAYPOINTS // count)
    require_max_rows(max_rows)
    if law not in JOINT_LAWS:
        raise InvalidValueError("law", described(law), f"is unknown; known: {', '.join(JOINT_LAWS)}")
    if law == "s_profile":
        _require_stops(program)
    if program.T_flange_tool is not None:
        model = model.with_tool(program.T_flange_tool)
    done = 0.0

    def report(part: float) -> None:
        nonlocal done
        done = max(done, part)  # Planning a second time with lower limits does not reduce the progress.
        if progress is not None:
            progress(done)

    approach = None if start is None else as_vector(start, model.n, "start", "rad")
    if approach is not None and np.abs(approach - program.start).max() <= STANDSTILL_DISTANCE:
        program, approach = replace(program, start=tuple(approach.tolist())), None
    segments = build_segments(model, program, lambda part: report(_GEOMETRY * part))
    there, slow = np.array(program.start), speed * program.waypoints[0].speed
    track = _Track()
    if approach is not None:
        track.add(_plan_move(model, approach, there, slow, "the way to the start", law))
    curves: list[_Curve] = []
    for run in _runs(segments):
        of_all = partial(_part_of_all, run[0].number, run[-1].number, count)
        curves.append(_plan_run(model, run, speed, track.notes, law, lambda part, of_all=of_all: report(of_all(part))))
        report(of_all(1.0))
    back = None if rounds == 1 else _plan_move(model, curves[-1].goal, there, slow, "the way back to the start", law)
    for number in range(int(rounds)):
        for curve in (back, *curves) if back is not None and number else curves:
            track.add(curve)
    motion = track.motion(speed * max(waypoint.speed for waypoint in program.waypoints), law)
    if len(motion) > max_rows:
        raise PlanningError(
            f"the program takes {motion.duration:.0f} s, {len(motion)} rows of 1 ms, more than {max_rows}: take "
            f"fewer rounds or shorter dwells, or pass max_rows={len(motion)} (in a shell --max-rows {len(motion)})"
        ).coded("program_long", duration=f"{motion.duration:.0f}", most=f"{1e-3 * max_rows:.0f}")
    return motion


def _part_of_all(first: int, last: int, count: int, part: float) -> float:
    """Returns the total progress for a progress on the waypoints from `first` to `last` of `count`."""
    return _GEOMETRY + (1.0 - _GEOMETRY) * (first - 1 + (last - first + 1) * part) / count


@dataclass(frozen=True, slots=True, eq=False)
class _Curve:
    """Segments from stop to stop, planned."""

    breaks: Array
    """Where the pieces begin, and where the last one ends, shape (S + 1,), [s]."""
    coefficients: Array
    """Of the pieces, shape (S, n, k), ascending powers of the time since each began."""
    goal: JointVector
    """Where they end, shape (n,), [rad]."""
    dwell: float = 0.0
    """How long to stay there, [s]."""
    corners: tuple[float, ...] = ()
    """When one segment passes to the next, since the start, [s]."""


def _require_stops(program: Program) -> None:
    for number, waypoint in enumerate(program.waypoints, 1):
        if waypoint.blend > 0.0:
            raise PlanningError(
                f"{label(number, waypoint)}: blend {1e3 * waypoint.blend:g} mm, but by the S profile the tool stops at "
                "every waypoint; set blend to 0, or choose another law: law='torque_rate_limited'"
            ).coded("s_profile_blend", waypoint=number, blend=waypoint.blend)


def _runs(segments: list[Segment]) -> list[list[Segment]]:
    """Returns the segments between full stops."""
    runs: list[list[Segment]] = []
    goes_on = False
    for segment in segments:
        if goes_on and not segment.stands:
            runs[-1].append(segment)
        else:
            runs.append([segment])
        waypoint = segment.waypoint
        goes_on = waypoint.blend > 0.0 and waypoint.dwell == 0.0 and not segment.stands
    return runs


def _plan_move(
    model: RobotModel, start: JointVector, goal: JointVector, speed: float, what: str, law: JointLaw
) -> _Curve:
    """Returns a joint move that does not belong to a waypoint."""
    if np.abs(goal - start).max() <= STANDSTILL_DISTANCE:
        return _stand(goal)
    with naming(what):
        curve = plan_joint(model, start, goal, speed=speed, law=law).polynomial
    return _Curve(curve.breaks, curve.coefficients, goal)


def _stand(goal: JointVector, dwell: float = 0.0) -> _Curve:
    return _Curve(np.zeros(1), np.zeros((0, len(goal), 1)), goal, dwell)


def _plan_run(
    model: RobotModel,
    run: list[Segment],
    scale: float,
    notes: list[str],
    law: JointLaw,
    report: Callable[[float], None],
) -> _Curve:
    segment = run[0]
    speed = scale * segment.waypoint.speed
    if len(run) > 1:
        blends: list[Blend] = []
        for before, after in pairwise(run):
            blends.append(build_blend(model, before, after))
            report(_BLENDS * len(blends) / len(run))
        for before, blend in zip(run[:-1], blends, strict=True):
            asked = before.waypoint.blend
            if blend.radius < asked - _SHORTENED:
                said = (
                    f"{before.label}: blend radius {1e3 * asked:.1f} mm shortened to {1e3 * blend.radius:.1f} mm: a "
                    "blend takes at most half of the ways before and after it"
                )
                notes.append(Remark(said, "blend", number=before.number, asked=asked, radius=blend.radius))
        chain, last = build_chain(model, run, blends, scale), run[-1]

        def blended(arm: RobotModel) -> _Curve:
            coefficients, corners = plan_chain(chain, arm.limits, lambda part: report(_BLENDS + (1.0 - _BLENDS) * part))
            breaks = np.arange(len(coefficients) + 1, dtype=np.float64) * CYCLE_TIME
            return _Curve(breaks, coefficients, last.goal, last.waypoint.dwell, tuple(corners))

        if law == "jerk_limited":
            return blended(model)
        return plan_within_torque_rate(
            model, blended, lambda curve: PiecewisePolynomial(curve.breaks, curve.coefficients)
        )
    if segment.stands:
        return _stand(segment.goal, segment.waypoint.dwell)
    with naming(segment.label, segment.number, segment.waypoint.type):
        if segment.path is None:
            motion = plan_joint(model, segment.start, segment.goal, speed=speed, law=law)
        else:
            motion = plan_path(model, segment.start, segment.path, speed, law)
    curve = motion.polynomial
    return _Curve(curve.breaks, curve.coefficients, motion.goal, segment.waypoint.dwell)


class _Track:
    """The motion as far as it is planned. Owned by the call of `plan_program` that made it."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self._starts: list[float] = []
        self._breaks: list[Array] = []
        self._pieces: list[Array] = []
        self._goal = np.zeros(0)
        self._end = 0.0

    def add(self, curve: _Curve) -> None:
        """Adds a run, from the next whole cycle on, and its dwell."""
        begin = _cycles(self._end) * CYCLE_TIME
        self._stand(begin)
        self._starts += [begin, *(begin + corner for corner in curve.corners)]
        self._breaks.append(curve.breaks[:-1] + begin)
        self._pieces.append(curve.coefficients)
        self._end, self._goal = begin + float(curve.breaks[-1]), curve.goal
        if curve.dwell > 0.0:
            self._stand((_cycles(self._end) + round(curve.dwell / CYCLE_TIME)) * CYCLE_TIME)

    def motion(self, speed: float, law: JointLaw) -> Motion:
        """Returns the whole motion."""
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

    def _stand(self, until: float) -> None:
        if until > self._end:
            self._breaks.append(np.array([self._end]))
            self._pieces.append(self._goal.reshape(1, -1, 1))
            self._end = until


def _cycles(time: float) -> int:
    return math.ceil(time / CYCLE_TIME - 1e-9)
