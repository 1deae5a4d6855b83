"""The URDFs under urdf/: generated, committed, and read the same way by everybody."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.urdf import build_meshes, build_urdf

FOLDER = Path(__file__).parents[2] / "urdf"
AGREEMENT = 1e-9  # [m] and matrix elements; measured 1e-15
POSES = 1000
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("tag", "<u2")])

SAME_PLACE = 2e-5  # [m] Another processor may round a sine differently: files are rounded to 1e-5 m, either way.
SAME_SIZE = 2e-4  # The same of areas, as a part of them; a cell of the mesh may then be cut the other way round, too.

arms = pytest.mark.parametrize("name", ROBOT_NAMES)


@dataclass(frozen=True)
class Surface:
    """What stays of an STL file when its last bits and the order of its triangles do not matter."""

    title: bytes
    triangles: int
    box: np.ndarray
    """Lowest and highest corner, shape (2, 3), [m]."""
    area: float
    center: np.ndarray
    """Of the area, shape (3,), [m]."""
    spread: np.ndarray
    """Standard deviation of the area about its centre, shape (3,), [m]."""
    agreement: float
    """Mean cosine between the normals that are written and those of the corners."""


def surface(content: bytes) -> Surface:
    triangles = np.frombuffer(content[84:], dtype=RECORD)
    corners = triangles["corners"].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    areas = np.linalg.norm(across, axis=1)
    middles = corners.mean(axis=1)
    center = areas @ middles / areas.sum()
    return Surface(
        title=content[:80],
        triangles=len(triangles),
        box=np.array([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]),
        area=float(areas.sum()),
        center=center,
        spread=np.sqrt(areas @ (middles - center) ** 2 / areas.sum()),
        agreement=float((triangles["normal"] * across).sum() / areas.sum()),
    )


def scaled(content: bytes, factor: float) -> bytes:
    triangles = np.frombuffer(content[84:], dtype=RECORD).copy()
    triangles["corners"] *= factor
    return content[:84] + triangles.tobytes()


def random_poses(model: RobotModel, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (POSES, model.n))


@arms
def test_the_committed_urdf_is_what_the_data_give(name: str) -> None:
    committed = (FOLDER / f"{name}.urdf").read_text(encoding="utf-8")
    assert committed == build_urdf(load_model(name).description), f"run: rcilab urdf {name} --output urdf"


@arms
def test_the_committed_meshes_are_what_the_data_give(name: str) -> None:
    meshes = build_meshes(load_model(name).description)
    folder = FOLDER / "meshes" / name
    assert {path.name for path in folder.iterdir()} == set(meshes)
    for file, content in meshes.items():
        ours, theirs = surface(content), surface((folder / file).read_bytes())
        hint = f"{file}: run rcilab urdf {name} --output urdf"
        assert ours.title == theirs.title, hint
        assert ours.triangles == pytest.approx(theirs.triangles, rel=0.01), hint
        assert np.abs(ours.box - theirs.box).max() < SAME_PLACE, hint
        assert np.abs(ours.center - theirs.center).max() < SAME_PLACE, hint
        assert ours.area == pytest.approx(theirs.area, rel=SAME_SIZE), hint
        assert np.abs(ours.spread - theirs.spread).max() < SAME_PLACE, hint
        assert ours.agreement > 1.0 - SAME_SIZE, hint


def test_a_mesh_that_is_larger_by_two_in_a_thousand_is_another_one() -> None:
    for content in build_meshes(load_model("xMatePro7").description).values():
        before, after = surface(content), surface(scaled(content, 1.002))
        assert np.abs(after.box - before.box).max() > SAME_PLACE
        assert after.area != pytest.approx(before.area, rel=SAME_SIZE)


def test_everything_under_urdf_is_generated_and_small() -> None:
    files = [path for path in FOLDER.rglob("*") if path.is_file()]
    assert {path.suffix for path in files} == {".urdf", ".stl"}
    assert {path.stem for path in files if path.suffix == ".urdf"} == set(ROBOT_NAMES)
    assert sum(path.stat().st_size for path in files) < 5_000_000


@arms
def test_pinocchio_agrees_on_the_tool_pose_and_on_gravity(name: str) -> None:
    import pinocchio as pin

    model = load_model(name)
    reader = pin.buildModelFromUrdf(str(FOLDER / f"{name}.urdf"))
    reader.gravity.linear = np.array([0.0, 0.0, -9.81])
    data, tool = reader.createData(), reader.getFrameId("tool")
    T_base_tool = model.forward_path(random_poses(model, 1))
    for q, expected in zip(random_poses(model, 1), T_base_tool, strict=True):
        pin.framesForwardKinematics(reader, data, q)
        assert np.abs(data.oMf[tool].homogeneous - expected).max() < AGREEMENT
    for q in random_poses(model, 2)[:20]:
        gravity = pin.computeGeneralizedGravity(reader, data, q)
        assert gravity == pytest.approx(model.torque(q, 0 * q, 0 * q).gravity, abs=AGREEMENT)
    assert reader.lowerPositionLimit.tolist() == model.limits.joint.lower.tolist()
    assert reader.upperPositionLimit.tolist() == model.limits.joint.upper.tolist()
    assert reader.velocityLimit.tolist() == model.limits.joint.velocity.tolist()
    shapes = pin.buildGeomFromUrdf(
        reader, str(FOLDER / f"{name}.urdf"), pin.GeometryType.VISUAL, package_dirs=[str(FOLDER)]
    )
    assert shapes.ngeoms == len(build_meshes(model.description))


@arms
def test_mujoco_agrees_on_the_tool_pose(name: str) -> None:
    import mujoco

    model = load_model(name)
    reader = mujoco.MjModel.from_xml_path(str(FOLDER / f"{name}.urdf"))
    data, tool = mujoco.MjData(reader), reader.body("tool").id
    assert reader.nmesh == len(build_meshes(model.description))
    for q, expected in zip(random_poses(model, 3), model.forward_path(random_poses(model, 3)), strict=True):
        data.qpos[:] = q
        mujoco.mj_kinematics(reader, data)
        assert np.abs(data.xpos[tool] - expected[:3, 3]).max() < AGREEMENT
        assert np.abs(data.xmat[tool].reshape(3, 3) - expected[:3, :3]).max() < AGREEMENT


@arms
def test_yourdfpy_agrees_on_the_tool_pose_and_finds_every_mesh(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what yourdfpy's own dependencies declare old
        import yourdfpy

        reader = yourdfpy.URDF.load(str(FOLDER / f"{name}.urdf"))
    model = load_model(name)
    assert reader.validate()
    assert len(reader.scene.geometry) == len(build_meshes(model.description))
    for q, expected in zip(random_poses(model, 4), model.forward_path(random_poses(model, 4)), strict=True):
        reader.update_cfg(q)
        assert np.abs(reader.get_transform("tool") - expected).max() < AGREEMENT


def test_a_tool_stands_where_it_was_asked_for() -> None:
    import pinocchio as pin

    tool = Pose.from_rpy([0.02, -0.03, 0.15], [0.3, -0.4, 0.5])
    model = load_model("xMatePro7", tool=tool)
    reader = pin.buildModelFromXML(build_urdf(model.description, T_flange_tool=tool))
    data = reader.createData()
    pin.framesForwardKinematics(reader, data, model.home)
    pose = data.oMf[reader.getFrameId("tool")].homogeneous
    assert np.abs(pose - model.forward(model.home).matrix).max() < AGREEMENT


def test_mesh_names_take_the_prefix_a_ros_package_wants() -> None:
    root = ET.fromstring(build_urdf(load_model("xMate3").description, mesh_dir="package://lab/meshes/"))
    names = [mesh.attrib["filename"] for mesh in root.iter("mesh")]
    assert len(names) == len(build_meshes(load_model("xMate3").description))
    assert all(name.startswith("package://lab/meshes/") and name.count("//") == 1 for name in names)


def test_collision_capsules_are_a_cylinder_with_a_ball_at_each_end() -> None:
    root = ET.fromstring(build_urdf(load_model("xMatePro3").description))
    for link in root.findall("link"):
        kinds = [shape[0].tag for shape in link.findall("collision/geometry")]
        assert kinds == ["cylinder", "sphere", "sphere"] * (len(kinds) // 3)
