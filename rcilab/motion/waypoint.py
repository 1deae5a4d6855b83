"""Waypoints: the steps of a program, as plain numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import MAX_ANGLE, Unquoted, as_number, as_vector, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose, as_pose, is_transform
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.motion.joint import DEFAULT_SPEED, MIN_SPEED
from rcilab.motion.path import CircleOrientation, ElbowDirection
from rcilab.robots.description import RobotDescription

WaypointType: TypeAlias = Literal["joint", "line", "arc", "circle", "nullspace"]

MAX_COORDINATE = 10.0
"""Largest coordinate, [m]: far beyond the reach of an arm; a larger one is probably in millimetres."""
LARGEST_BLEND = 1.0
"""Largest blend radius, [m]: about the reach of an arm."""
LONGEST_DWELL = 3600.0
"""Longest dwell at a waypoint, [s]."""
_UNIT_TOLERANCE = 1e-3
"""Largest difference of a quaternion's length from 1; it is normalised."""

COMMON_FIELDS = ("speed", "blend", "dwell")
"""Fields of every waypoint."""
ALLOWED: dict[WaypointType, tuple[str, ...]] = {
    "joint": ("q", "position", "wxyz", "frame", "psi"),
    "line": ("q", "position", "wxyz", "frame", "psi"),
    "arc": ("via", "via_wxyz", "q", "position", "wxyz", "frame", "psi"),
    "circle": ("center", "axis", "frame", "angle", "orientation", "psi"),
    "nullspace": ("psi", "way"),
}
"""Further fields of a waypoint by type."""
REQUIRED: dict[WaypointType, tuple[str, ...]] = {
    "joint": (),
    "line": (),
    "arc": ("via",),
    "circle": ("center", "axis"),
    "nullspace": ("psi",),
}
"""Required fields in addition to a target; the target of a joint move, a line and an arc is q, or position and wxyz."""

CHOICES: dict[str, tuple[str, ...]] = {"orientation": get_args(CircleOrientation), "way": get_args(ElbowDirection)}
"""Values of the fields that have a fixed set of them; the first is the default."""

Floats: TypeAlias = tuple[float, ...]

MOST_WAYPOINTS = 10_000
"""Largest number of waypoints; a motion through them takes a gigabyte."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """One step of a program, as plain numbers, so that waypoints can be compared and files are exact.

    `Waypoint.joint`, `.line`, `.arc`, `.circle` and `.nullspace` build one from poses and arrays.

    Raises:
        InvalidValueError: A number is missing, out of range or not used by this type.
    """

    type: WaypointType
    """joint: straight in joint space. line, arc: the tool on a straight line, or through `via`. circle: around
    `center`. nullspace: only the elbow moves."""
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
        allowed = (*ALLOWED[self.type], *COMMON_FIELDS)
        for name, known in CHOICES.items():
            if getattr(self, name) is None and name in allowed:
                object.__setattr__(self, name, known[0])
        for name in _OPTIONAL:
            value = getattr(self, name)
            if value is not None and name not in allowed:
                problem = f"has no meaning here; {self.type} takes: {', '.join(allowed)}"
                raise InvalidValueError(name, described(value), problem).coded(
                    "no_meaning", type=self.type, known=", ".join(allowed)
                )
            if value is None and name in REQUIRED[self.type]:
                missing = InvalidValueError(
                    name, None, f"is missing: {self.type} needs {', '.join(REQUIRED[self.type])}"
                )
                raise missing.coded("missing", type=self.type, names=", ".join(REQUIRED[self.type]))
            if name in CHOICES:
                _require_choice(name, value)
            elif value is not None and name not in ("q", "frame", "angle", "psi"):
                object.__setattr__(self, name, vector_of(name, value))
        self._require_target()
        self._require_frame()
        for name, lowest, highest, unit in _RANGES:
            value = getattr(self, name)
            if value is None:
                continue
            number = as_number(value, name, unit)
            if not lowest <= number <= highest or (name == "angle" and number == 0.0):
                span = f"{'more than 0' if name == 'angle' else f'{lowest:.5g}'} to {highest:.5g} [{unit}]"
                error = InvalidValueError(name, number, f"must be from {span}")
                raise error.coded("span", low=f"{lowest:.5g}", high=f"{highest:.5g}")
            object.__setattr__(self, name, number)

    @classmethod
    def joint(
        cls, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED, blend: float = 0.0,
        dwell: float = 0.0, frame: str | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a straight move in joint space, to joint angles, shape (n,), [rad], or to a pose of the tool.

        A pose, in base or in a named frame, is reached on the branch closest to the previous joint angles.
        """
        return cls(type="joint", **_target(target), frame=frame, psi=psi, speed=speed, blend=blend, dwell=dwell)

    @classmethod
    def line(
        cls, target: Pose | ArrayLike, *, psi: float | None = None, speed: float = DEFAULT_SPEED, blend: float = 0.0,
        dwell: float = 0.0, frame: str | None = None,
    ) -> Waypoint:  # fmt: skip
        """Returns a straight line of the tool to a pose, or to the pose at joint angles, shape (n,), [rad].

        The pose is in base, or in a named frame.
        """
        return cls(type="line", **_target(target), frame=frame, psi=psi, speed=speed, blend=blend, dwell=dwell)

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
        return replace(self, type=type, via=point, via_wxyz=None)

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


_OPTIONAL = tuple(field.name for field in fields(Waypoint) if field.default is None)
_RANGES = (
    ("angle", 0.0, math.tau, "rad"),
    ("psi", -math.pi, math.pi, "rad"),
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
