"""The motion, an immutable value that planners return, `check` checks and the control process streams."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import IO, BinaryIO, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import (
    Array,
    JointPath,
    JointVector,
    as_number,
    as_path,
    as_vector,
    described,
    readonly_copy,
    require_radians,
)
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS, require_rows
from rcilab.i18n.catalogue import SHARED
from rcilab.i18n.notebook_language import language
from rcilab.i18n.translator import Remark, Text
from rcilab.motion import storage
from rcilab.motion.motion_event import MotionEvent, event_rows, require_events
from rcilab.motion.piecewise import DERIVATIVES, PiecewisePolynomial
from rcilab.motion.samples import is_on_grid, notes_on, read_samples
from rcilab.motion.spline import spline_through

TimeLaw: TypeAlias = Literal["jerk_limited", "torque_rate_limited", "s_profile", "stop", "samples"]
"""Time law of a motion: as fast as all limits allow, the same within the recommended torque rate, the manual's S
profile (3.5), the fastest stop, or given samples."""

_LAWS: tuple[TimeLaw, ...] = get_args(TimeLaw)

_ROUNDING = 1e-9
"""A duration that exceeds whole cycles by less than this part of a cycle is rounded down to them."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionSample:
    """A motion at one instant, each array of shape (n,) and read-only."""

    q: JointVector
    """Joint angles, [rad]."""
    dq: JointVector
    """Joint velocities, [rad/s]."""
    ddq: JointVector
    """Joint accelerations, [rad/s^2]."""
    jerk: JointVector
    """Joint jerks, [rad/s^3]."""

    def __repr__(self) -> str:
        q, dq = (" ".join(f"{x:.2f}" for x in np.degrees(row).tolist()) for row in (self.q, self.dq))
        return f"<MotionSample: q = {q} deg; dq = {dq} deg/s; .ddq, .jerk>"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Motion:
    """Joint angles as a function of time, exact at every instant, with rows on the controller's 1 ms grid.

    The rows `.times`, `.q`, `.dq`, `.ddq`, `.jerk` are computed on first access. Row 0 is the start; the last row is
    the standstill at the goal, at the first cycle not before the exact `.duration`. Derivatives are those of the
    curve; the controller checks backward differences of `.q`, and `rcilab.check` computes those.
    """

    polynomial: PiecewisePolynomial
    """The curve."""
    goal: JointVector
    """Joint angles at the end, shape (n,), [rad]."""
    law: TimeLaw
    speed: float = 1.0
    """The speed it was planned with, as a part of the limits, in (0, 1]."""
    segment_starts: Array = field(default_factory=lambda: np.zeros(1))
    """Start time of each segment of a program, shape (S,), first 0, [s]; any other motion has one segment."""
    notes: tuple[str, ...] = ()
    """Notes of the planner, one sentence each, such as a blend that had to be shortened."""
    events: tuple[MotionEvent, ...] = ()
    """Outputs that are set and inputs that are awaited on the way; waits add to the duration."""
    _cache: dict[str, Array] = field(init=False, repr=False, default_factory=dict[str, Array])

    def __post_init__(self) -> None:
        object.__setattr__(self, "goal", as_vector(self.goal, self.polynomial.n, "goal", "rad"))
        if self.law not in _LAWS:
            raise InvalidValueError("law", self.law, f"is unknown; known: {', '.join(_LAWS)}")
        if not 0.0 < self.speed <= 1.0:
            raise InvalidValueError("speed", self.speed, "must be in (0, 1]")
        starts = readonly_copy(self.segment_starts)
        if starts.ndim != 1 or not starts.size or starts[0] != 0.0 or not (np.diff(starts, append=np.inf) >= 0.0).all():
            raise InvalidValueError("segment_starts", self.segment_starts, "must begin at 0 and never decrease [s]")
        object.__setattr__(self, "segment_starts", starts)
        object.__setattr__(self, "events", require_events(self.events, self.duration))
        object.__setattr__(self, "notes", tuple(note if isinstance(note, Remark) else str(note) for note in self.notes))

    @classmethod
    def from_samples(cls, q: ArrayLike, *, dt: float | None = None, times: ArrayLike | None = None) -> Motion:
        """Returns the motion through joint samples at any rate, even or not: a cubic spline through every sample.

        It starts and ends at standstill. Nothing is slowed down or smoothed; use `check` for the limits. For rows at
        the controller's cycle, such as those of a recording, use `from_cycles`.

        Args:
            q: Joint angles, shape (N, n), N >= 1, [rad].
            dt: Time between two samples, [s]: 0.01 for 100 samples a second.
            times: Time of each sample, shape (N,), increasing, [s]; instead of `dt`.

        Raises:
            InvalidValueError: Not finite, more than two turns, neither or both of `dt` and `times`, or the times do not
                increase.
        """
        if dt is None and times is None:
            problem = (
                "is missing: pass the seconds between two samples, or times=; for rows of 1 ms use Motion.from_cycles"
            )
            raise InvalidValueError("dt", None, problem)
        if dt is not None and times is not None:
            raise InvalidValueError("dt", dt, "is not needed if the samples have times; pass one of the two")
        rows = require_radians(as_path(q, None, "q", "rad"), "q")
        if dt is not None:
            if not 0.0 < (dt := as_number(dt, "dt", "s")) < math.inf:
                raise InvalidValueError("dt", dt, "must be above 0: the seconds between two samples")
            times = np.arange(len(rows)) * dt
        assert times is not None
        return motion_through(times, rows)

    @classmethod
    def from_cycles(cls, q: ArrayLike, period: int = 1) -> Motion:
        """Returns the motion through rows at the controller's cycle of 1 ms, such as those of a recording.

        Between the rows it is cubic, with slopes from central differences, one-sided at both ends.

        Args:
            q: Joint angles, shape (N, n), N >= 1, [rad].
            period: Cycles from one row to the next.

        Raises:
            InvalidValueError: Not a finite table of at least one row; the message names the row and the joint.
        """
        rows = as_path(q, None, "q", "rad")
        if len(rows) == 1:
            return stationary_motion(rows[0], law="samples")
        h = period * CYCLE_TIME
        slopes = np.gradient(rows, h, axis=0)
        rise = np.diff(rows, axis=0) / h
        pieces = np.empty((len(rows) - 1, rows.shape[1], 4))
        pieces[:, :, 0] = rows[:-1]
        pieces[:, :, 1] = slopes[:-1]
        pieces[:, :, 2] = (3.0 * rise - 2.0 * slopes[:-1] - slopes[1:]) / h
        pieces[:, :, 3] = (slopes[:-1] + slopes[1:] - 2.0 * rise) / h**2
        return cls(polynomial=PiecewisePolynomial(_grid(len(rows)) * period, pieces), goal=rows[-1], law="samples")

    @property
    def duration(self) -> float:
        """Exact duration, [s]; not rounded to cycles."""
        return self.polynomial.duration

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.polynomial.n

    @property
    def start(self) -> JointVector:
        """Joint angles at t = 0, shape (n,), [rad]."""
        return self.polynomial.coefficients[0, :, 0]

    @property
    def times(self) -> Array:
        """Times of the rows, whole cycles, shape (N,), [s]."""
        return self._cached("times")

    @property
    def q(self) -> JointPath:
        """Joint angles, shape (N, n), [rad]."""
        return self._cached("q")

    @property
    def dq(self) -> JointPath:
        """Joint velocities, shape (N, n), [rad/s]."""
        return self._cached("dq")

    @property
    def ddq(self) -> JointPath:
        """Joint accelerations, shape (N, n), [rad/s^2]."""
        return self._cached("ddq")

    @property
    def jerk(self) -> JointPath:
        """Joint jerks, shape (N, n), [rad/s^3]; at a jump the later value."""
        return self._cached("jerk")

    @property
    def segment(self) -> NDArray[np.intp]:
        """Index of the segment of each row, from 0, shape (N,); in a program the index of its waypoint.

        A segment of zero length has no row, unless it is the last.
        """
        return np.searchsorted(self.segment_starts, self.times + _ROUNDING * CYCLE_TIME, side="right") - 1

    @property
    def fingerprint(self) -> str:
        """SHA-256, hexadecimal, over everything that defines how the motion runs; segments and notes do not."""
        digest = hashlib.sha256(f"rcilab motion {self.law} {self.speed!r}".encode())
        for array in (self.polynomial.breaks, self.polynomial.coefficients, self.goal):
            digest.update(repr(array.shape).encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        if self.events:
            digest.update(event_rows(self.events).tobytes())
        return digest.hexdigest()

    def __len__(self) -> int:
        """Number of rows: one per cycle, with start and goal."""
        return math.ceil(self.duration / CYCLE_TIME - _ROUNDING) + 1

    def at(self, t: float) -> MotionSample:
        """Returns the motion at any time; before it begins the start, after its end standstill at the goal.

        Args:
            t: Time since the start, [s].

        Raises:
            InvalidValueError: t is not a number, or NaN.
        """
        t = as_number(t, "t", "s")
        if math.isnan(t):
            raise InvalidValueError("t", t, "is not a time [s]")
        if t >= self.duration:
            zero = readonly_copy(np.zeros(self.n))
            return MotionSample(self.goal, zero, zero, zero)
        return _sample(self.polynomial.at(t))

    def end(self) -> MotionSample:
        """Returns the left-hand limits at the end of the curve; a valid motion ends at standstill."""
        return _sample(self.polynomial.at_end())

    def slowed(self, factor: float) -> Motion:
        """Returns the motion on the same path `factor` times slower: q(t / factor), on its own 1 ms grid.

        Velocities are divided by the factor, accelerations by its square, jerks by its cube; `law` and
        `speed` do not change.

        Args:
            factor: Factor on the duration, 1 or more.

        Raises:
            InvalidValueError: The factor is not a finite number of at least 1.
        """
        factor = as_number(factor, "factor")
        if not 1.0 <= factor < math.inf:
            raise InvalidValueError("factor", factor, "must be 1 or more, and finite: the factor on the duration")
        starts = factor * self.segment_starts
        events = tuple(event.slowed(factor) for event in self.events)
        return replace(self, polynomial=self.polynomial.slowed(factor), segment_starts=starts, events=events)

    def save(self, file: str | PathLike[str] | BinaryIO) -> None:
        """Writes the motion to a file that `Motion.load` reads; the suffix selects the format.

        .npz stores everything exactly. .csv stores the rows of the 1 ms grid, `t [s]`, `q1 [rad]`, ...: the motion that
        is loaded again has exactly the same `.times` and `.q`, and the law "samples".

        Raises:
            InvalidValueError: The suffix is unknown, or the file cannot be written.
        """
        storage.save(file, self._write_npz, lambda stream: storage.write_rows(stream, self.times, self.q))

    @classmethod
    def load(cls, file: str | PathLike[str] | BinaryIO, *, max_rows: int = DEFAULT_MAX_ROWS) -> Motion:
        """Returns the motion in a file (.npz or .csv, see `save`).

        A CSV whose times are not the 1 ms grid is read as `load_samples` reads it.

        Args:
            file: File name, or an open binary file.
            max_rows: Largest number of 1 ms cycles, by default 17 minutes; each takes up to 1 KiB unpacked.

        Raises:
            InvalidValueError: The file does not exist, does not contain a valid motion, or is too large.
            VersionMismatchError: It was written by another version of this format.
        """
        if not storage.is_csv(file):
            return storage.read_content(file, max_rows, cls)
        times, q = read_samples(file, None, "rad", max_rows)  # type: ignore[arg-type]  # Streams are .npz.
        if is_on_grid(times):
            return cls.from_cycles(q)
        return _through_samples(times, q, max_rows, file)  # type: ignore[arg-type]

    @classmethod
    def load_samples(
        cls,
        file: str | PathLike[str],
        *,
        rate_hz: float | None = None,
        unit: Literal["rad", "deg"] = "rad",
        max_rows: int = DEFAULT_MAX_ROWS,
    ) -> Motion:
        """Returns the motion through joint samples of another program, at any rate, even or not.

        It is the cubic spline of `from_samples`. Nothing is slowed down or smoothed; use `check` for the limits.

        A CSV file has one row per sample. With a header line, columns are found by name and others ignored: `t`, with
        a unit other than seconds as `t [ms]`, and `q1`, `q2`, ... (also `q[1]`, `joint_1`), in degrees as `q1 [deg]`.
        Without a header, the first column is the time, or with `rate_hz` all columns are joints. An NPZ file has the
        angles as `q`, shape (N, n), and the times as `t`, shape (N,).

        Args:
            file: Name of the file, ending in .csv or .npz.
            rate_hz: Samples per second, for a file without times, [Hz].
            unit: Unit of angles whose column does not name one.
            max_rows: As for `load`.

        Raises:
            InvalidValueError: The file does not exist, or its samples are not valid or too many; the message names the
                line.
        """
        return _through_samples(*read_samples(file, rate_hz, unit, max_rows), max_rows, file)

    def __reduce__(self) -> tuple[object, ...]:
        parts = (self.polynomial, self.goal, self.law, self.speed, self.segment_starts, self.notes, self.events)
        return _rebuild, parts

    def __repr__(self) -> str:
        return f"<Motion {self.law}, {self.n} joints, {self.duration:.3f} s, speed {self.speed:g}>"

    def _repr_html_(self) -> str:
        text = Text(language(), SHARED)
        degrees = (
            f"<tr><th>{name}</th>"
            + "".join(f"<td>{text.units.format_angle(angle, 1)}</td>" for angle in q.tolist())
            + "</tr>"
            for name, q in ((text("motion.start"), self.start), (text("motion.goal"), self.goal))
        )
        title = text("motion.caption", law=self.law, duration=self.duration, speed=self.speed)
        return f"<table><caption>{title}</caption>{''.join(degrees)}</table>"

    def _write_npz(self, stream: IO[bytes]) -> None:
        content = {
            "law": np.array(self.law),
            "speed": np.array(self.speed),
            "breaks": self.polynomial.breaks,
            "coefficients": self.polynomial.coefficients,
            "goal": self.goal,
            "segment_starts": self.segment_starts,
            "notes": np.array(self.notes, dtype=np.str_),
        }
        if self.events:
            content["events"] = event_rows(self.events)
        storage.write_arrays(stream, content)

    def _cached(self, name: str) -> Array:
        # Two threads may both compute it; the arrays are equal and one of them is kept.
        if name not in self._cache:
            self._cache[name] = self._compute(name)
        return self._cache[name]

    def _compute(self, name: str) -> Array:
        if name == "times":
            array = _grid(len(self))
        else:
            derivative = ("q", "dq", "ddq", "jerk").index(name)
            array = self.polynomial.sample(self.times, derivative)
            array[-1] = 0.0 if derivative else self.goal
        # Backed by bytes, so that the rows of a checked motion cannot be made writable again.
        return np.frombuffer(array.tobytes()).reshape(array.shape)


def motion_through(times: ArrayLike, q: ArrayLike) -> Motion:
    """Returns the motion through joint angles at given times: a cubic spline that starts and ends at standstill.

    Limits are not checked; use `check`.

    Args:
        times: Time of each sample, shape (N,), increasing, [s]; the motion starts at the first.
        q: Joint angles, shape (N, n), N >= 1, [rad].

    Raises:
        InvalidValueError: Not finite, numbers of times and rows differ, the times do not increase, or span too long.
    """
    curve, rows = spline_through(times, q)
    return (
        stationary_motion(rows[0], law="samples")
        if curve is None
        else Motion(polynomial=curve, goal=rows[-1], law="samples")
    )


def _through_samples(times: Array, q: JointPath, max_rows: int, file: str | PathLike[str]) -> Motion:
    notes = notes_on(times)
    try:
        motion = replace(motion_through(times, q), notes=notes)
        require_rows(len(motion), max_rows, "samples", Path(file).name)
    except InvalidValueError as error:
        requirement = "; ".join((error.requirement, *notes))
        raise InvalidValueError(error.name, error.value, requirement).coded(error.code, **error.facts) from None
    return motion


def require_motion(motion: object) -> Motion:
    """Returns `motion` if it is a `Motion`; catches swapped model and motion arguments.

    Raises:
        InvalidValueError: It is not; the message says how to make one.
    """
    if isinstance(motion, Motion):
        return motion
    raise InvalidValueError(
        "motion", described(motion), "must be a motion; use plan_joint, plan_program or Motion.from_samples"
    )


def stationary_motion(q: ArrayLike, *, law: TimeLaw = "jerk_limited", speed: float = 1.0) -> Motion:
    """Returns the motion of zero length at `q`, shape (n,), [rad]."""
    angles = np.asarray(q, dtype=np.float64)
    curve = PiecewisePolynomial(np.zeros(2), angles.reshape(1, -1, 1))
    return Motion(polynomial=curve, goal=angles, law=law, speed=speed)


def _grid(count: int) -> Array:
    return np.arange(count, dtype=np.float64) * CYCLE_TIME


def _sample(arrays: tuple[JointVector, JointVector, JointVector, JointVector]) -> MotionSample:
    assert len(arrays) == DERIVATIVES
    for array in arrays:
        array.flags.writeable = False
    return MotionSample(*arrays)


def _rebuild(
    polynomial: PiecewisePolynomial,
    goal: JointVector,
    law: TimeLaw,
    speed: float,
    starts: Array,
    notes: tuple[str, ...],
    events: tuple[MotionEvent, ...],
) -> Motion:
    return Motion(
        polynomial=polynomial, goal=goal, law=law, speed=speed, segment_starts=starts, notes=notes, events=events
    )
