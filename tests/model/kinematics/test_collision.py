"""Distances between capsules: the same as pinocchio finds in the generated URDF, and never faster than the levers."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.clearance import FLOOR, TOOL, ClearanceLimit
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.kinematics.collision import ClearanceQuery
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.shapes import build_shapes
from rcilab.robots.upright import upright_joints
from rcilab.robots.urdf import build_urdf

arms = pytest.mark.parametrize("name", ROBOT_NAMES)
FINGER = Pose((0.03, -0.02, 0.15))
WITH_TOOL = ClearanceLimit(tool_radius=0.03)
AGREEMENT = 1e-9  # [m] Both are closed forms; only the order of the sums differs.


def random_q(model: RobotModel, count: int, seed: int = 0):
    limits = model.limits.joint
    return np.random.default_rng(seed).uniform(limits.lower, limits.upper, (count, model.n))


def urdf_capsules(model: RobotModel):
    """The URDF as pinocchio reads it, each cylinder with its two balls put back into the capsule it stands for."""
    text = build_urdf(model.description)
    tree = pin.buildModelFromXML(text)
    read = pin.buildGeomFromUrdfString(tree, text, pin.GeometryType.COLLISION)
    solids = pin.GeometryModel()
    for solid in read.geometryObjects:
        if isinstance(solid.geometry, coal.Cylinder):
            capsule = coal.Capsule(solid.geometry.radius, 2.0 * solid.geometry.halfLength)
            solids.addGeometryObject(pin.GeometryObject(solid.name, solid.parentJoint, solid.placement, capsule))
    plane = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
    floor = solids.addGeometryObject(pin.GeometryObject("floor", 0, pin.SE3.Identity(), plane))
    links = [solid.parentJoint for solid in solids.geometryObjects]
    for a in range(floor):
        for b in range(a + 1, floor):
            if abs(links[a] - links[b]) > 1:
                solids.addCollisionPair(pin.CollisionPair(a, b))
        if links[a] > 1:  # The base stands on the floor, and link 1 only turns above it.
            solids.addCollisionPair(pin.CollisionPair(a, floor))
    return tree, solids, floor


@arms
def test_pinocchio_finds_the_same_distances_in_the_urdf(name: str) -> None:
    model = load_model(name)
    tree, solids, floor = urdf_capsules(model)
    data, found = tree.createData(), solids.createData()
    geometry = model.collision_geometry()
    query = ClearanceQuery(geometry)
    assert len(solids.collisionPairs) == len(geometry.link_pairs) + len(geometry.floor_pairs)
    closest = []
    for q in random_q(model, 300):
        pin.computeDistances(tree, data, solids, found, q)
        results = [result.min_distance for result in found.distanceResults]
        is_floor = [pair.second == floor for pair in solids.collisionPairs]
        links = min(d for d, down in zip(results, is_floor, strict=True) if not down)
        down = min(d for d, down in zip(results, is_floor, strict=True) if down)
        assert query.links(q)[0] == pytest.approx(links, abs=AGREEMENT)
        assert query.floor(q)[0] == pytest.approx(down, abs=AGREEMENT)
        closest.append(min(links, down))
    assert model.clearance(random_q(model, 300)).distance == pytest.approx(closest, abs=AGREEMENT)
    assert min(closest) < -0.1 < 0.005 < max(closest)


@arms
def test_the_pair_it_names_is_that_near(name: str) -> None:
    model = load_model(name)
    shape = build_shapes(model.description, "coarse")
    bodies = [shape.base, *shape.links]
    table = random_q(model, 40, seed=1)
    found = model.clearance(table)
    for q, distance, (first, second) in zip(table, found.distance, found.links.tolist(), strict=True):
        points = {i: sampled(bodies[i], placed(model, q, i)) for i in (first, second) if i >= 0}
        if second == FLOOR:
            near = points[first][0][:, 2] - points[first][1]
        else:
            (a, ra), (b, rb) = points[first], points[second]
            near = np.linalg.norm(a[:, None] - b[None], axis=2) - ra[:, None] - rb[None]
        assert near.min() == pytest.approx(distance, abs=2e-3)  # Points every few millimetres along the axes.


def placed(model: RobotModel, q, link: int) -> Pose:
    """Where a link's upright frame is."""
    T = Pose()
    for joint, angle in zip(upright_joints(model.description)[:link], q, strict=False):
        T = T @ Pose(joint.origin, [np.cos(angle / 2.0), *(np.sin(angle / 2.0) * joint.axis)])
    return T


def sampled(shape, T: Pose):
    """Points on the axes of a link's capsules in base, with the capsules' radii."""
    share = np.linspace(0.0, 1.0, 60)[:, None]
    lines = [c.start + share * (c.end - c.start) for c in shape.capsules]
    radii = [np.full(len(share), c.radius) for c in shape.capsules]
    return np.concatenate(lines) @ T.rotation.T + T.position, np.concatenate(radii)


@arms
def test_no_pair_that_is_compared_always_touches(name: str) -> None:
    model = load_model(name)
    seen = {tuple(pair): 0.0 for pair in model.collision_geometry().link_pairs}
    assert {pair for pair in seen if pair[1] - pair[0] < 2} == set()
    geometry = model.collision_geometry()
    data, found = geometry.tree.createData(), geometry.links.createData()
    for q in (np.zeros(model.n), model.home):
        pin.computeDistances(geometry.tree, data, geometry.links, found, q)
        assert min(result.min_distance for result in found.distanceResults) > 0.005


@settings(max_examples=60)
@given(st.sampled_from(ROBOT_NAMES), st.booleans(), st.integers(0, 2**32))
def test_no_point_moves_farther_than_the_joints_turn_times_their_levers(name, tooled, seed):
    model = load_model(name, tool=FINGER if tooled else None)
    geometry = model.collision_geometry(WITH_TOOL)
    rng = np.random.default_rng(seed)
    limits = model.limits.joint
    start = rng.uniform(limits.lower, limits.upper)
    step = rng.normal(size=model.n) * rng.choice([0.0, 1e-4, 1e-1], size=model.n)
    bound = float(np.abs(step) @ geometry.levers)
    for number, capsules in enumerate(geometry.bodies):
        before, after = (placed(model, q, min(number, model.n)) for q in (start, start + step))
        for capsule in capsules:
            for end in (capsule.start, capsule.end):
                for rim in (0.0, *rng.normal(size=(4, 3))):
                    point = end + capsule.radius * np.asarray(rim) / (np.linalg.norm(rim) or 1.0)
                    moved = after.rotation @ point + after.position - before.rotation @ point - before.position
                    assert np.linalg.norm(moved) <= bound + 1e-12
    query = ClearanceQuery(geometry)
    for ask in (query.links, query.floor):
        assert abs(ask(start + step)[0] - ask(start)[0]) <= bound + 1e-9


@pytest.mark.parametrize("name", ROBOTS)
def test_each_lever_is_reached_by_no_less_than_a_tenth_of_it_short(name: str) -> None:
    model = load_model(name)
    geometry = model.collision_geometry()
    stretched = np.zeros(model.n)
    last = geometry.bodies[-1][0]
    reach = model.description.links[-1].origin_height + float(last.end[2]) + last.radius
    height = model.description.links[1].origin_height
    assert 0.9 * geometry.levers[1] < reach - height <= geometry.levers[1] + 1e-9
    assert model.clearance(stretched).distance > 0.0


def test_a_tool_with_a_body_is_one_more_link_and_one_without_is_none() -> None:
    bare = load_model("xMatePro7")
    long = bare.with_tool(Pose((0.0, 0.0, 0.5)))
    q = np.array([0.0, 1.0, 0.0, 0.6, 0.0, 1.2, 0.0])
    assert long.clearance(q).distance == bare.clearance(q).distance
    assert bare.clearance(q, WITH_TOOL).distance == bare.clearance(q).distance
    found = long.clearance(q, WITH_TOOL)
    tip = long.forward(q).position[2] - 0.03
    assert (found.distance, found.links.tolist()) == (pytest.approx(tip, abs=1e-12), [TOOL, FLOOR])
    assert "between tool and floor" in repr(found)


def test_the_floor_can_be_lower_or_away() -> None:
    model = load_model("xMate3")
    q = np.array([0.0, 1.9, 0.5, 0.0, 0.0, 0.0])
    floor = model.clearance(q)
    assert floor.links[1] == FLOOR
    assert model.clearance(q, ClearanceLimit(floor_height=-0.1)).distance == pytest.approx(floor.distance + 0.1)
    away = model.clearance(q, ClearanceLimit(floor_height=None))
    assert away.links[1] != FLOOR
    assert away.distance > floor.distance


def test_a_table_gives_what_its_rows_give() -> None:
    model = load_model("xMate7")
    table = random_q(model, 20)
    found = model.clearance(table)
    assert found.distance.shape == (20,)
    assert found.links.shape == (20, 2)
    for row, q in enumerate(table):
        single = model.clearance(q)
        assert single.distance.shape == ()
        assert (single.distance, single.links.tolist()) == (found.distance[row], found.links[row].tolist())
    assert "of 20 rows: smallest" in repr(found)


def test_what_is_no_configuration_is_refused() -> None:
    with pytest.raises(InvalidValueError, match="q"):
        load_model("xMate7").clearance(np.zeros(7))
    with pytest.raises(InvalidValueError, match="q"):
        load_model("xMate7").clearance([np.nan] * 6)
