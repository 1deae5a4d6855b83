"""Poses and rotations: one value type, and one converter for every notation.

The same transform has many spellings. `T_base_tool` here = RCI `toolTobase_pos` (16 numbers, row-major) = libfranka
`O_T_EE` (16 numbers, column-major) = pinocchio `SE3` (quaternion xyzw) = MuJoCo and viser (position and quaternion
wxyz). Inside the package a quaternion is always wxyz.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from struct import Struct
from typing import Any, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from rcilab.core.arrays import Array, Matrix, Vector3, as_vector, described
from rcilab.core.errors import InvalidValueError

Rotation9: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
"""A rotation matrix as nine floats, row-major, for scalar code on the 1 kHz path."""

UNIT_TOLERANCE = 1e-5
"""Largest deviation of rows and columns of a rotation from unit length; the vendor's client uses the same."""

PERPENDICULAR_TOLERANCE = 1e-4
"""Largest cosine of the angle between two rows. The vendor's client does not check it; a rotation rounded to five
decimals passes."""

_NUMBERS = Struct("<16d")
_SHORTEST, _LONGEST = (1.0 - UNIT_TOLERANCE) ** 2, (1.0 + UNIT_TOLERANCE) ** 2  # Squared lengths.
_EXACT = 1e-12
"""A rotation matrix with a larger error is orthonormalised."""

_NEAR_HALF_TURN = -0.9
"""Cosine of an angle above which the skew part of a rotation matrix loses digits of the axis."""


class Pose:
    """A rigid transform; read as `T_a_b`, the pose of frame b in frame a, so that neighbours cancel in products.

    Args:
        position: Origin of b in a, shape (3,), [m].
        wxyz: Orientation of b in a as a quaternion, shape (4,); normalised here.

    Raises:
        InvalidValueError: An element is not finite, or the quaternion has no direction.
    """

    __slots__ = ("_p", "_r")
    __array_ufunc__ = None  # numpy then leaves `matrix @ pose` to __rmatmul__.

    _r: Rotation9
    _p: tuple[float, float, float]

    def __init__(self, position: ArrayLike = (0.0, 0.0, 0.0), wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> None:
        x, y, z = as_vector(position, 3, "position", "m").tolist()
        quaternion = as_vector(wxyz, 4, "wxyz").tolist()
        self._p = (x, y, z)
        self._r = rotation_from_wxyz(quaternion)

    @classmethod
    def from_parts(cls, rotation: Rotation9, position: tuple[float, float, float]) -> Pose:
        """Builds a pose from a valid rotation (row-major) and a position, [m]. Not checked."""
        pose = object.__new__(cls)
        pose._r = rotation
        pose._p = position
        return pose

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Pose:
        """Builds a pose from a homogeneous transform, shape (4, 4).

        Raises:
            InvalidValueError: It is not a proper rigid transform.
        """
        try:
            m = np.array(matrix, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidValueError("pose", described(matrix), "must be a 4 x 4 matrix of numbers") from error
        if m.shape != (4, 4):
            shown = described(m) if m.ndim else matrix
            raise InvalidValueError("pose", shown, "needs shape (4, 4)")
        if not np.isfinite(m).all():
            row, column = (int(i) for i in np.argwhere(~np.isfinite(m))[0])
            raise InvalidValueError(f"pose[{row}, {column}]", float(m[row, column]), "must be finite")
        if not np.array_equal(m[3], (0.0, 0.0, 0.0, 1.0)):
            raise InvalidValueError("pose", m[3].tolist(), "must have 0 0 0 1 as its last row")
        a, b, c, d, e, f, g, h, i = m[:3, :3].ravel().tolist()
        rotation: Rotation9 = (a, b, c, d, e, f, g, h, i)
        error = find_rotation_error(rotation)
        if error is not None:
            raise InvalidValueError("pose", m[:3, :3].tolist(), error)
        if np.abs(m[:3, :3] @ m[:3, :3].T - np.eye(3)).max() > _EXACT:
            rotation = rotation_from_wxyz(wxyz_from_rotation(rotation))
        x, y, z = m[:3, 3].tolist()
        return cls.from_parts(rotation, (x, y, z))

    @classmethod
    def from_row_major(cls, numbers: Sequence[float]) -> Pose:
        """Builds a pose from 16 numbers in row-major order, as in the RCI.

        Raises:
            InvalidValueError: They are not a proper rigid transform.
        """
        return cls.from_matrix(as_vector(numbers, 16, "pose, row-major").reshape(4, 4))

    @classmethod
    def from_rpy(cls, position: ArrayLike, rpy: ArrayLike) -> Pose:
        """Builds a pose from roll, pitch and yaw: turns about the fixed x, then y, then z axis, [rad]."""
        roll, pitch, yaw = as_vector(rpy, 3, "rpy", "rad").tolist()
        x, y, z = as_vector(position, 3, "position", "m").tolist()
        return cls.from_parts(rotation_from_rpy(roll, pitch, yaw), (x, y, z))

    @property
    def position(self) -> Vector3:
        """Origin, shape (3,), [m]."""
        return np.array(self._p)

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix, shape (3, 3); its columns are the axes of b in a."""
        return np.array(self._r).reshape(3, 3)

    @property
    def wxyz(self) -> Array:
        """Orientation as a unit quaternion with w >= 0, shape (4,)."""
        return np.array(wxyz_from_rotation(self._r))

    @property
    def rpy(self) -> Array:
        """Roll, pitch and yaw about the fixed x, y and z axes, shape (3,), [rad]; roll is 0 in gimbal lock."""
        return np.array(rpy_from_rotation(self._r))

    @property
    def matrix(self) -> Matrix:
        """Homogeneous transform, shape (4, 4)."""
        return np.array(self.as_row_major()).reshape(4, 4)

    @property
    def parts(self) -> tuple[Rotation9, tuple[float, float, float]]:
        """Rotation, row-major, and position as plain floats."""
        return self._r, self._p

    def as_row_major(self) -> tuple[float, ...]:
        """Returns the 16 numbers of the transform in row-major order, as in the RCI."""
        r, p = self._r, self._p
        return (
            r[0], r[1], r[2], p[0],
            r[3], r[4], r[5], p[1],
            r[6], r[7], r[8], p[2],
            0.0, 0.0, 0.0, 1.0,
        )  # fmt: skip

    def tobytes(self) -> bytes:
        """Returns the numbers as in datagrams and recordings: 16 little-endian doubles."""
        return _NUMBERS.pack(*self.as_row_major())

    def inverse(self) -> Pose:
        """Returns the pose of a in b."""
        r, (x, y, z) = self._r, self._p
        return Pose.from_parts(
            (r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]),
            (
                -(r[0] * x + r[3] * y + r[6] * z),
                -(r[1] * x + r[4] * y + r[7] * z),
                -(r[2] * x + r[5] * y + r[8] * z),
            ),
        )

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Matrix:
        return np.array(self.as_row_major(), dtype=dtype).reshape(4, 4)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...

    @overload
    def __matmul__(self, other: ArrayLike) -> Any: ...

    def __matmul__(self, other: Pose | ArrayLike) -> Any:
        """Returns `T_a_c` for `T_a_b @ T_b_c`, also for a matrix (4, 4), or points of b expressed in a.

        Args:
            other: A pose, or points of shape (3,) or (N, 3), [m]; points keep their shape.

        Raises:
            InvalidValueError: The other factor is neither a pose nor points.
        """
        if not isinstance(other, Pose):
            return self._times_array(other)
        a, (px, py, pz) = self._r, self._p
        b, (qx, qy, qz) = other._r, other._p
        return Pose.from_parts(
            (
                a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
                a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
                a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
                a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
                a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
                a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
                a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
                a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
                a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
            ),
            (
                px + a[0] * qx + a[1] * qy + a[2] * qz,
                py + a[3] * qx + a[4] * qy + a[5] * qz,
                pz + a[6] * qx + a[7] * qy + a[8] * qz,
            ),
        )

    def __rmatmul__(self, other: ArrayLike) -> Pose:
        return as_pose(other) @ self

    def _times_array(self, other: object) -> Pose | Array:
        if is_transform(other):
            return self @ as_pose(other)
        try:
            points = np.asarray(other, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise _pose_error("pose", other) from None
        if points.ndim not in (1, 2) or points.shape[-1] != 3:
            raise InvalidValueError("factor", described(other), "must be a Pose, or points of shape (3,) or (N, 3)")
        return points @ self.rotation.T + self.position

    def is_close(self, other: Pose | ArrayLike, tolerance: float = 1e-9) -> bool:
        """Returns whether no element of the two transforms differs by more than `tolerance`."""
        other = as_pose(other)
        numbers = other._r + other._p
        return all(abs(x - y) <= tolerance for x, y in zip(self._r + self._p, numbers, strict=True))

    def __repr__(self) -> str:
        x, y, z = self._p
        roll, pitch, yaw = (math.degrees(angle) for angle in rpy_from_rotation(self._r))
        return f"Pose(x={x:.4f}, y={y:.4f}, z={z:.4f} m; roll={roll:.2f}, pitch={pitch:.2f}, yaw={yaw:.2f} deg)"


def is_transform(value: object) -> bool:
    """Returns whether a value has the shape of a homogeneous transform, (4, 4)."""
    try:
        return np.shape(value) == (4, 4)  # type: ignore[arg-type]
    except ValueError:  # Rows of different lengths.
        return False


def as_pose(value: object, name: str = "pose", advice: str = "") -> Pose:
    """Returns a pose that was passed as a `Pose` or as a homogeneous transform, shape (4, 4).

    Args:
        value: The argument.
        name: Name of the argument in an error.
        advice: End of the error message.

    Raises:
        InvalidValueError: It is neither, or not finite, or not a proper rigid transform.
    """
    if isinstance(value, Pose):
        rotation, position = value.parts
        if not math.isfinite(sum(rotation) + sum(position)):
            raise InvalidValueError(name, repr(value), "must be finite in every element")
        return value
    try:
        return Pose.from_matrix(value)  # type: ignore[arg-type]
    except InvalidValueError as error:
        if is_transform(value):
            raise InvalidValueError(name, described(value), error.requirement) from error
        raise _pose_error(name, value, advice) from None


def _pose_error(name: str, value: object, advice: str = "") -> InvalidValueError:
    return InvalidValueError(name, described(value), f"must be a Pose or a matrix of shape (4, 4){advice}")


IDENTITY = Pose.from_parts((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def find_rotation_error(r: Rotation9) -> str | None:
    """Returns why nine finite numbers, row-major, are not a rotation matrix; None if they are one, within rounding."""
    a, b, c, d, e, f, g, h, i = r
    squares = (
        a * a + b * b + c * c, d * d + e * e + f * f, g * g + h * h + i * i,
        a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i,
    )  # fmt: skip
    least, most = min(squares), max(squares)
    if least < _SHORTEST or most > _LONGEST:
        off = max(1.0 - math.sqrt(least), math.sqrt(most) - 1.0)
        return f"is not a rotation: a row or column is {off:.3g} off unit length, {UNIT_TOLERANCE:g} is allowed"
    cosine = max(abs(a * d + b * e + c * f), abs(a * g + b * h + c * i), abs(d * g + e * h + f * i))
    if cosine > PERPENDICULAR_TOLERANCE:
        allowed = f"{PERPENDICULAR_TOLERANCE:g} is allowed"
        return f"is not a rotation: the cosine between two rows is {cosine:.3g}, {allowed}"
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0:
        return "is a reflection, not a rotation"
    return None


def rotation_from_wxyz(wxyz: Sequence[float]) -> Rotation9:
    """Returns the rotation matrix, row-major, of a quaternion of any length above zero.

    Raises:
        InvalidValueError: The quaternion is zero and has no direction.
    """
    w, x, y, z = wxyz
    norm = w * w + x * x + y * y + z * z
    if norm < 1e-24:
        raise InvalidValueError("wxyz", tuple(wxyz), "has no direction: its norm is zero")
    s = 2.0 / norm
    return (
        1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),
        s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y),
    )  # fmt: skip


def wxyz_from_rotation(r: Rotation9) -> tuple[float, float, float, float]:
    """Returns the unit quaternion, w >= 0, of a rotation matrix given row-major (Shepperd's method)."""
    trace = r[0] + r[4] + r[8]
    if trace > 0.0:
        s = 2.0 * math.sqrt(1.0 + trace)
        w, x, y, z = s / 4.0, (r[7] - r[5]) / s, (r[2] - r[6]) / s, (r[3] - r[1]) / s
    elif r[0] >= r[4] and r[0] >= r[8]:
        s = 2.0 * math.sqrt(1.0 + r[0] - r[4] - r[8])
        w, x, y, z = (r[7] - r[5]) / s, s / 4.0, (r[1] + r[3]) / s, (r[2] + r[6]) / s
    elif r[4] >= r[8]:
        s = 2.0 * math.sqrt(1.0 - r[0] + r[4] - r[8])
        w, x, y, z = (r[2] - r[6]) / s, (r[1] + r[3]) / s, s / 4.0, (r[5] + r[7]) / s
    else:
        s = 2.0 * math.sqrt(1.0 - r[0] - r[4] + r[8])
        w, x, y, z = (r[3] - r[1]) / s, (r[2] + r[6]) / s, (r[5] + r[7]) / s, s / 4.0
    norm = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), w)
    return w / norm, x / norm, y / norm, z / norm


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Rotation9:
    """Returns RotZ(yaw) RotY(pitch) RotX(roll), row-major; angles in [rad]."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
        sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
        -sp, cp * sr, cp * cr,
    )  # fmt: skip


def rpy_from_rotation(r: Rotation9) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw, [rad], of a rotation matrix given row-major; roll is 0 in gimbal lock."""
    cosine = math.hypot(r[0], r[3])
    pitch = math.atan2(-r[6], cosine)
    if cosine < 1e-9:
        return 0.0, pitch, math.atan2(-r[1], r[4])
    return math.atan2(r[7], r[8]), pitch, math.atan2(r[3], r[0])


def rotation_between(old: Rotation9, new: Rotation9) -> tuple[float, float, float]:
    """Returns the rotation vector, [rad], from `old` to `new`, in the axes in which both are given.

    Its direction is the axis, its length the angle, 0 to pi: log(R_new R_old^T). Accurate also for the small rotations
    of one cycle, where the trace alone would lose half of the digits.

    Args:
        old: Rotation matrix, row-major.
        new: Rotation matrix, row-major.
    """
    a, b, c, d, e, f, g, h, i = old
    p, q, r, s, t, u, v, w, x = new
    sx = 0.5 * ((v * d + w * e + x * f) - (s * g + t * h + u * i))
    sy = 0.5 * ((p * g + q * h + r * i) - (v * a + w * b + x * c))
    sz = 0.5 * ((s * a + t * b + u * c) - (p * d + q * e + r * f))
    sine = math.sqrt(sx * sx + sy * sy + sz * sz)
    cosine = 0.5 * (p * a + q * b + r * c + s * d + t * e + u * f + v * g + w * h + x * i - 1.0)
    if cosine > _NEAR_HALF_TURN:
        scale = math.atan2(sine, cosine) / sine if sine > 1e-8 else 1.0
        return scale * sx, scale * sy, scale * sz
    # Near pi the skew part vanishes and the symmetric part, cos I + (1 - cos) a a^T, gives the axis a. Its largest
    # diagonal element names the most accurate column.
    m = (
        (p * a + q * b + r * c, p * d + q * e + r * f, p * g + q * h + r * i),
        (s * a + t * b + u * c, s * d + t * e + u * f, s * g + t * h + u * i),
        (v * a + w * b + x * c, v * d + w * e + x * f, v * g + w * h + x * i),
    )
    k = max(range(3), key=lambda j: m[j][j])
    axis = [0.5 * (m[j][k] + m[k][j]) - (cosine if j == k else 0.0) for j in range(3)]
    size = math.copysign(math.hypot(*axis), axis[0] * sx + axis[1] * sy + axis[2] * sz)
    scale = math.atan2(sine, cosine) / size
    return scale * axis[0], scale * axis[1], scale * axis[2]
