"""What a controller answers about itself: its geometry, and its last errors with joint and value."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from rcilab.makers.ufactory.bounds import SERVO_PERIOD
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from tests.makers.ufactory.controller.conftest import Q6, Arm


def information(arm: Arm, number: int, code: str) -> tuple[float, ...]:
    status, payload = arm.call(Function.GET_COMMON_INFORMATION, "B", number)
    assert status & 0x08 == 0
    return struct.unpack(f"<{code}", payload)


@pytest.mark.parametrize("model", ["xArm5", "xArm6", "xArm7"])
def test_the_geometry_is_that_of_the_arm(model: str) -> None:
    arm = Arm(model)
    numbers = struct.unpack("<28f", arm.call(Function.GET_DH)[1])
    n, T = arm.controller.model.n, np.eye(4)
    q = arm.controller.model.home
    for k in range(n):
        offset, d, alpha, a = numbers[4 * k : 4 * k + 4]
        (c, s), (ca, sa) = ((np.cos(x), np.sin(x)) for x in (q[k] + offset, alpha))
        T = T @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    np.testing.assert_allclose(1e-3 * T[:3, 3], arm.controller.model.forward(q).position, atol=1e-6)
    np.testing.assert_allclose(T[:3, :3], arm.controller.model.forward(q).rotation, atol=1e-6)
    assert numbers[4 * n :] == (0.0,) * (28 - 4 * n)


def test_the_last_errors_have_joint_and_value(arm: Arm) -> None:
    assert information(arm, 103, "B7f") == (0,) * 8
    arm.move_joints((Q6[0], 2.5, *Q6[2:]))
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.error[0] == 23
    bits, *angles = information(arm, 103, "B7f")
    assert (bits, angles) == (2, pytest.approx([0.0, 2.5, *[0.0] * 5]))
    arm.ready(Mode.SERVO)
    arm.call(232, "<Bf", 1, 0.05)
    arm.call(Function.SERVO_JOINT, "10f", Q6[0] + 0.1, *Q6[1:], 0.0, 0.0, 0.0, 0.0)
    arm.run(until=lambda: arm.controller.error is not None)
    assert arm.error[0] == 60
    bound, speed = information(arm, 105, "2f")
    assert bound == pytest.approx(50.0)
    assert 50.0 < speed < 100.0
    assert information(arm, 104, "Bf") == (0, 0.0)


def test_a_pose_a_step_away_has_the_joint_that_would_be_too_fast(arm: Arm) -> None:
    arm.ready(Mode.SERVO)
    x, y, *others = arm.pose
    pose = (x, y + 12.0, *others)
    goal = struct.unpack("<7f", arm.call(Function.GET_IK, "6f", *pose)[1])[:6]
    dq = np.subtract(goal, arm.q) / SERVO_PERIOD
    arm.call(Function.SERVO_CARTESIAN, "9f", *pose, 0.0, 0.0, 0.0)
    assert arm.error[0] == 24
    joint, speed = information(arm, 104, "Bf")
    assert joint == np.abs(dq).argmax() + 1
    assert speed == pytest.approx(dq[joint - 1], rel=1e-3)
    assert abs(speed) > np.pi
