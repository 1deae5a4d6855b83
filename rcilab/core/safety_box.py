"""The safety box: a box that the tool must not leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import hypot

import numpy as np

from rcilab.core.arrays import Array, as_vector, described
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose, as_pose

_STRAIGHT = 1e-6  # [rad] Rounding of a turn that is zero.


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyBox:
    """A box in the base frame. It bounds the origin of the tool frame, not the links.

    Raises:
        InvalidValueError: An edge is not a positive, finite length, or the pose is not valid.
    """

    size: tuple[float, ...]
    """Edge lengths along x, y and z of its frame, three numbers, [m]."""
    T_base_box: Pose
    """Pose of its centre."""
    active: bool = True
    """Whether it is enforced; an inactive box has no effect."""

    def __post_init__(self) -> None:
        """Checks the values."""
        try:
            size = tuple(as_vector(self.size, 3, "safety box size", "m").tolist())
        except InvalidValueError as error:
            raise InvalidValueError(error.name, error.value, "must be three lengths above 0 [m]") from error
        if not all(edge > 0.0 for edge in size):
            raise InvalidValueError("safety box size", size, "must be three lengths above 0 [m]")
        object.__setattr__(self, "T_base_box", as_pose(self.T_base_box, "safety box pose"))
        object.__setattr__(self, "size", size)

    def excess(self, position: Sequence[float]) -> float:
        """Returns the distance of a point from the box, [m], negative inside.

        Args:
            position: The point in the base frame, three numbers, [m].
        """
        r, (cx, cy, cz) = self.T_base_box.parts
        x, y, z = position[0] - cx, position[1] - cy, position[2] - cz
        length, width, height = self.size
        dx = abs(r[0] * x + r[3] * y + r[6] * z) - 0.5 * length
        dy = abs(r[1] * x + r[4] * y + r[7] * z) - 0.5 * width
        dz = abs(r[2] * x + r[5] * y + r[8] * z) - 0.5 * height
        if dx <= 0.0 and dy <= 0.0 and dz <= 0.0:
            return max(dx, dy, dz)
        return hypot(dx if dx > 0.0 else 0.0, dy if dy > 0.0 else 0.0, dz if dz > 0.0 else 0.0)

    def exceeded_face(self, position: Sequence[float] | Array) -> tuple[str, float]:
        """Returns the face that a point exceeds most, such as "+x", and by how much, [m]; negative inside.

        Args:
            position: The point in the base frame, three numbers, [m].
        """
        local = self.T_base_box.rotation.T @ (np.asarray(position) - self.T_base_box.position)
        beyond = np.abs(local) - 0.5 * np.array(self.size)
        axis = int(beyond.argmax())
        return ("+" if local[axis] >= 0.0 else "−") + "xyz"[axis], float(beyond[axis])

    def excess_path(self, positions: Array) -> Array:
        """Returns `excess` for many points.

        Args:
            positions: Points in the base frame, shape (N, 3), [m].

        Returns:
            Shape (N,), [m].
        """
        local = (positions - self.T_base_box.position) @ self.T_base_box.rotation
        beyond = np.abs(local) - 0.5 * np.array(self.size)
        outside: Array = np.sqrt(np.square(np.maximum(beyond, 0.0)).sum(axis=1))
        return np.where(outside > 0.0, outside, beyond.max(axis=1))

    def corners(self) -> Array:
        """Returns its corners in the base frame, shape (8, 3), [m]."""
        signs = np.array(list(product((-0.5, 0.5), repeat=3)))
        return signs * np.array(self.size) @ self.T_base_box.rotation.T + self.T_base_box.position


class EntryBox:
    """A safety box for a tool that starts outside it: the faces it starts beyond may only be crossed inwards.

    Such a face moves with the tool until the tool is inside; the other faces are those of the box. Owned by one
    monitor, which calls it once per cycle.

    Args:
        box: The safety box.
        positions: Start positions of the tool in the base frame, three numbers each, [m]; the farthest one counts.
    """

    _ROUNDING = 1e-6  # [m] Outward motion that rounding may cause in a tool that is commanded to stay.

    def __init__(self, box: SafetyBox, *positions: Sequence[float]) -> None:
        self._box = box
        self._half = [0.5 * edge for edge in box.size]
        self._faces = [
            (min(-half, min(x) - self._ROUNDING), max(half, max(x) + self._ROUNDING))
            for half, *x in zip(self._half, *map(self._local, positions), strict=True)
        ]

    def excess(self, position: Sequence[float]) -> float:
        """Returns the distance of a point from the extended box, [m]; see `SafetyBox.excess`.

        Args:
            position: The point in the base frame, three numbers, [m].
        """
        beyond = self._beyond(self._local(position))
        deepest = max(beyond)
        return deepest if deepest <= 0.0 else hypot(*(max(0.0, distance) for distance in beyond))

    def exceeded_face(self, position: Sequence[float]) -> tuple[float, str, float]:
        """Returns the excess over the extended box, [m], the face, such as "+x", and the excess over the box, [m].

        Args:
            position: The point in the base frame, three numbers, [m].
        """
        local = self._local(position)
        beyond = self._beyond(local)
        axis = beyond.index(max(beyond))
        name = ("+" if local[axis] >= 0.0 else "−") + "xyz"[axis]
        return beyond[axis], name, abs(local[axis]) - self._half[axis]

    def _beyond(self, local: Sequence[float]) -> list[float]:
        """Returns the excess of a point along each axis, [m], then moves the extended faces inwards to the point."""
        beyond = [max(low - x, x - high) for x, (low, high) in zip(local, self._faces, strict=True)]
        self._faces = [
            (min(-half, max(low, x - self._ROUNDING)), max(half, min(high, x + self._ROUNDING)))
            for x, half, (low, high) in zip(local, self._half, self._faces, strict=True)
        ]
        return beyond

    def _local(self, position: Sequence[float]) -> tuple[float, float, float]:
        r, (cx, cy, cz) = self._box.T_base_box.parts
        x, y, z = position[0] - cx, position[1] - cy, position[2] - cz
        return r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z


def box_for_start(box: SafetyBox | None, *positions: Sequence[float]) -> SafetyBox | EntryBox | None:
    """Returns the box for a tool with these start positions: the safety box, one extended to the start, or None.

    Args:
        box: The safety box; None or an inactive one gives None.
        positions: Start positions of the tool, measured and commanded, in the base frame, three numbers each, [m].
    """
    box = active_box(box)
    return box if box is None or max(map(box.excess, positions)) <= 0.0 else EntryBox(box, *positions)


def require_box(box: object) -> SafetyBox:
    """Returns `box` if it is a `SafetyBox`, active or not.

    Raises:
        InvalidValueError: It is something else; the message says how to construct one.
    """
    if isinstance(box, SafetyBox):
        return box
    raise InvalidValueError("box", described(box), "must be a SafetyBox; use SafetyBox(size=..., T_base_box=...)")


def require_straight(box: SafetyBox) -> SafetyBox:
    """Returns `box` if it has the axes of the base, as the boundary of some controllers.

    Raises:
        InvalidValueError: It is turned.
    """
    turns = box.T_base_box.rpy
    if float(np.abs(turns).max()) <= _STRAIGHT:
        return box
    roll, pitch, yaw = np.degrees(turns).round(3).tolist()
    raise InvalidValueError(
        "roll, pitch, yaw of the safety box",
        [roll, pitch, yaw],
        "must be 0 deg: the boundary of this controller has the axes of the base; leave the turn out",
    ).coded("box_turned", turns=tuple(float(turn) for turn in turns))


def active_box(box: object) -> SafetyBox | None:
    """Returns the safety box if it is active, else None.

    Raises:
        InvalidValueError: It is something else.
    """
    if box is None:
        return None
    bound = require_box(box)
    return bound if bound.active else None
