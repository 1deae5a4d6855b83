"""Clicks on the surface of a cell: the nearest point, its normal, and a tool against it."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame, Obstacle
from rcilab.cell.ray_cast import cast_ray
from rcilab.cell.shapes import Box, Cylinder, Sphere
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose

TURNED = Pose.from_rpy((0.5, 0.1, 0.2), (0.1, 0.2, 0.3))
CELL = Cell(
    model="xMatePro7",
    T_world_base=Pose((0.0, 0.0, 0.5)),
    frames=(Frame(name="tray", T_parent_frame=Pose((0.0, 0.0, 0.5)) @ TURNED),),
    obstacles=(
        Obstacle(name="box", shape=Box(size=(0.2, 0.3, 0.1)), frame="tray"),
        Obstacle(name="ball", shape=Sphere(radius=0.1), pose=Pose((-0.6, 0.0, 0.9))),
        Obstacle(name="post", shape=Cylinder(radius=0.05, length=0.4), pose=Pose((0.0, 0.9, 0.7))),
    ),
)


@pytest.mark.parametrize("seed", range(20))
def test_a_ray_to_a_point_of_a_box_finds_it_with_the_normal_of_its_face(seed):
    rng = np.random.default_rng(seed)
    axis, side = rng.integers(3), rng.choice((-1.0, 1.0))
    point, normal = rng.uniform(-0.45, 0.45, 3), np.zeros(3)
    point[axis], normal[axis] = 0.5 * side, side
    place, out = TURNED @ (point * (0.2, 0.3, 0.1)), TURNED.rotation @ normal
    eye = place + 0.3 * (out + 0.4 * rng.uniform(-1.0, 1.0, 3))
    hit = cast_ray(CELL, eye, 7.0 * (place - eye))
    assert hit is not None
    assert np.allclose(hit.position, place, atol=1e-9)
    assert np.allclose(hit.normal, out, atol=1e-9)
    T = hit.facing_tool()
    assert np.allclose(T.rotation[:, 2], -out)
    assert np.allclose(T.position, place)


def test_round_solids_and_the_floor_are_hit_and_the_nearest_counts():
    ball = cast_ray(CELL, (-2.0, 0.0, 0.4), (1.0, 0.0, 0.0))
    assert np.allclose(ball.position, (-0.7, 0.0, 0.4), atol=2e-3)
    assert ball.normal[0] < -0.95
    post = cast_ray(CELL, (0.0, 0.9, 2.0), (0.0, 0.0, -1.0))
    assert np.allclose(post.position, (0.0, 0.9, 0.4))
    floor = cast_ray(CELL, (0.0, -1.0, 1.0), (0.0, 0.1, -1.0))
    assert np.allclose(floor.position, (0.0, -0.85, -0.5))
    assert floor.facing_tool().is_close(Pose(floor.position, (0.0, 0.0, 1.0, 0.0)))
    assert cast_ray(None, (0.0, 0.0, 1.0), (1.0, 0.0, -1.0)).position[0] == pytest.approx(1.0)


def test_the_sky_and_bad_rays_hit_nothing():
    assert cast_ray(CELL, (0.0, -1.0, 1.0), (0.0, -1.0, 1.0)) is None
    assert cast_ray(CELL, (0.0, -1.0, 1.0), (0.0, -1.0, -1e-3)) is None
    for ray in ((0.0, 0.0, 0.0), (np.nan, 0.0, 1.0), (1.0,)):
        with pytest.raises(InvalidValueError):
            cast_ray(CELL, (0.0, 0.0, 1.0), ray)
