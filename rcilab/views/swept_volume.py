"""The swept volume of an arm: the capsules of its links at several configurations in one mesh."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, as_path
from rcilab.robots.mesh import Mesh, merge_meshes, revolve
from rcilab.robots.shapes import Capsule, build_shapes
from rcilab.robots.upright import upright_joints
from rcilab.views.arm_view import DrawableModel

_ROUND = 12  # Segments around a capsule.


def swept_mesh(model: DrawableModel, q: ArrayLike) -> Mesh:
    """Returns a mesh of the moving links, simplified to capsules, at several configurations.

    Args:
        model: The arm.
        q: Joint angles, shape (N, n), [rad].
    """
    joints = upright_joints(model.description)
    shapes = [[_capsule(c) for c in link.capsules] for link in build_shapes(model.description, "coarse").links]
    found: list[Mesh] = []
    for row in as_path(q, len(joints), "q", "rad").tolist():
        T = np.eye(4)
        for joint, shape, angle in zip(joints, shapes, row, strict=True):
            T = T @ _joint_transform(joint.origin, joint.axis, angle)
            found += [Mesh(mesh.vertices @ T[:3, :3].T + T[:3, 3], mesh.faces) for mesh in shape]
    return merge_meshes(found)


def _capsule(capsule: Capsule) -> Mesh:
    start, end = np.asarray(capsule.start, dtype=np.float64), np.asarray(capsule.end, dtype=np.float64)
    axis = end - start
    length = float(np.linalg.norm(axis))
    angles = [0.5 * math.pi * step / 3.0 for step in range(4)]
    low = [(capsule.radius * math.cos(a), -capsule.radius * math.sin(a)) for a in reversed(angles)]
    high = [(capsule.radius * math.cos(a), length + capsule.radius * math.sin(a)) for a in angles]
    profile = [(max(radius, 0.0), height) for radius, height in (*low, *high)]
    mesh = revolve(profile, segments=_ROUND)
    z = axis / length if length > 0.0 else np.array((0.0, 0.0, 1.0))
    x = np.cross(z, (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0))
    x /= np.linalg.norm(x)
    return Mesh(mesh.vertices @ np.stack((x, np.cross(z, x), z)) + start, mesh.faces)


def _joint_transform(origin: Array, axis: Array, angle: float) -> Array:
    """Returns a translation followed by a rotation about a unit axis (Rodrigues), shape (4, 4)."""
    x, y, z = axis
    across = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    T = np.eye(4)
    T[:3, :3] += math.sin(angle) * across + (1.0 - math.cos(angle)) * (across @ across)
    T[:3, 3] = origin
    return T
