"""Waypoints: the steps of a program, as plain numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import MAX_ANGLE, Unquoted, as_number, as_vector, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose, as_pose, is_transform
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.motion.joint import DEFAULT_SPEED, MIN_SPEED
from rcilab.motion.path import CircleOrientation, ElbowDirection
from rcilab.motion.waypoint_types import (
    ALLOWED,
    CHOICES,
    COMMON_FIELDS,
    DEFAULT_TIMEOUT,
    INSTRUCTIONS,
    LARGEST_BLEND,
    LARGEST_OFFSET,
    LAST_SIGNAL,
    LONGEST_DWELL,
    LONGEST_TEXT,
    MAX_COORDINATE,
    MOST_REPEATS,
    MOST_WAYPOINTS,
    REQUIRED,
    Floats,
    WaypointType,
)
from rcilab.robots.description import RobotDescription

_UNIT_TOLERANCE = 1e-3
"""Largest difference of a quaternion's length from 1; it is normalised."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """One step of a program, as plain numbers, so that waypoints can be compared and files are exact.

    `Waypoint.joint`, `.line`, `.arc`, `.circle`, `.nullspace` and `.free` build one from poses and arrays. Instructions
    move nothing: they wait, set and await signals, and repeat other steps. `expand` makes plain moves of them.

    Raises:
        InvalidValueError: A number is missing, out of range or not used by this type.
    """

    type: WaypointType
    """joint: straight in joint space. line, arc: the tool on a straight line, or through `via`. circle: around
    `center`. nullspace: only the elbow moves. free: around obstacles. retreat: the tool straight back along its z axis.
    wait: for `dwell`. input: until a digital input has `level`. output: sets one. tool: opens or closes the jaws.
    repeat, group ... end: a block of steps. comment: `text`, which nothing reads."""
    q: Floats | None = None
    """Target as joint angles, n of them, [rad]; for a line or an arc the pose and the arm angle at them."""
    position: Floats | None = None
    """Target: position of the tool in `frame`, 3 numbers, [m]; with `wxyz`."""
    wxyz: Floats | None = None
    """Target: orientation of the tool in `frame`, 4 numbers, a unit quaternion."""
    via: Floats | None = None
    """A point on the arc, in `frame`, 3 numbers, [m]."""
    via_wxyz: Floats | None = None
    """Orientation of the tool at `via`, 4 numbers, a unit quaternion; None is a slerp from start to target."""
    center: Floats | None = None
    """Centre of the circle in `frame`, 3 numbers, [m]."""
    axis: Floats | None = None
    """Axis of the circle in `frame`, 3 numbers of any length; the tool goes around it by the right-hand rule."""
    frame: str | None = None
    """Name of the work frame that position, wxyz, via, via_wxyz, center and axis are given in; None: base. Not with
    joint angles. `Program.resolved` puts all waypoints in base."""
    angle: float | None = None
    """Angle around the circle, more than 0 up to 2 pi, [rad]; None is the full circle."""
    orientation: CircleOrientation | None = None
    """Orientation of the tool on a circle: "held" (default), or "turning" with the circle, about its axis."""
    psi: float | None = None
    """Arm angle of a 7-axis arm at the target, -pi to pi, [rad]; None holds that of the start; any in a joint move."""
    way: ElbowDirection | None = None
    """Direction of a nullspace move, "shorter" (default) or "longer"; the longer one to the arm angle of the start is a
    full turn."""
    approach: float | None = None
    """Distance from the target, against the tool's z axis, at which the tool arrives first, up to 1, [m]; from there it
    moves on a straight line. `blend` then rounds this corner, and the tool stops at the target."""
    distance: float | None = None
    """Length of a retreat, more than 0 up to 1, [m]."""
    signal: int | str | None = None
    """Number of a digital signal of the controller, from 0, or its name in the cell. Of a tool: the output that closes
    its jaws; None is that of the cell's jaws."""
    level: bool | None = None
    """Level of the signal; True by default. A repeat with a signal ends as soon as the input has it."""
    timeout: float | None = None
    """Longest time to wait for an input, up to 3600, [s]; then the program ends with an error."""
    jaws: Literal["close", "open"] | None = None
    """What the tool does."""
    count: int | None = None
    """Number of repetitions, 1 to 1000; with a signal the largest one, after which the program ends with an error."""
    text: str | None = None
    """A comment, or the name of a block, in one line."""
    speed: float = DEFAULT_SPEED
    """Part of the velocity and acceleration limits to use on the segment to this waypoint, 0.001 to 1; jerk limits
    are used in full."""
    blend: float = 0.0
    """Radius within which the tool may leave its path to round the corner, up to 1, [m]. 0 is a stop. The tool also
    stops at the last waypoint, at one with a dwell, and at one without a motion."""
    dwell: float = 0.0
    """Time at standstill at this waypoint, up to 3600, [s]; in whole cycles."""

    def __post_init__(self) -> None:
        if self.type not in get_args(WaypointType):
            known = ", ".join(get_args(WaypointType))
            error = InvalidValueError("type", described(self.type), f"is unknown; known: {known}")
            raise error.coded("unknown", known=known)
        allowed = ALLOWED[self.type]
        for name, default in _DEFAULTS.items():
            if getattr(self, name) is None and name in allowed:
                object.__setattr__(self, name, default)
        if self.signal is None and self.type == "repeat":
            object.__setattr__(self, "level", None)
        for name in _OPTIONAL:
            value = getattr(self, name)
            if value is not None and name not in allowed:
                problem = f"has no meaning here; {self.type} takes: {', '.join(allowed)}"
                raise InvalidValueError(name, described(value), problem).coded(
                    "no_meaning", type=self.type, known=", ".join(allowed) or "–"
                )
            if value is None and name in REQUIRED[self.type]:
                missing = InvalidValueError(
                    name, None, f"is missing: {self.type} needs {', '.join(REQUIRED[self.type])}"
                )
                raise missing.coded("missing", type=self.type, names=", ".join(REQUIRED[self.type]))
            if name in CHOICES:
                _require_choice(name, value)
            elif value is not None and name in _VECTORS:
                object.__setattr__(self, name, vector_of(name, value))
        self._require_target()
        self._require_frame()
        self._require_instruction()
        for name, lowest, highest, unit in _RANGES:
            value = getattr(self, name)
            if value is None:
                continue
            if name in COMMON_FIELDS and name not in allowed:
                if value != _COMMON_DEFAULTS[name]:
                    problem = f"has no meaning here; {self.type} takes: {', '.join(allowed) or 'nothing'}"
                    raise InvalidValueError(name, described(value), problem).coded(
                        "no_meaning", type=self.type, known=", ".join(allowed) or "–"
                    )
                continue
            number = as_number(value, name, unit)
            is_positive = name in ("angle", "distance")
            if not lowest <= number <= highest or (is_positive and number == 0.0):
                span = f"{'more than 0' if is_positive else f'{lowest:.5g}'} to {highest:.5g} [{unit}]"
                error = InvalidValueError(name, number, f"must be from {span}")
                raise error.coded("span", low=f"{lowest:.5g}", high=f"{highest:.5g}")
            object.__setattr__(self, name, number)
        if self.type == "free" and self.blend and self.approach is None:
            raise InvalidValueError("blend", self.blend, "must be 0: a motion around obstacles ends with a stop").coded(
                "free_blend"
            )

    @classmethod
    def joint(
        cls, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED, blend: float = 0.0,
        dwell: float = 0.0, frame: str | None = None, approach: float | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a straight move in joint space, to joint angles, shape (n,), [rad], or to a pose of the tool.

        A pose, in base or in a named frame, is reached on the branch closest to the previous joint angles.
        """
        return cls(
            type="joint", **_target(target), frame=frame, psi=psi, speed=speed, blend=blend, dwell=dwell,
            approach=approach,
        )  # fmt: skip

    @classmethod
    def free(
        cls, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED, dwell: float = 0.0,
        frame: str | None = None, approach: float | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a motion around the obstacles of the cell, to joint angles, shape (n,), [rad], or to a pose."""
        return cls(type="free", **_target(target), frame=frame, psi=psi, speed=speed, dwell=dwell, approach=approach)

    @classmethod
    def line(
        cls, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED, blend: float = 0.0,
        dwell: float = 0.0, frame: str | None = None, approach: float | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a straight line of the tool to a pose, or to the pose at joint angles, shape (n,), [rad].

        The pose is in base, or in a named frame.
        """
        return cls(
            type="line", **_target(target), frame=frame, psi=psi, speed=speed, blend=blend, dwell=dwell,
            approach=approach,
        )  # fmt: skip

    @classmethod
    def arc(
        cls, via: Pose | ArrayLike, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED,
        blend: float = 0.0, dwell: float = 0.0, frame: str | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns an arc of the tool through `via`: a pose, or only a position, shape (3,), [m].

        Both are in base, or in a named frame.
        """
        via_fields: dict[str, Any] = {"via": via}
        if isinstance(via, Pose) or is_transform(via):
            via = as_pose(via, "via")
            via_fields = {"via": via.position, "via_wxyz": via.wxyz}
        return cls(
            type="arc", **via_fields, **_target(target), frame=frame, psi=psi, speed=speed, blend=blend, dwell=dwell
        )  # fmt: skip

    @classmethod
    def circle(
        cls, center: ArrayLike, axis: ArrayLike, angle: float | None = None, *,
        orientation: CircleOrientation = "held", psi: float | None = None, speed: float = DEFAULT_SPEED,
        blend: float = 0.0, dwell: float = 0.0, frame: str | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a circle, or a part of it, around a centre, shape (3,), [m], and an axis, shape (3,).

        Centre and axis are in base, or in a named frame. The tool keeps its orientation ("held"), or it turns with the
        circle ("turning").
        """
        return cls(
            type="circle", center=vector_of("center", center), axis=vector_of("axis", axis), frame=frame, angle=angle,
            orientation=orientation, psi=psi, speed=speed, blend=blend, dwell=dwell,
        )  # fmt: skip

    @classmethod
    def nullspace(
        cls, psi: float, *, way: ElbowDirection = "shorter", speed: float = DEFAULT_SPEED, blend: float = 0.0,
        dwell: float = 0.0,
    ) -> Waypoint:  # fmt: skip
        """Returns a move of only the elbow to an arm angle, [rad], in the shorter or the longer direction."""
        return cls(type="nullspace", psi=psi, way=way, speed=speed, blend=blend, dwell=dwell)

    @classmethod
    def retreat(
        cls, distance: float, *, speed: float = DEFAULT_SPEED, blend: float = 0.0, dwell: float = 0.0
    ) -> Waypoint:  # fmt: skip
        """Returns a straight line of the tool back along its z axis, [m]."""
        return cls(type="retreat", distance=distance, speed=speed, blend=blend, dwell=dwell)

    @classmethod
    def wait(cls, dwell: float) -> Waypoint:
        """Returns a time at standstill, [s]."""
        return cls(type="wait", dwell=dwell)

    @classmethod
    def await_input(cls, signal: int | str, level: bool = True, timeout: float = DEFAULT_TIMEOUT) -> Waypoint:
        """Returns a wait for an input, by number or name; after `timeout`, [s], the program ends with an error."""
        return cls(type="input", signal=signal, level=level, timeout=timeout)

    @classmethod
    def set_output(cls, signal: int | str, level: bool = True) -> Waypoint:
        """Returns the change of an output, by number or name; the tool does not stop for it."""
        return cls(type="output", signal=signal, level=level)

    @classmethod
    def use_tool(cls, jaws: Literal["close", "open"], dwell: float = 0.5) -> Waypoint:
        """Returns the closing or opening of the cell's jaws, and the time for it, [s]."""
        return cls(type="tool", jaws=jaws, dwell=dwell)

    @classmethod
    def repeat(
        cls, count: int, *, until: int | str | None = None, level: bool = True, text: str | None = None
    ) -> Waypoint:  # fmt: skip
        """Returns the begin of a block that runs `count` times, or until an input has a level; `Waypoint.end` ends it.

        Args:
            count: Number of repetitions; with `until` the largest one, after which the program ends with an error.
            until: The input, by number or name, which is read after every repetition.
            level: Its level.
            text: Name for display.
        """
        return cls(type="repeat", count=count, signal=until, level=None if until is None else level, text=text)

    @classmethod
    def group(cls, text: str) -> Waypoint:
        """Returns the begin of a named block, which runs once; `Waypoint.end` ends it."""
        return cls(type="group", text=text)

    @classmethod
    def end(cls) -> Waypoint:
        """Returns the end of a block."""
        return cls(type="end")

    @classmethod
    def comment(cls, text: str) -> Waypoint:
        """Returns a comment."""
        return cls(type="comment", text=text)

    @property
    def is_instruction(self) -> bool:
        """Whether nothing moves at this step."""
        return self.type in INSTRUCTIONS

    @property
    def pose(self) -> Pose | None:
        """The target as a pose in `frame`, if it was given as one."""
        return None if self.position is None or self.wxyz is None else Pose(self.position, self.wxyz)

    def retyped(self, type: WaypointType, via: ArrayLike | None = None) -> Waypoint:
        """Returns the waypoint with the same target and another path type: joint, line or arc.

        Args:
            type: New path type.
            via: A point on the arc, shape (3,), [m]; only an arc has one.

        Raises:
            InvalidValueError: One of the two types has no target, or `via` does not fit the type.
        """
        for kind in (self.type, type):
            if "q" not in ALLOWED.get(kind, ()):
                error = InvalidValueError("type", described(kind), "has no target; joint, line and arc have one")
                raise error.coded("no_target")
        point = None if via is None else vector_of("via", via)
        approach = self.approach if "approach" in ALLOWED[type] else None
        blend = 0.0 if type == "free" else self.blend
        return replace(self, type=type, via=point, via_wxyz=None, approach=approach, blend=blend)

    def in_base(self, T_base_frame: Pose | ArrayLike) -> Waypoint:
        """Returns the waypoint with its numbers in base; one that has no frame stays as it is.

        Args:
            T_base_frame: Pose of its frame in base, or a matrix, shape (4, 4).

        Raises:
            InvalidValueError: The pose is not valid, or a position is too far away from the base.
        """
        if self.frame is None:
            return self
        return replace(self, frame=None, **_transformed(self, as_pose(T_base_frame, "pose of the frame")))

    def in_frame(self, T_base_frame: Pose | ArrayLike, name: str) -> Waypoint:
        """Returns the waypoint, which is in base, with its numbers in a frame: the inverse of `in_base`.

        Args:
            T_base_frame: Pose of the frame in base, or a matrix, shape (4, 4).
            name: Name of the frame.

        Raises:
            InvalidValueError: The waypoint has a frame, or has only joint angles, or the pose or the name is not valid.
        """
        if self.frame is not None:
            raise InvalidValueError("frame", self.frame, "is the frame of this waypoint; use in_base(...) first")
        T_frame_base = as_pose(T_base_frame, "pose of the frame").inverse()
        return replace(self, frame=name, **_transformed(self, T_frame_base))

    def _require_target(self) -> None:
        if "q" not in ALLOWED[self.type]:
            return
        has_pose = self.position is not None or self.wxyz is not None
        if self.q is None and not has_pose:
            missing = InvalidValueError("target", None, f"is missing: {self.type} needs q, or position and wxyz")
            raise missing.coded("missing", type=self.type, names="q / position, wxyz")
        if self.q is not None:
            if has_pose:
                error = InvalidValueError("q", self.q, "is a second target in addition to position and wxyz; keep one")
                raise error.coded("second_target")
            if self.psi is not None:
                error = InvalidValueError("psi", self.psi, "is a second arm angle: q has one; omit psi")
                raise error.coded("second_angle")
            object.__setattr__(self, "q", angles_of(self.q, "q"))
        for name, other in (("position", "wxyz"), ("wxyz", "position")):
            if has_pose and getattr(self, name) is None:
                missing = InvalidValueError(name, None, f"is missing: a pose has {other} and {name}")
                raise missing.coded("missing_beside", other=other)

    def _require_frame(self) -> None:
        if self.frame is None:
            return
        if not (isinstance(self.frame, str) and self.frame.strip() and self.frame.isprintable()):
            error = InvalidValueError("frame", described(self.frame), "must be the name of a frame, text in one line")
            raise error.coded("one_line")
        if self.q is not None:
            problem = "has no meaning with q: joint angles are in no frame; give position and wxyz in place of q"
            raise InvalidValueError("frame", self.frame, problem).coded("frame_of_angles")
        object.__setattr__(self, "frame", self.frame.strip())

    def _require_instruction(self) -> None:
        if self.signal is not None:
            object.__setattr__(self, "signal", _require_signal(self.signal))
        if self.level is not None and not isinstance(self.level, bool | np.bool_):
            raise InvalidValueError("level", described(self.level), "must be True or False").coded("no_level")
        if self.type == "repeat" and self.signal is None and self.level is not None:
            raise InvalidValueError("level", self.level, "has no meaning without a signal").coded("level_alone")
        if self.count is not None:
            count = as_number(self.count, "count")
            if not (1 <= count <= MOST_REPEATS and count == int(count)):
                raise InvalidValueError("count", self.count, f"must be whole, 1 to {MOST_REPEATS}").coded(
                    "whole_span", low="1", high=str(MOST_REPEATS)
                )
            object.__setattr__(self, "count", int(count))
        if self.text is not None:
            if not (isinstance(self.text, str) and self.text.isprintable() and len(self.text) <= LONGEST_TEXT):
                problem = f"must be text in one line, at most {LONGEST_TEXT} characters"
                raise InvalidValueError("text", described(self.text), problem).coded("one_line")
            object.__setattr__(self, "text", self.text.strip())


def _require_signal(signal: object) -> int | str:
    """Returns the number or the name of a signal."""
    if isinstance(signal, str):
        if signal.strip() and signal.isprintable():
            return signal.strip()
        raise InvalidValueError("signal", described(signal), "must be a name, text in one line").coded("one_line")
    number = as_number(signal, "signal")
    if not (0 <= number <= LAST_SIGNAL and number == int(number)):
        raise InvalidValueError("signal", described(signal), f"must be whole, 0 to {LAST_SIGNAL}, or a name").coded(
            "whole_span", low="0", high=str(LAST_SIGNAL)
        )
    return int(number)


_DEFAULTS: dict[str, object] = {
    **{name: known[0] for name, known in CHOICES.items()}, "level": True, "timeout": DEFAULT_TIMEOUT
}  # fmt: skip
_VECTORS = ("position", "wxyz", "via", "via_wxyz", "center", "axis")
_COMMON_DEFAULTS = {field.name: field.default for field in fields(Waypoint) if field.name in COMMON_FIELDS}
_OPTIONAL = tuple(field.name for field in fields(Waypoint) if field.default is None)
_RANGES = (
    ("angle", 0.0, math.tau, "rad"),
    ("psi", -math.pi, math.pi, "rad"),
    ("approach", 0.0, LARGEST_OFFSET, "m"),
    ("distance", 0.0, LARGEST_OFFSET, "m"),
    ("timeout", 0.0, LONGEST_DWELL, "s"),
    ("speed", MIN_SPEED, 1.0, "part of the limits"),
    ("blend", 0.0, LARGEST_BLEND, "m"),
    ("dwell", 0.0, LONGEST_DWELL, "s"),
)


def label(number: int, waypoint: Waypoint) -> str:
    """Returns the name of a waypoint in errors, counted from 1."""
    return f"waypoint {number} ({waypoint.type})"


def named_value(number: int, kind: str, error: InvalidValueError) -> InvalidValueError:
    """Returns the error of a value, with its waypoint added."""
    named = InvalidValueError(f"waypoint {number} ({kind}), {error.name}", error.value, error.requirement)
    if not error.code:
        return named
    return named.coded("waypoint_value", number=number, kind=kind, name=error.name, reason=error)


def require_count(count: int) -> None:
    """Requires a number of waypoints from 1 to `MOST_WAYPOINTS`.

    Raises:
        InvalidValueError: It is not.
    """
    if not 1 <= count <= MOST_WAYPOINTS:
        raise InvalidValueError("waypoints", Unquoted(str(count)), f"must be 1 to {MOST_WAYPOINTS}").coded(
            "span", low="1", high=str(MOST_WAYPOINTS)
        )


def require_fit(waypoint: Waypoint, robot: RobotDescription) -> None:
    """Requires a waypoint that fits this arm.

    Raises:
        InvalidValueError: Its q does not have n angles, or it has an arm angle and the arm has none.
    """
    if waypoint.q is not None:
        angles_of(waypoint.q, "q", robot.n, robot.name)
    if (waypoint.psi is not None or waypoint.type == "nullspace") and not build_solver(robot).redundancy:
        problem = f"has no meaning for {robot.name}: a 6-axis arm has no arm angle"
        raise InvalidValueError("psi", waypoint.psi, problem).coded("six_axes", model=robot.name)


def angles_of(value: ArrayLike, name: str, n: int | None = None, robot: str = "") -> Floats:
    """Returns checked joint angles, [rad].

    Raises:
        InvalidValueError: Not 6 or 7 finite numbers, not as many as the arm's axes, or more than two turns.
    """
    size = n or (np.size(value) if np.size(value) in (6, 7) else 7)
    if n is not None and np.shape(value) != (n,):
        error = InvalidValueError(name, described(value), f"must be {n} joint angles [rad]: {robot} has {n} axes")
        raise error.coded("axes", count=n, model=robot)
    angles: Floats = tuple(as_vector(value, size, name, "rad").tolist())
    for joint, angle in enumerate(angles, 1):
        if abs(angle) > MAX_ANGLE:
            problem = f"rad of joint {joint} is more than two turns, {MAX_ANGLE:.4g} rad; multiply degrees by pi / 180"
            raise InvalidValueError(name, angle, problem).coded("turns", joint=joint)
    return angles


def _transformed(waypoint: Waypoint, T: Pose) -> dict[str, Floats]:
    """Returns position, orientation, via, centre and axis, as far as a waypoint has them, transformed by T."""
    found: dict[str, Floats] = {}
    for name in ("position", "via", "center"):
        if (point := getattr(waypoint, name)) is not None:
            found[name] = tuple((T @ np.array(point)).tolist())
    for name in ("wxyz", "via_wxyz"):
        if (wxyz := getattr(waypoint, name)) is not None:
            found[name] = tuple((T @ Pose(wxyz=wxyz)).wxyz.tolist())
    if waypoint.axis is not None:
        found["axis"] = tuple((T.rotation @ waypoint.axis).tolist())
    return found


def _require_choice(name: str, value: object) -> None:
    known = CHOICES[name]
    if value is not None and not (isinstance(value, str) and value in known):
        error = InvalidValueError(name, described(value), f"is unknown; known: {', '.join(known)}")
        raise error.coded("unknown", known=", ".join(known))


def _target(target: Pose | ArrayLike) -> dict[str, Any]:
    if isinstance(target, Pose) or is_transform(target):
        target = as_pose(target, "target")
        return {"position": tuple(target.position.tolist()), "wxyz": tuple(target.wxyz.tolist())}
    if np.size(target) not in (6, 7):
        problem = "is not a target: pass a Pose (position and wxyz), or joint angles, 6 or 7 numbers [rad]"
        raise InvalidValueError("target", described(target), problem).coded("target_shape")
    return {"q": angles_of(target, "q")}


def vector_of(name: str, value: ArrayLike) -> Floats:
    """Returns a checked point [m], axis, or unit quaternion if the name ends with wxyz.

    Raises:
        InvalidValueError: Not 3 finite numbers, or 4 for a quaternion; too far away, or its length is not valid.
    """
    numbers: Floats = tuple(
        as_vector(
            value, 4 if name.endswith("wxyz") else 3, name, "" if name.endswith(("wxyz", "axis")) else "m"
        ).tolist()
    )
    if name.endswith("wxyz"):
        if abs((length := math.hypot(*numbers)) - 1.0) > _UNIT_TOLERANCE:
            problem = f"has length {length:.4g}, must be 1 within {_UNIT_TOLERANCE:g}: a unit quaternion, w first"
            raise InvalidValueError(name, numbers, problem).coded("no_unit")
    elif name == "axis":
        if math.hypot(*numbers) < 1e-12:
            raise InvalidValueError(name, numbers, "has no direction: its length is zero").coded("no_direction")
    elif max(map(abs, numbers)) > MAX_COORDINATE:
        error = InvalidValueError(
            name, numbers, f"is beyond {MAX_COORDINATE:g} m; if it is in millimetres, divide by 1000"
        )
        raise error.coded("beyond", most=f"{MAX_COORDINATE:g}")
    return numbers
