"""The inverse kinematics of requests: every reachable pose is answered, inside the ranges."""

from __future__ import annotations

import struct
import time
from math import pi

import numpy as np
import pytest

from rcilab.makers.ufactory.controller.pose_search import find_nearest_angles
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.poses import pose_as_mm_rpy, pose_from_mm_rpy
from tests.makers.ufactory.controller.conftest import Arm

MODELS = ["xArm5", "xArm6", "xArm7", "Lite6", "850"]


def floats(payload: bytes) -> tuple[float, ...]:
    return struct.unpack(f"<{len(payload) // 4}f", payload)


@pytest.mark.parametrize("model", MODELS)
def test_every_reachable_pose_has_joint_angles_from_the_zero_pose(model: str) -> None:
    arm = Arm(model)
    loaded, random = arm.controller.model, np.random.default_rng(5)
    n, joint = loaded.n, loaded.limits.joint
    for _ in range(12):
        q = random.uniform(np.maximum(joint.lower, -3.0), np.minimum(joint.upper, 3.0))
        pose = floats(struct.pack("<6f", *pose_as_mm_rpy(loaded.forward(q))))
        status, payload = arm.call(Function.GET_IK, "6f", *pose)
        assert status & 0x08 == 0, arm.link.logged[-1]
        found = np.array(floats(payload)[:n])
        reached = loaded.forward(found)
        np.testing.assert_allclose(reached.position * 1e3, pose[:3], atol=2e-3)
        np.testing.assert_allclose(reached.rotation, pose_from_mm_rpy(pose).rotation, atol=2e-5)
        assert np.all((found >= joint.lower - 1e-6) & (found <= joint.upper + 1e-6))
        assert arm.call(Function.IS_TCP_LIMIT, "6f", *pose)[1] == b"\0"
    assert arm.error == (0, 0)


@pytest.mark.parametrize("model", MODELS)
def test_a_pose_has_the_reference_angles_even_where_it_is_singular(model: str) -> None:
    arm = Arm(model)
    zeros = (0.0,) * 7
    pose = floats(arm.call(Function.GET_FK, "7f", *zeros)[1])
    status, payload = arm.call(Function.GET_IK, "6fB7f", *pose, 1, *zeros)
    assert status & 0x08 == 0
    np.testing.assert_allclose(floats(payload), 0.0, atol=1e-6)


def test_angles_are_kept_within_half_a_turn_unless_the_client_wants_more() -> None:
    arm = Arm("xArm6")
    q = (3.5, -0.5, -0.8, 0.1, 1.1, 0.3)
    pose = floats(arm.call(Function.GET_FK, "7f", *q, 0.0)[1])
    limited = floats(arm.call(Function.GET_IK, "6fB7f", *pose, 1, *q, 0.0)[1])
    free = floats(arm.call(Function.GET_IK, "6fB7f", *pose, 0, *q, 0.0)[1])
    np.testing.assert_allclose(free[:6], q, atol=1e-4)
    np.testing.assert_allclose(limited[:6], (q[0] - 2.0 * pi, *q[1:]), atol=1e-4)


def test_a_redundant_joint_is_turned_where_the_others_would_leave_their_ranges() -> None:
    model = Arm("xArm7").controller.model
    joint, random = model.limits.joint, np.random.default_rng(8)
    slowest, turned = 0.0, 0
    for _ in range(40):
        q = random.uniform(np.maximum(joint.lower, -3.0), np.minimum(joint.upper, 3.0))
        start = time.process_time()
        found = find_nearest_angles(model, joint, model.forward(q), (0.0,) * 7)
        slowest = max(slowest, time.process_time() - start)
        np.testing.assert_allclose(model.forward(found).position, model.forward(q).position, atol=1e-6)
        turned += abs(found[2]) > 0.01
    assert 0 < turned < 40
    assert slowest < 0.2  # [s] Some 5 ms on a machine without other work.


def test_a_pose_out_of_reach_is_refused_with_a_full_answer() -> None:
    arm = Arm("xArm6")
    status, payload = arm.call(Function.GET_IK, "6f", 2000.0, 0.0, 0.0, pi, 0.0, 0.0)
    assert (status & 0x08, payload) == (0x08, bytes(28))
    assert "GET_IK was refused: W14, " in arm.link.logged[-1]
