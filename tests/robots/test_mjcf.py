"""The MJCF: self-contained, the same arm as everywhere else."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.files import write_model
from rcilab.robots.mjcf import build_mjcf

arms = pytest.mark.parametrize("name", ROBOT_NAMES)


@arms
def test_flange_and_tool_are_where_our_kinematics_put_them(name: str) -> None:
    tool = Pose.from_rpy([0.0, 0.05, 0.1], [0.2, 0.1, -0.7])
    bare, model = load_model(name), load_model(name, tool=tool)
    arm = mujoco.MjModel.from_xml_string(build_mjcf(model.description, T_flange_tool=tool))
    data = mujoco.MjData(arm)
    rng = np.random.default_rng(5)
    for q in rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (1000, model.n)):
        data.qpos[:] = q
        mujoco.mj_kinematics(arm, data)
        for site, T in (("flange", bare.forward(q)), ("tool", model.forward(q))):
            assert np.abs(data.site(site).xpos - T.position).max() < 1e-9
            assert np.abs(data.site(site).xmat.reshape(3, 3) - T.rotation).max() < 1e-9


@arms
def test_gravity_and_inertia_are_those_of_the_model_with_and_without_a_load(name: str) -> None:
    load = Payload(
        mass=min(2.5, load_model(name).description.rated_payload),
        center_of_mass=np.array([0.01, -0.02, 0.08]),
        inertia=np.diag([0.01, 0.02, 0.015]),
    )
    for model in (load_model(name), load_model(name, load=load)):
        arm = mujoco.MjModel.from_xml_string(build_mjcf(model.description, load=model.load))
        arm.opt.gravity[2] = -9.81
        arm.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # random poses may touch themselves
        data = mujoco.MjData(arm)
        rng = np.random.default_rng(6)
        for q in rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (20, model.n)):
            dq, ddq = rng.uniform(-1.0, 1.0, (2, model.n))
            data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
            mujoco.mj_inverse(arm, data)
            expected = model.torque(q, dq, ddq).full + arm.dof_armature * ddq + arm.dof_damping * dq
            assert data.qfrc_inverse == pytest.approx(
                expected, abs=2e-6
            )  # a capsule's mass is 0, a load's tensor exact


FLAT = {
    "a line": (0.0023, 0.0023, 0.0),
    "next to a line": (1e-300, 0.01, 0.01),
    "less than a line": (-1e-10, 0.01, 0.01),
    "a plate": (0.0766, 0.0446, 0.1212),
    "more than a plate": (0.01, 0.01, 0.0200000005),
    "the largest plate": (50.0, 50.0, 100.0),
    "a point": (0.0, 0.0, 0.0),
}
"""Principal moments of loads that a controller accepts, [kg m^2]."""


@pytest.mark.parametrize("moments", FLAT.values(), ids=FLAT)
@pytest.mark.parametrize("turned", [False, True])
def test_a_load_without_thickness_is_simulated(moments: tuple[float, ...], turned: bool) -> None:
    R = Pose.from_rpy([0.0, 0.0, 0.0], [0.3, 0.4, 0.5]).rotation if turned else np.eye(3)
    inertia = R @ np.diag(moments) @ R.T
    load = Payload(mass=0.3, center_of_mass=np.array([0.0, 0.0, 0.05]), inertia=(inertia + inertia.T) / 2.0)
    arm = mujoco.MjModel.from_xml_string(build_mjcf(load_model("xMatePro7").description, load=load))
    assert np.sort(arm.body("load").inertia) == pytest.approx(np.sort(moments), rel=1e-8, abs=5e-9)


@arms
def test_ranges_and_motors_carry_the_limits_of_the_manual(name: str) -> None:
    joint = load_model(name).limits.joint
    arm = mujoco.MjModel.from_xml_string(build_mjcf(load_model(name).description))
    assert arm.jnt_range.tolist() == np.stack([joint.lower, joint.upper], axis=1).tolist()
    assert arm.actuator_ctrlrange.tolist() == np.stack([-joint.torque, joint.torque], axis=1).tolist()
    assert arm.opt.timestep == 0.001


def test_a_resting_arm_does_not_collide_with_itself() -> None:
    for name in ROBOT_NAMES:
        model = load_model(name)
        arm = mujoco.MjModel.from_xml_string(build_mjcf(model.description))
        data = mujoco.MjData(arm)
        for q in (0.0 * model.home, model.home):
            data.qpos[:] = q
            mujoco.mj_forward(arm, data)
            assert data.ncon == 0


def test_written_files_load_with_their_meshes(tmp_path: Path) -> None:
    description = load_model("xMate7").description
    path = write_model(tmp_path, "arm.xml", build_mjcf(description, meshes=True), description)
    arm = mujoco.MjModel.from_xml_path(str(path))
    assert arm.nmesh == len(list((tmp_path / "meshes" / "xMate7").glob("*.stl")))
