"""Queued joint targets of a planner."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.model.robot_model import load_model
from rcilab.sim.planner import EventKind, JointSpeed, JointTarget, Planner, PlannerState

MODEL = load_model("xMate3")


def test_a_joint_target_is_reached_inside_its_speed() -> None:
    goal = MODEL.home + 0.2
    planner = Planner(MODEL, MODEL.limits, MODEL.home.tolist())
    planner.add(JointTarget(id=7, q=tuple(goal.tolist()), speed=JointSpeed(velocity=0.3)))
    rows, events = [MODEL.home.tolist()], []
    while planner.state is PlannerState.MOVING:
        q, new = planner.step()
        rows.append(q)
        events += new
    assert [(event.id, event.kind) for event in events] == [(7, EventKind.BEGAN), (7, EventKind.REACHED)]
    np.testing.assert_allclose(rows[-1], goal, atol=1e-9)
    assert np.abs(np.diff(rows, axis=0)).max() / 1e-3 == pytest.approx(0.3, rel=1e-6)
