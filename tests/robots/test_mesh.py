"""Meshes, bodies of revolution and the STL they are written as."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from rcilab.robots.mesh import Mesh, encode_stl, merge_meshes, mirror_y, revolve, shrink

CAN = [(0.0, 0.0), (0.1, 0.0), (0.1, 0.3), (0.0, 0.3)]  # (radius, height) of a can: radius 0.1 m, height 0.3 m


def volume(mesh: Mesh) -> float:
    """Signed volume: positive where faces look outward."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_revolved_profile_is_the_body_it_describes_facing_outward(axis: str) -> None:
    mesh = revolve(CAN, axis=axis, center=(1.0, -2.0, 0.5), segments=256)  # type: ignore[arg-type]
    assert volume(mesh) == pytest.approx(np.pi * 0.1**2 * 0.3, rel=2e-4)  # a polygon is thinner than its circle
    along = "xyz".index(axis)
    span = np.ptp(mesh.vertices, axis=0)
    assert span[along] == pytest.approx(0.3)
    assert mesh.vertices[:, along].min() == pytest.approx((1.0, -2.0, 0.5)[along])


def test_sharp_edges_have_their_vertices_twice_and_soft_ones_once() -> None:
    sharp = revolve(CAN, segments=12)
    bent = [(0.1, 0.0), (0.1, 0.1), (0.098, 0.12)]
    assert len(sharp.vertices) == 6 * 12
    assert len(revolve(bent, segments=12).vertices) == 3 * 12


def test_a_mirrored_mesh_still_faces_outward() -> None:
    can = revolve(CAN, axis="y", center=(0.0, 0.2, 0.0), segments=64)
    assert volume(mirror_y(can)) == pytest.approx(volume(can))
    assert mirror_y(can).vertices[:, 1].max() == pytest.approx(-0.2)


def test_shrinking_moves_the_surface_inward_by_the_depth() -> None:
    tube = revolve([(0.1, 0.0), (0.1, 0.5)], segments=128)
    assert np.linalg.norm(shrink(tube, 0.003).vertices[:, :2], axis=1) == pytest.approx(0.097, abs=1e-5)


def test_merging_keeps_every_triangle_where_it_was() -> None:
    low, high = revolve(CAN), revolve(CAN, center=(0.0, 0.0, 1.0))
    both = merge_meshes([low, high])
    assert volume(both) == pytest.approx(2.0 * volume(low))
    assert both.vertices[both.faces[len(low.faces) :]].min(axis=(0, 1))[2] == pytest.approx(1.0)


def test_stl_is_header_count_and_fifty_bytes_a_triangle_with_outward_normals() -> None:
    can = revolve(CAN, segments=16)
    data = encode_stl(can, "a can")
    (count,) = struct.unpack_from("<I", data, 80)
    records = np.frombuffer(data[84:], dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("tag", "<u2")])
    assert data.startswith(b"a can")
    assert len(data) == 84 + 50 * count == 84 + 50 * len(can.faces)
    centers = records["v"].mean(axis=1) - (0.0, 0.0, 0.15)
    assert (np.einsum("ij,ij->i", records["n"], centers) > 0.0).all()
    assert np.linalg.norm(records["n"], axis=1) == pytest.approx(1.0, abs=1e-6)
