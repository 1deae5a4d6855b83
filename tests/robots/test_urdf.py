"""The URDFs under urdf/: generated, committed, and read the same way by everybody."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from rcilab.model import RobotModel, load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.urdf import build_meshes, build_urdf
from rcilab.spatial import Pose

FOLDER = Path(__file__).parents[2] / "urdf"
AGREEMENT = 1e-9  # [m] and matrix elements; measured 1e-15
POSES = 1000

arms = pytest.mark.parametrize("name", ROBOT_NAMES)


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
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("tag", "<u2")])
    for file, content in meshes.items():
        committed = (folder / file).read_bytes()
        if committed == content:
            continue
        # Another processor may round the last bit of a sine differently: the same triangles within 20 micrometres.
        ours, theirs = (np.frombuffer(data[84:], dtype=record)["corners"] for data in (content, committed))
        assert ours.shape == theirs.shape, f"{file}: run rcilab urdf {name} --output urdf"
        assert np.abs(ours - theirs).max() < 2e-5, f"{file}: run rcilab urdf {name} --output urdf"


def test_everything_under_urdf_is_generated_and_small() -> None:
    files = [path for path in FOLDER.rglob("*") if path.is_file()]
    assert {path.suffix for path in files} == {".urdf", ".stl"}
    assert {path.stem for path in files if path.suffix == ".urdf"} == set(ROBOT_NAMES)
    assert sum(path.stat().st_size for path in files) < 3_000_000


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
