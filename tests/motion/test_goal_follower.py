"""On-line motion to goals that change: inside the limits, whatever the goals are."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.model.robot_model import load_model
from rcilab.motion.goal_follower import GoalFollower


@pytest.mark.parametrize("name", ["xMatePro7", "FR3"])
def test_changing_goals_stay_inside_the_limits(name: str) -> None:
    model, rng = load_model(name), np.random.default_rng(3)
    limits, n = model.limits.joint, model.n
    follower = GoalFollower(limits, model.home.tolist(), [10.0] * n)  # Only the limits bound it.
    monitor = JointMonitor(limits)
    monitor.reset(model.home.tolist())
    for _ in range(30):
        follower.set_goal(rng.uniform(0.7 * limits.lower, 0.7 * limits.upper).tolist())
        for _ in range(int(rng.integers(20, 400))):
            assert monitor.step(follower.step()) == []
    follower.stop()
    while not follower.is_stationary:
        assert monitor.step(follower.step()) == []


def test_near_the_end_of_a_range_a_joint_moves_as_slowly_as_there_is_allowed() -> None:
    model = load_model("FR3")
    limits, goal = model.limits.joint, model.home.copy()
    goal[1] = limits.upper[1] - 0.02
    follower, monitor, fastest = GoalFollower(limits, model.home.tolist(), [10.0] * 7), JointMonitor(limits), 0.0
    monitor.reset(model.home.tolist())
    follower.set_goal(goal.tolist())
    for _ in range(100_000):
        q = follower.step()
        assert monitor.step(q) == []
        fastest = max(fastest, monitor.dq[1])
        if follower.is_stationary:
            break
    assert q == pytest.approx(goal, abs=1e-9)
    assert fastest == pytest.approx(limits.velocity_bounds(goal)[1][1], rel=0.02)
