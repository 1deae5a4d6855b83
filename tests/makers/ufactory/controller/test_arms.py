"""Every arm moves its joints and its tool, and answers invalid requests."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest

from rcilab.core.errors import DecodeError
from rcilab.makers.ufactory.robots import ROBOTS
from rcilab.makers.ufactory.wire.frame import FrameReader
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.poses import pose_from_mm_rpy
from tests.fuzz.noise import spoilt
from tests.makers.ufactory.controller.conftest import PROTOCOL, Q6, Arm


@pytest.mark.parametrize("name", ROBOTS)
def test_every_arm_moves_its_joints_and_its_tool(name: str) -> None:
    arm = Arm(name)
    arm.ready()
    q = arm.controller.model.home + 0.05
    if len(q) == 5:
        q = np.array((0.1, -0.5, -0.6, 1.1, 0.2))  # Its tool points down, as in every pose that five axes reach freely.
    assert arm.move_joints(q.tolist(), speed=2.0) == 0
    arm.run()
    np.testing.assert_allclose(arm.q, q, atol=1e-6)
    x, y, z, *rpy = arm.pose
    goal = (x - 20.0, y, z - 20.0, *rpy)
    assert arm.move_line(goal) == 0
    arm.run()
    assert arm.error == (0, 0), arm.controller.reason
    off = pose_from_mm_rpy(goal).inverse() @ pose_from_mm_rpy(arm.pose)
    np.testing.assert_allclose(off.matrix, np.eye(4), atol=1e-5)


def frames() -> list[bytes]:
    """Returns sound requests of many functions."""
    numbers = struct.pack("<16f3B", *Q6, *Q6, 1.0, 10.0, 0.0, 50.0, 0, 0, 0)
    found = []
    for function in Function:
        for size in (0, 1, 2, 4, 7, 28, 40, 43, 67):
            payload = numbers[:size]
            found.append(struct.pack(">HHHB", 1, PROTOCOL, 1 + size, function) + payload)
    modbus = [bytes((code, 0, 0, 0, 1, 2, 0, 1)) for code in (1, 2, 3, 4, 5, 6, 15, 16, 22, 23)]
    return found + [struct.pack(">HHHB", 2, 0, 1 + len(pdu), 1) + pdu for pdu in modbus]


def test_spoilt_requests_are_answered_or_end_their_connection(arm: Arm) -> None:
    chance = random.Random(7)
    for data in spoilt(frames(), 1500, 7):
        reader = FrameReader()
        try:
            requests = reader.feed(data)
        except DecodeError:
            continue
        for request in requests:
            arm.server.receive(arm.client, request)
        if chance.random() < 0.3:
            arm.step()
        if chance.random() < 0.05:
            arm.ready_again()
    arm.link.sent[arm.client].clear()
    arm.ready_again()
    assert arm.call(Function.GET_STATE)[1] in (b"\x01", b"\x02", b"\x04")
