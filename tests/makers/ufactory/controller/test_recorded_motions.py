"""The record of a virtual xArm: a motion for each one that the controller plans, and one for a stream with gaps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.cycle_ring import CycleRing
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.recording.client_motions import ClientMotions, MotionPart
from rcilab.sim.cycle_capture import CycleCapture
from tests.makers.ufactory.controller.conftest import Q6, Arm

PAUSE = 50  # [cycles] Between two motions, or targets of a stream.


def recorded(arm: Arm, mode: Mode, act: Callable[[int], None], times: int = 3) -> list[MotionPart]:
    """Acts several times, with a standstill after each motion, and returns what was recorded."""
    facts = {"model": "xArm6", "plant": "ideal", "url": "xarm://127.0.0.1", "realtime": False}
    ring = CycleRing.create(6, facts)
    arm.ready(mode)
    capture, motions = CycleCapture(ring, arm.controller), ClientMotions(ring)

    def step() -> None:
        arm.step()
        capture.write()

    for number in range(times):
        act(number)
        step()
        while arm.controller.is_moving:
            step()
        for _ in range(PAUSE):
            step()
    for _ in range(600):
        step()
    return motions.poll(is_last=True)


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.JOINT_VELOCITY])
def test_each_planned_motion_is_one_of_the_record(arm: Arm, mode: Mode) -> None:
    def act(number: int) -> None:
        if mode is Mode.POSITION:
            arm.move_joints((*Q6[:5], Q6[5] + 0.1 + 0.1 * number))
        else:
            arm.call(Function.JOINT_VELOCITY, "7fBf", *(0.0,) * 5, 0.3, 0.0, 1, 0.2)

    parts = recorded(arm, mode, act)
    assert [part.motion.number for part in parts] == [1, 2, 3]
    for part in parts:
        assert part.end is not None
        assert part.end.stopped is None
        assert part.end.received == pytest.approx(part.length, abs=1)
        assert np.abs(part.cycles["q_c"][-1] - part.cycles["q_c"][0]).max() > 0.05
        assert np.abs(part.cycles["dq_c"][[0, -1]]).max() < 1e-3
        assert np.abs(part.cycles["dq_c"][1:-1]).max(axis=1).all()  # No standstill inside.


def test_a_stream_with_gaps_is_one_motion(arm: Arm) -> None:
    def act(number: int) -> None:
        arm.call(Function.SERVO_JOINT, "10f", *Q6[:5], Q6[5] + 0.01 * number, 0.0, 0.0, 0.0, 0.0)

    (part,) = recorded(arm, Mode.SERVO, act)
    assert part.motion.number == 1
