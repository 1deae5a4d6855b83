"""The picture of the arm: proportions, budgets, and housings that stay out of each other."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.robots import ROBOT_NAMES, describe_robot
from rcilab.robots.mesh import Mesh
from rcilab.robots.shapes import LinkShape, build_shapes
from rcilab.robots.upright import upright_joints

arms = pytest.mark.parametrize("name", ROBOT_NAMES)
xmates = pytest.mark.parametrize("name", ROBOTS)


def shell(shape: LinkShape) -> Mesh:
    return next(part.mesh for part in shape.parts if part.role == "shell")


def winding_number(points: Array, mesh: Mesh) -> Array:
    """How often a mesh wraps around each point: about 1 inside, 0 outside (van Oosterom and Strackee 1983).

    With a, b, c from a point p to the corners of a face, a (b x c) is linear in p, and 2 a b = a^2 + b^2 - (a - b)^2.
    """
    corners = mesh.vertices[mesh.faces]  # (faces, 3, 3)
    v, w, x = corners.transpose(1, 0, 2)
    triple = np.einsum("ij,ij->i", v, np.cross(w, x)) - points @ (np.cross(v, w) + np.cross(w, x) + np.cross(x, v)).T
    distances = np.linalg.norm(points[:, None] - mesh.vertices[None], axis=2)
    la, lb, lc = (distances[:, mesh.faces[:, i]] for i in range(3))
    ab, bc, ca = (((one - other) ** 2).sum(axis=1) for one, other in ((v, w), (w, x), (x, v)))
    aa, bb, cc = la * la, lb * lb, lc * lc
    cosines = 2.0 * la * lb * lc + (aa + bb - ab) * lc + (bb + cc - bc) * la + (cc + aa - ca) * lb
    return np.arctan2(2.0 * triple, cosines).sum(axis=1) / (2.0 * np.pi)


def outside_capsules(points: Array, shape: LinkShape) -> Array:
    distances = []
    for capsule in shape.capsules:
        line = capsule.end - capsule.start
        t = np.clip((points - capsule.start) @ line / (line @ line), 0.0, 1.0)
        distances.append(np.linalg.norm(points - capsule.start - t[:, None] * line, axis=1) - capsule.radius)
    return np.min(distances, axis=0)


@xmates
def test_an_arm_stands_on_the_floor_and_ends_at_its_flange(name: str) -> None:
    description = describe_robot(name)
    shape = build_shapes(description)
    heights = [0.0, *(link.origin_height for link in description.links)]
    points = np.concatenate(
        [
            part.mesh.vertices + (0.0, 0.0, height)
            for link, height in zip((shape.base, *shape.links), heights, strict=True)
            for part in link.parts
        ]
    )
    assert points[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert points[:, 2].max() == pytest.approx(description.links[-1].origin_height, abs=3e-4)  # bolt heads
    assert np.abs(points[:, :2]).max() < 0.14  # slim: a hand wide on either side


@xmates
def test_the_arm_fits_its_triangle_budget_and_has_every_colour(name: str) -> None:
    fine, coarse = (build_shapes(describe_robot(name), quality) for quality in ("fine", "coarse"))
    assert 20_000 < fine.triangles < 40_000
    assert coarse.triangles < 0.5 * fine.triangles
    used = {part.role for shape in fine.links for part in shape.parts}
    assert used == {"shell", "cap", "dark"}


@arms
def test_every_mesh_is_finite_well_indexed_and_faces_outward(name: str) -> None:
    shape = build_shapes(describe_robot(name))
    for link in (shape.base, *shape.links):
        for part in link.parts:
            mesh = part.mesh
            assert np.isfinite(mesh.vertices).all()
            assert mesh.faces.min() >= 0
            assert mesh.faces.max() < len(mesh.vertices)
        body = shell(link)
        a, b, c = (body.vertices[body.faces[:, i]] for i in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 > 5e-5  # [m^3] positive: not inside out


@xmates
def test_neighbouring_housings_stay_out_of_each_other_while_the_joint_bends(name: str) -> None:
    description = describe_robot(name)
    shape = build_shapes(description, "coarse")
    bodies = [shell(link) for link in (shape.base, *shape.links)]
    for number, joint in enumerate(upright_joints(description), start=1):
        below, points = bodies[number - 1], bodies[number].vertices[::6]
        for angle in np.radians([-90.0, 0.0, 60.0, 90.0]):
            turn = Pose(joint.origin, [np.cos(angle / 2), *(np.sin(angle / 2) * joint.axis)]).matrix
            inside = winding_number(points @ turn[:3, :3].T + turn[:3, 3], below) > 0.6
            # A collar's rim may dip a millimetre into the neighbour's rounded edge; a bad cut shows ten times that.
            assert inside.mean() < 0.06, f"joint {number} at {np.degrees(angle):.0f} deg"


@arms
def test_capsules_cover_the_housings(name: str) -> None:
    for shape in build_shapes(describe_robot(name)).links:
        points = np.concatenate([part.mesh.vertices for part in shape.parts])
        outside = outside_capsules(points, shape)
        assert outside.max() < 0.012  # [m] rims of caps and collars
        assert np.percentile(outside, 85) < 0.004


def test_the_panda_stands_on_the_floor_ends_at_its_flange_and_needs_few_triangles() -> None:
    description = describe_robot("Panda")
    fine, coarse = (build_shapes(description, quality) for quality in ("fine", "coarse"))
    base = np.concatenate([part.mesh.vertices for part in fine.base.parts])
    assert base[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    hand = np.concatenate([part.mesh.vertices for part in fine.links[-1].parts])
    assert hand[:, 2].min() == pytest.approx(0.0, abs=1e-3)  # its flange looks down
    assert 2_000 < coarse.triangles < 4_000
    assert coarse.triangles < 0.5 * fine.triangles


def test_shapes_are_built_once() -> None:
    assert build_shapes(describe_robot("xMate3")) is build_shapes(describe_robot("xmate3"))


def test_the_7_kg_arm_is_thicker_than_the_3_kg_arm() -> None:
    slim, strong = (shell(build_shapes(describe_robot(name)).links[0]) for name in ("xMatePro3", "xMatePro7"))
    assert np.ptp(strong.vertices[:, 0]) > 1.1 * np.ptp(slim.vertices[:, 0])
