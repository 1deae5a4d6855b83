"""A wrench at another point and in other axes: that on the tool, as a controller reports it for a frame of its own."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.spatial import Rotation9


def wrench_at(wrench: Array, origin: Sequence[float], point: Sequence[float]) -> Array:
    """Returns the same wrench at another point; its axes are kept.

    Args:
        wrench: Force first, shape (6,), [N, N m].
        origin: The point that it refers to, 3 numbers in its axes, [m].
        point: The other point, 3 numbers in its axes, [m].
    """
    fx, fy, fz, mx, my, mz = wrench.tolist()
    ax, ay, az = (here - there for here, there in zip(origin, point, strict=True))
    return readonly_copy((fx, fy, fz, mx + ay * fz - az * fy, my + az * fx - ax * fz, mz + ax * fy - ay * fx))


def wrench_in(wrench: Array, axes: Rotation9) -> Array:
    """Returns the same wrench in other axes; its point is kept.

    Args:
        wrench: Force first, shape (6,), [N, N m].
        axes: The other axes in those of the wrench, as the columns of a rotation, row-major.
    """
    fx, fy, fz, mx, my, mz = wrench.tolist()
    return readonly_copy((*_rotated_back(axes, fx, fy, fz), *_rotated_back(axes, mx, my, mz)))


def _rotated_back(r: Rotation9, x: float, y: float, z: float) -> tuple[float, float, float]:
    return r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z
