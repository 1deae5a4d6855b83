"""The electronic fence: a box or a plane that the moving links must not leave, or must stay out of.

The links are the capsules of the collision check, by points along their axes. An arm that is beyond the fence may move
back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Remark
from rcilab.makers.realman.wire.line import Request
from rcilab.model.robot_model import RobotModel

BOX, PLANE = 1, 2
"""Forms; the wire also has spheres, which are for virtual walls."""
Side = Literal["inside", "outside"]
_BOX_FIELDS: Final = tuple(f"{axis}_{end}_limit" for axis in "xyz" for end in ("min", "max"))
_PLANE_FIELDS: Final = tuple(f"{axis}{point}" for point in (1, 2, 3) for axis in "xyz")
_MILLIMETRE = 1e-3  # [m]
_POINTS = 5  # Along the axis of a capsule; a tuning value.
_TOLERANCE = 1e-4  # [m] By which an arm beyond the fence may move farther out: servo error and rounding.
_SMALLEST_AREA = 1e-6  # [m^2] Of the triangle of a plane's points.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fence:
    """The form of a fence."""

    form: int
    """`BOX` or `PLANE`."""
    numbers: tuple[int, ...]
    """As on the wire, [mm]: ends along x, y and z, or three points of the plane."""

    @classmethod
    def read(cls, request: Request) -> Fence:
        """Returns the fence of a request.

        Raises:
            InvalidValueError: It is neither a box nor a plane, or has no volume or no direction.
        """
        form = request.integer("form")
        if form not in (BOX, PLANE):
            raise InvalidValueError("form", form, "must be 1 (box) or 2 (plane)")
        names = _BOX_FIELDS if form == BOX else _PLANE_FIELDS
        fence = cls(form=form, numbers=tuple(request.integer(name) for name in names))
        if form == BOX and not (np.diff(fence._metres.reshape(3, 2)) > 0.0).all():
            raise InvalidValueError("fence", fence.numbers, "must have each minimum below its maximum")
        if form == PLANE and np.linalg.norm(fence._cross) < _SMALLEST_AREA:
            raise InvalidValueError("fence", fence.numbers, "must have three points that are not on a line")
        return fence

    @property
    def fields(self) -> Mapping[str, int]:
        """The numbers by their names on the wire."""
        return dict(zip(_BOX_FIELDS if self.form == BOX else _PLANE_FIELDS, self.numbers, strict=True))

    def excess(self, points: Array, radii: Array, side: Side) -> Array:
        """Returns how far balls are beyond the fence, shape (N,), [m]; negative on the allowed side.

        Args:
            points: Their centres in base, shape (N, 3), [m].
            radii: Shape (N,), [m].
            side: Where the arm has to be. Inside of a plane is the side of the base's origin.
        """
        if self.form == BOX:
            low, high = self._metres.reshape(3, 2).T
            beyond = np.maximum(low - points, points - high)
            outside: Array = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
            distance = np.where(outside > 0.0, outside, beyond.max(axis=1))
            return (beyond.max(axis=1) if side == "inside" else -distance) + radii
        first, normal = self._metres[:3], self._cross / np.linalg.norm(self._cross)
        if normal @ first < 0.0:  # From the base to the plane.
            normal = -normal
        distance = (points - first) @ normal
        return (distance if side == "inside" else -distance) + radii

    @property
    def _metres(self) -> Array:
        return _MILLIMETRE * np.array(self.numbers, dtype=np.float64)

    @property
    def _cross(self) -> Array:
        first, second, third = self._metres.reshape(3, 3)
        return np.cross(second - first, third - first)


class FenceWatch:
    """Observes the distance of the moving links from a fence. Owned by the controller.

    Args:
        model: The arm.
    """

    def __init__(self, model: RobotModel) -> None:
        geometry = model.collision_geometry()
        share = np.linspace(0.0, 1.0, _POINTS)[:, np.newaxis]
        self._body, self._n = model.rigid_body, model.n
        self._points: list[tuple[int, Array]] = []
        radii: list[float] = []
        numbers: list[int] = []
        for number, capsules in enumerate(geometry.bodies[1 : model.n + 1], start=1):
            along = [capsule.start + share * (capsule.end - capsule.start) for capsule in capsules]
            self._points.append((number, np.concatenate(along)))
            radii += [capsule.radius for capsule in capsules for _ in range(_POINTS)]
            numbers += [number] * len(radii[len(numbers) :])
        self._radii, self._numbers = readonly_copy(radii), numbers
        self._least = np.inf  # Largest distance beyond the fence that is allowed, [m].

    def begin(self) -> None:
        """Begins to observe a motion, or another fence."""
        self._least = np.inf

    def step(self, q: JointVector, fence: Fence, side: Side) -> Remark | None:
        """Returns which link has gone beyond the fence, or None.

        Args:
            q: Measured joint angles, shape (n,), [rad].
            fence: The fence.
            side: Where the arm has to be.
        """
        excess = self._excess(q, fence, side)
        farthest = int(excess.argmax())
        value = float(excess[farthest])
        if value <= self._least:
            self._least = min(self._least, value + _TOLERANCE) if value > 0.0 else 0.0
            return None
        link = self._numbers[farthest]
        sentence = f"link {link} is {1e3 * value:.2g} mm beyond the electronic fence"
        return Remark(sentence, "beyond_fence", link=link, value=value, bound=0.0, unit="m")

    def _excess(self, q: JointVector, fence: Fence, side: Side) -> Array:
        poses = ((self._body.link_pose(q, number), points) for number, points in self._points)
        placed = [points @ pose.rotation.T + pose.position for pose, points in poses]
        return fence.excess(np.concatenate(placed), self._radii, side)
