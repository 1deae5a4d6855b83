"""Plans that are sent as joint targets stay below C60, also when the targets come irregularly."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.makers.ufactory.controller.modes import Mode
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.motion import plan_joint
from rcilab.sim.arm_setup import ArmSetup
from tests.makers.ufactory.controller.conftest import Arm

FAR = np.array([0.2, 0.6, -1.8, 0.0, 1.2, 0.0])
PERIOD = 5  # [cycles] Of the reports, each of which a client answers with a target.
NOTHING = (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("latest", [0, 1, 2])
def test_the_fastest_plan_is_followed_with_targets_that_are_late_by_up_to_2_ms(arm: Arm, latest: int) -> None:
    model = arm.controller.model
    motion = plan_joint(model, FAR, FAR + [2.0, 0.0, 0.0, 0.0, 0.0, 0.0], speed=1.0)
    assert check(motion, model, distance=None).ok
    arm.controller.set_up(ArmSetup(q=tuple(FAR)))
    arm.ready(Mode.SERVO)
    rng = np.random.default_rng(latest)
    rows = {row + int(rng.integers(latest + 1)): row for row in range(0, len(motion.q) + PERIOD, PERIOD)}
    fastest = 0.0
    for cycle in range(max(rows) + 1):
        if cycle in rows:
            q = motion.q[min(rows[cycle], len(motion.q) - 1)]
            assert arm.call(Function.SERVO_JOINT, "10f", *q, *NOTHING)[0] == 0
        arm.step()
        fastest = max(fastest, float(np.linalg.norm(arm.controller.arm.tool_c.twist[:3])))
    arm.run()
    assert arm.controller.error is None
    assert fastest > 0.84 * model.limits.joint_tool_velocity
    np.testing.assert_allclose(arm.q, motion.q[-1], atol=1e-6)


@pytest.mark.parametrize("stall", [7, 20, 60])
@pytest.mark.parametrize("lost", ["none", "old", "all but two"])
def test_a_client_that_stalls_is_not_an_error(arm: Arm, stall: int, lost: str) -> None:
    """Its targets move the tool with 0.96 of the bound; after a stall they come later, or the old ones are lost."""
    model = arm.controller.model
    bound = model.limits.joint_tool_velocity
    rate = 0.96e-3 * bound / float(np.hypot(*model.forward(FAR).position[:2]))  # [rad] In a cycle.
    arm.controller.set_up(ArmSetup(q=tuple(FAR)))
    arm.ready(Mode.SERVO)
    late, sent, fastest = 0, 0, 0.0
    for cycle in range(600):
        is_stalled = 300 <= cycle < 300 + stall
        if cycle == 300 + stall and lost == "none":
            late = stall
        if cycle % 4 == 0 and not is_stalled:
            rows = range(sent + 4, cycle - late + 1, 4) if lost == "all but two" else (cycle - late,)
            for row in rows:
                angle = FAR[0] + rate * (row - min(row, 200) * (1.0 - min(row, 200) / 400))
                arm.call(Function.SERVO_JOINT, "10f", angle, *FAR[1:], *NOTHING)
            sent = cycle - late
        arm.step()
        assert arm.controller.error is None
        fastest = max(fastest, float(np.linalg.norm(arm.controller.arm.tool_c.twist[:3])))
    assert fastest < 1.001 * bound


@pytest.mark.parametrize("before", [0, 100])
def test_targets_that_jump_and_stay_are_an_error(arm: Arm, before: int) -> None:
    """They come after a pause, or after others at the arm."""
    arm.controller.set_up(ArmSetup(q=tuple(FAR)))
    arm.ready(Mode.SERVO)
    for cycle in range(before, 600):
        if cycle % PERIOD == 0 and arm.controller.error is None:
            angle = FAR[0] + (1.5 if cycle >= 100 else 0.0)
            arm.call(Function.SERVO_JOINT, "10f", angle, *FAR[1:], *NOTHING)
        arm.step()
    assert arm.controller.error == 60


@pytest.mark.parametrize("speed", [3.0, 4.0])
def test_a_joint_is_not_faster_than_180_degrees_per_second_whatever_is_sent(arm: Arm, speed: float) -> None:
    """Joint 6 moves the tool little; its client stalls once."""
    arm.controller.set_up(ArmSetup(q=tuple(FAR)))
    arm.ready(Mode.SERVO)
    fastest = 0.0
    for cycle in range(500):
        if cycle % 4 == 0 and not 300 <= cycle < 340:
            angle = FAR[5] + 1e-3 * speed * (cycle - min(cycle, 250) * (1.0 - min(cycle, 250) / 500))
            arm.call(Function.SERVO_JOINT, "10f", *FAR[:5], angle, *NOTHING)
        arm.step()
        assert arm.controller.error is None
        fastest = max(fastest, abs(arm.controller.arm.commanded.dq[5]))
    assert fastest == pytest.approx(np.pi, rel=1e-3)


@pytest.mark.parametrize("seed", [6, 12, 19])
def test_targets_that_come_late_hardly_turn_a_joint_back(seed: int) -> None:
    arm = Arm()
    goal = arm.controller.model.home
    start = goal + [0.0, 0.297, 1.13, 0.0, -0.057, -0.02]
    rows = plan_joint(arm.controller.model, start, goal, speed=0.2).q
    arm.controller.set_up(ArmSetup(q=tuple(goal)))
    arm.call(Function.SET_SELF_COLLISION, "B", 0)
    arm.ready()
    arm.move_joints(start)
    arm.run()
    arm.ready(Mode.SERVO)
    rng, due, farthest = np.random.default_rng(seed), 0, start[2]
    for cycle in range(250):
        if cycle >= due:
            arm.call(Function.SERVO_JOINT, "10f", *rows[cycle], *NOTHING)
            due = cycle + int(rng.choice((5, 6, 7, 10, 15, 20, 25)))
        arm.step()
        farthest = min(farthest, arm.q[2])
        assert arm.q[2] - farthest < 5e-4  # [rad]
    assert arm.controller.error is None
