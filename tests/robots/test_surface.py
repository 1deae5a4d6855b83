"""Bodies given by distances, and the mesh of their surface."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.robots.surface import box, cut, cylinder, join, mesh_surface, rod, vase


def ball(p: Array, radius: float = 0.1) -> Array:
    return np.linalg.norm(p, axis=1) - radius


def volume(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def test_a_meshed_ball_is_round_closed_and_faces_outward() -> None:
    mesh = mesh_surface(ball, (-0.13,) * 3, (0.13,) * 3, 0.01)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(0.1, abs=1e-6)
    assert volume(mesh) == pytest.approx(4.0 / 3.0 * np.pi * 0.1**3, rel=0.01)
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 2).all()  # every edge between exactly two triangles: no hole


def test_meshing_twice_gives_the_same_bytes() -> None:
    one, two = (mesh_surface(ball, (-0.13,) * 3, (0.13,) * 3, 0.02) for _ in range(2))
    assert one.vertices.tobytes() == two.vertices.tobytes()
    assert one.faces.tobytes() == two.faces.tobytes()


def test_primitives_are_zero_on_their_surface_and_negative_inside() -> None:
    p = np.array([[0.0, 0.2, 0.3], [0.0, 0.2, 0.25], [0.05, 0.2, 0.3]])
    upright = cylinder(p, 1, 0.0, 0.4, 0.05, 0.01, (0.0, 0.25))
    assert upright == pytest.approx([0.0, -0.05, np.hypot(0.05, 0.05) - 0.05], abs=1e-12)
    assert rod(p, (0.0, 0.2, 0.0), (0.0, 0.2, 1.0), 0.05, 0.05) == pytest.approx([-0.05, -0.05, 0.0], abs=1e-12)
    assert box(np.array([[0.3, 0.0, 0.0]]), (0.0, 0.0, 0.0), (0.2, 0.2, 0.2), 0.02) == pytest.approx([0.1])
    tall = vase(np.array([[0.06, 0.0, 0.0], [0.0, 0.04, 1.0]]), (-0.1, 1.1), (0.2, 0.8), (0.06, 0.04))
    assert tall == pytest.approx([0.0, 0.0], abs=1e-12)


def test_blends_touch_only_the_seam() -> None:
    far, near = np.array([0.5, -0.2]), np.array([0.1, 0.1])
    assert join(far, near, 0.02) == pytest.approx([0.1, -0.2])  # apart by more than the blend: the plain union
    assert join(np.array([0.0]), np.array([0.0]), 0.02) == pytest.approx([-0.005])
    assert cut(np.array([-0.3]), np.array([0.2]), 0.02) == pytest.approx([-0.2])
