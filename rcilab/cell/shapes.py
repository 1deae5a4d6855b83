"""Shapes of the solids in a cell, each about the origin of its own frame, and their JSON names."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, as_number, as_vector, readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, as_pose

LARGEST = 100.0  # [m]
"""Largest length of a shape: a hall; a larger one is probably in millimetres."""
MOST_TRIANGLES = 200_000
"""Largest number of triangles of a mesh; tuning value: more slow the browser down."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box, centred.

    Raises:
        InvalidValueError: An edge is not above 0, or longer than 100 m.
    """

    size: tuple[float, ...]
    """Edges along x, y and z, [m]."""

    def __post_init__(self) -> None:
        edges = as_vector(self.size, 3, "size", "m").tolist()
        object.__setattr__(self, "size", tuple(_length(edge, "size") for edge in edges))


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """A cylinder around the z axis, centred.

    Raises:
        InvalidValueError: A length is not above 0, or longer than 100 m.
    """

    radius: float
    """[m]."""
    length: float
    """Along z, [m]."""

    def __post_init__(self) -> None:
        for name in ("radius", "length"):
            object.__setattr__(self, name, _length(as_number(getattr(self, name), name, "m"), name))


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere:
    """A sphere, centred.

    Raises:
        InvalidValueError: The radius is not above 0, or longer than 100 m.
    """

    radius: float
    """[m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(as_number(self.radius, "radius", "m"), "radius"))


@dataclass(frozen=True, slots=True)
class Plane:
    """An infinite wall: solid below the plane z = 0 of its frame, free above it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeshShape:
    """A triangle mesh. Two are equal if their triangles are.

    Raises:
        InvalidValueError: It has no triangle, too many, a vertex that is not finite, or an index without a vertex.
    """

    vertices: Array = field(compare=False)
    """Shape (V, 3), [m]."""
    faces: NDArray[np.int32] = field(compare=False)
    """Indices into `vertices`, counter-clockwise seen from outside, shape (F, 3)."""
    file: str = field(default="", compare=False)
    """Name of the file that it was read from; empty without one."""
    scale: float = field(default=1.0, compare=False)
    """Factor on the lengths of the file, to metres."""
    digest: str = field(init=False)
    """SHA-256 of vertices and faces, hexadecimal."""

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64)
        faces = np.array(self.faces, dtype=np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
            raise InvalidValueError("mesh", self.file or "it", "must have vertices (V, 3) and at least one face (F, 3)")
        if len(faces) > MOST_TRIANGLES:
            raise InvalidValueError("mesh", len(faces), f"has more than {MOST_TRIANGLES} triangles; reduce it")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InvalidValueError("mesh", self.file or "it", "has a face whose vertex does not exist")
        if not np.isfinite(vertices).all():
            raise InvalidValueError("mesh", self.file or "it", "has a vertex that is not finite")
        if np.abs(vertices).max() > LARGEST:
            problem = f"reaches beyond {LARGEST:g} m; if it is in millimetres, use scale 0.001"
            raise InvalidValueError("mesh", self.file or "it", problem)
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", readonly_copy(vertices))
        object.__setattr__(self, "faces", faces)
        content = self.vertices.tobytes() + faces.tobytes()
        object.__setattr__(self, "digest", hashlib.sha256(content).hexdigest())

    def __repr__(self) -> str:
        return f"<MeshShape {self.file or self.digest[:8]}: {len(self.faces)} triangles>"


Shape: TypeAlias = Box | Cylinder | Sphere | Plane | MeshShape

SHAPES: dict[str, type[Box | Cylinder | Sphere | Plane | MeshShape]] = {
    "box": Box,
    "cylinder": Cylinder,
    "sphere": Sphere,
    "plane": Plane,
    "mesh": MeshShape,
}
"""Shapes by their name in a file."""


def shape_name(shape: Shape) -> str:
    """Returns the name of a shape in a file."""
    return next(name for name, kind in SHAPES.items() if isinstance(shape, kind))


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """A shape at a pose.

    Raises:
        InvalidValueError: The shape or the pose is not valid.
    """

    shape: Shape
    pose: Pose = IDENTITY
    """In the frame of what it belongs to."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", require_shape(self.shape))
        object.__setattr__(self, "pose", as_pose(self.pose, "pose"))


def require_shape(shape: object) -> Shape:
    """Returns a shape.

    Raises:
        InvalidValueError: It is something else.
    """
    if isinstance(shape, Box | Cylinder | Sphere | Plane | MeshShape):
        return shape
    raise InvalidValueError("shape", type(shape).__name__, f"is not a shape; there are: {', '.join(SHAPES)}")


def _length(value: float, name: str) -> float:
    if not 0.0 < value <= LARGEST:
        raise InvalidValueError(name, value, f"must be above 0 and at most {LARGEST:g} m")
    return value
