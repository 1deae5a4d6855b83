"""Geometric paths of the tool: the straight line and the arc of the manual's blocking moves (3.5), and the circle.

By default the orientation is a slerp from start to goal in the path length. The arm angle is always linear in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, as_number, as_vector, described
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose, Rotation9, as_pose, rotation_from_wxyz, wxyz_from_rotation
from rcilab.motion.orientation_path import Slerp, Turning, turn_through, turn_to
from rcilab.motion.s_curve import STANDSTILL_DISTANCE

_COLLINEAR = 1e-4
"""Sine of the angle between two chords below which three points are collinear: the radius would be 5 000 chords."""

_MIN_AXIS_LENGTH = 1e-12
"""Length of a vector below which it has no direction."""
_OUT_OF_PLANE = 1e-6
"""Largest distance of the start from the plane of its circle, in radii; the circle is moved into the start's plane."""

Point: TypeAlias = tuple[float, float, float]

ArcOrientation = Literal["through_via", "start_to_goal"]
"""Orientation of the tool on an arc: through that of via, or one slerp that ignores it, as in the vendor's."""
CircleOrientation = Literal["held", "turning"]
"""Orientation of the tool on a circle: constant, or turning with the circle, about its axis."""
ElbowDirection: TypeAlias = Literal["shorter", "longer"]
"""Direction in which the arm angle changes; either may cross +-pi."""


@dataclass(frozen=True, slots=True)
class Circle:
    """The circle through the first, a middle and the last point of an arc, in base."""

    center: Point
    """Centre, [m]."""
    first: Point
    """From the centre to the first point, [m]."""
    second: Point
    """Perpendicular to `first` and of the same length, towards the middle point, [m]."""
    angle: float
    """Angle from the first point through the middle one to the last, in (0, 2 pi], [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """Poses of the tool in base, and arm angles, as functions of the share of the path length, 0 to 1."""

    start: Pose
    goal: Pose
    psi_start: float | None
    """Arm angle at the start, [rad]; None: not part of the path."""
    psi_goal: float | None
    """Arm angle at the goal, [rad]."""
    circle: Circle | None
    """None for a straight line."""
    distance: float
    """Path length of the tool, [m]; for a pure rotation, or a change of the arm angle alone, the angle, [rad]. 0 if
    start and goal are the same."""
    unit: str
    """Unit of `distance`: m or rad."""
    turn: float
    """Largest rate of the tool's rotation by the share, [rad]; for a uniform rotation the whole angle."""
    turning: Turning | None = None
    """Rotation of the tool; None is the slerp from start to goal."""

    @property
    def name(self) -> str:
        """Name for messages."""
        if self.circle is not None:
            return "circle" if self.circle.angle == math.tau else "arc"
        return "line" if self.unit == "m" or self.turn > STANDSTILL_DISTANCE else "null-space motion"

    def at(self, share: float) -> tuple[Pose, float | None]:
        """Returns pose and arm angle, [rad], at a share of the path."""
        if share >= 1.0:
            return self.goal, self.psi_goal
        if share <= 0.0:
            return self.start, self.psi_start
        (ra, a), (rb, b) = self.start.parts, self.goal.parts
        if self.circle is None:
            position = (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))
        else:
            c, e, f = self.circle.center, self.circle.first, self.circle.second
            x, y = math.cos(share * self.circle.angle), math.sin(share * self.circle.angle)
            position = (c[0] + x * e[0] + y * f[0], c[1] + x * e[1] + y * f[1], c[2] + x * e[2] + y * f[2])
        psi = None
        if self.psi_start is not None and self.psi_goal is not None:
            psi = self.psi_start + share * (self.psi_goal - self.psi_start)
        if self.turning is None:
            return Pose.from_parts(slerp(ra, rb, share), position), psi
        return Pose.from_parts(_rotation(self.turning.sample(np.array([share]))[0]), position), psi

    def positions(self, shares: Array) -> Array:
        """Returns positions of the tool, shape (N, 3), [m], at many shares, shape (N,), also below 0 and above 1."""
        if self.circle is None:
            a, b = np.array(self.start.parts[1]), np.array(self.goal.parts[1])
            points = np.multiply.outer(b - a, shares)
            points += a[:, np.newaxis]
            return points.T
        c, e, f = (np.array(point) for point in (self.circle.center, self.circle.first, self.circle.second))
        angles = shares * self.circle.angle
        points = np.multiply.outer(e, np.cos(angles))
        points += np.multiply.outer(f, np.sin(angles))
        points += c[:, np.newaxis]
        return points.T

    def sample(self, shares: Array) -> tuple[Array, Array | None]:
        """Returns poses, shape (N, 4, 4), and arm angles, shape (N,), [rad], at many shares, shape (N,).

        Shares may be below 0 and above 1, for finite differences at the ends.
        """
        ra, rb = self.start.parts[0], self.goal.parts[0]
        # Each element contiguous in memory, because the inverse along a path computes with columns.
        T = np.zeros((4, 4, len(shares))).transpose(2, 0, 1)
        T[:, 3, 3] = 1.0
        T[:, :3, :3] = (self.turning or turn_to(ra, rb)).sample(shares)
        T[:, :3, 3] = self.positions(shares)
        if self.psi_start is None or self.psi_goal is None:
            return T, None
        return T, self.psi_start + shares * (self.psi_goal - self.psi_start)


def build_line(start: Pose, goal: Pose, psi_start: float | None = None, psi_goal: float | None = None) -> Path:
    """Returns the straight line from start to goal.

    The path length is that of the tool. For a pure rotation it is the angle, about any axis (the vendor's helper agrees
    for rotations about base z and uses another number for the rest); if only the arm angle changes, it is that change.

    Args:
        start: Pose of the tool in base at the start.
        goal: Pose of the tool in base at the end.
        psi_start: Arm angle at the start, [rad]; None leaves it open.
        psi_goal: Arm angle at the end, [rad]; it changes in proportion to the path length, never across +-pi.

    Raises:
        InvalidValueError: A pose is not valid.
    """
    start, goal = as_pose(start, "start"), as_pose(goal, "goal")
    turn = _angle_between(start, goal)
    return _path(start, goal, psi_start, psi_goal, None, math.dist(start.parts[1], goal.parts[1]), turn)


def build_arc(
    start: Pose,
    via: Pose,
    goal: Pose,
    psi_start: float | None = None,
    psi_goal: float | None = None,
    *,
    orientation: ArcOrientation = "start_to_goal",
) -> Path:
    """Returns the arc from start through via to goal.

    Args:
        start: Pose of the tool in base at the start.
        via: A pose whose position lies on the arc.
        goal: Pose of the tool in base at the end.
        psi_start: Arm angle at the start, [rad]; None leaves it open.
        psi_goal: Arm angle at the end, [rad].
        orientation: "start_to_goal": by slerp from start to goal; that of `via` is ignored, as in the vendor's helper.
            "through_via": exactly through that of `via` at its position, in the shorter direction before and after
            it, with continuous angular velocity and acceleration (`ViaOrientation`).

    Raises:
        PlanningError: The three positions lie on a line, or two of them are the same.
        InvalidValueError: A pose is not valid, or the orientation is unknown.
    """
    start, via, goal = as_pose(start, "start"), as_pose(via, "via"), as_pose(goal, "goal")
    _require_choice("orientation", orientation, get_args(ArcOrientation))
    circle = _circle(start.position, via.position, goal.position)
    distance = circle.angle * math.hypot(*circle.first)
    if orientation == "start_to_goal":
        return _path(start, goal, psi_start, psi_goal, circle, distance, _angle_between(start, goal))
    to_via = via.position - circle.center
    via_share = math.atan2(float(to_via @ circle.second), float(to_via @ circle.first)) % math.tau / circle.angle
    turning = turn_through(start.parts[0], via.parts[0], goal.parts[0], via_share)
    return _path(start, goal, psi_start, psi_goal, circle, distance, turning.max_rate, turning)


def build_circle(
    start: Pose,
    center: ArrayLike,
    axis: ArrayLike,
    angle: float = math.tau,
    psi_start: float | None = None,
    psi_goal: float | None = None,
    *,
    orientation: CircleOrientation = "held",
) -> Path:
    """Returns the circle, or a part of it, from start around a centre.

    Args:
        start: Pose of the tool in base at the start.
        center: Centre of the circle in base, shape (3,), [m].
        axis: Direction of the circle's axis in base, shape (3,), of any length, perpendicular to the line from the
            centre to start; the tool goes around it by the right-hand rule.
        angle: How far, more than 0 and up to 2 pi, [rad].
        psi_start: Arm angle at the start, [rad]; None leaves it open.
        psi_goal: Arm angle at the end, [rad].
        orientation: "held": that of the start, constant. "turning": the tool turns with the circle, about its axis
            and by the same angle, so that the same side of it faces the centre.

    Raises:
        PlanningError: Start is the centre, or not in the plane through the centre perpendicular to the axis.
        InvalidValueError: `start` is not a pose, a number is not finite or out of range, or the orientation is unknown.
    """
    start = as_pose(start, "start")
    _require_choice("orientation", orientation, get_args(CircleOrientation))
    center_position, normal = as_vector(center, 3, "center", "m"), as_vector(axis, 3, "axis")
    angle = as_number(angle, "angle", "rad")
    if not 0.0 < angle <= math.tau:
        raise InvalidValueError(
            "angle", angle, "must be more than 0, up to 2 pi [rad]; reverse the axis for the other direction"
        )
    length = float(np.linalg.norm(normal))
    if length < _MIN_AXIS_LENGTH:
        raise InvalidValueError("axis", normal.tolist(), "has no direction: its length is zero")
    normal = normal / length
    first = start.position - center_position
    radius = float(np.linalg.norm(first))
    height = float(first @ normal)
    if radius <= STANDSTILL_DISTANCE:
        error = PlanningError(
            f"the centre of the circle is the tool's position, {_text(center_position)}; move it away"
        )
        raise error.coded("circle_centre")
    if abs(height) > _OUT_OF_PLANE * radius:
        raise PlanningError(
            f"the tool at {_text(start.position)} is {1e3 * abs(height):.2f} mm out of the plane of the circle; "
            f"choose the centre at its height along the axis: {_text(center_position + height * normal)}"
        ).coded("circle_plane", height=abs(float(height)))
    first = start.position - (center_position + height * normal)
    circle = Circle(_point(center_position + height * normal), _point(first), _point(np.cross(normal, first)), angle)
    turned = center_position + height * normal + math.cos(angle) * first + math.sin(angle) * np.cross(normal, first)
    rotation = start.parts[0]
    turning = None
    if orientation == "turning":
        # The axis in the tool's axes, in which the rotation about it does not move it.
        turning = Slerp(rotation, _point(angle * (normal @ start.rotation)))
        rotation = _rotation(turning.sample(np.ones(1))[0])
    end = start if angle == math.tau else Pose.from_parts(rotation, _point(turned))
    turn = 0.0 if turning is None else turning.max_rate
    return _path(start, end, psi_start, psi_goal, circle, angle * float(np.linalg.norm(first)), turn, turning)


def circle_through(start: Pose, second: Pose, third: Pose) -> tuple[Array, Array]:
    """Returns centre and axis of the circle through three positions in their order, each of shape (3,), [m].

    Raises:
        PlanningError: The three positions lie on a line, or two of them are the same.
        InvalidValueError: A pose is not valid.
    """
    start, second, third = as_pose(start, "start"), as_pose(second, "second"), as_pose(third, "third")
    circle = _circle(start.position, second.position, third.position)
    return np.array(circle.center), np.cross(circle.first, circle.second)


def _path(
    start: Pose, goal: Pose, psi_start: float | None, psi_goal: float | None, circle: Circle | None, length: float,
    turn: float, turning: Turning | None = None,
) -> Path:  # fmt: skip
    distance, unit = length, "m"
    if length <= STANDSTILL_DISTANCE:
        elbow_turn = 0.0 if psi_start is None or psi_goal is None else abs(psi_goal - psi_start)
        distance, unit = max(turn, elbow_turn), "rad"
        if distance <= STANDSTILL_DISTANCE:
            distance = 0.0
    return Path(
        start=start, goal=goal, psi_start=psi_start, psi_goal=psi_goal, circle=circle, distance=distance, unit=unit,
        turn=turn, turning=turning,
    )  # fmt: skip


def _circle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> Circle:
    to_b, to_c = b - a, c - a
    normal = np.cross(to_b, to_c)
    chords = sorted(float(np.linalg.norm(chord)) for chord in (to_b, to_c, c - b))
    if chords[0] <= STANDSTILL_DISTANCE:
        raise PlanningError(
            f"two of the three points of the arc are the same (start {_text(a)}, via {_text(b)}, goal {_text(c)}); "
            "an arc needs three different points"
        ).coded("arc_same")
    if float(np.linalg.norm(normal)) <= _COLLINEAR * chords[1] * chords[2]:
        raise PlanningError(
            f"the three points of the arc lie on a line (start {_text(a)}, via {_text(b)}, goal {_text(c)}); "
            "move via off the line, or use a straight line"
        ).coded("arc_line")
    # The circumcentre seen from a: https://en.wikipedia.org/wiki/Circumcircle, "higher dimensions".
    spread = float(to_b @ to_b) * to_c - float(to_c @ to_c) * to_b
    square = float(normal @ normal)
    offset = np.cross(spread, normal) / (2.0 * square)
    center, first = a + offset, -offset
    second = np.cross(normal / math.sqrt(square), first)
    last = c - center
    angle = math.atan2(float(last @ second), float(last @ first)) % math.tau
    return Circle(_point(center), _point(first), _point(second), angle)


def slerp(a: Rotation9, b: Rotation9, share: float) -> Rotation9:
    """Returns the slerp from a to b at a share, in the shorter direction (Shoemake 1985)."""
    qa, qb = wxyz_from_rotation(a), wxyz_from_rotation(b)
    dot = qa[0] * qb[0] + qa[1] * qb[1] + qa[2] * qb[2] + qa[3] * qb[3]
    if dot < 0.0:
        qb, dot = (-qb[0], -qb[1], -qb[2], -qb[3]), -dot
    angle = math.acos(min(1.0, dot))
    if angle < 1e-9:
        wa, wb = 1.0 - share, share
    else:
        sine = math.sin(angle)
        wa, wb = math.sin((1.0 - share) * angle) / sine, math.sin(share * angle) / sine
    return rotation_from_wxyz([wa * x + wb * y for x, y in zip(qa, qb, strict=True)])


def _rotation(matrix: Array) -> Rotation9:
    a, b, c, d, e, f, g, h, i = matrix.ravel().tolist()
    return a, b, c, d, e, f, g, h, i


def _angle_between(a: Pose, b: Pose) -> float:
    """Returns the angle of the rotation from a to b, 0 to pi, [rad]."""
    w, x, y, z = wxyz_from_rotation((a.inverse() @ b).parts[0])
    return 2.0 * math.atan2(math.hypot(x, y, z), w)


def _require_choice(name: str, value: object, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InvalidValueError(name, described(value), f"is unknown; known: {', '.join(known)}")


def _point(values: np.ndarray) -> Point:
    x, y, z = values.tolist()
    return x, y, z


def _text(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in values.tolist()) + ") m"
