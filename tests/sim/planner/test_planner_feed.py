"""A planner that moves a virtual arm: the arm's own checks, stop and plants apply."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.model.robot_model import load_model
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.planner import EventKind, JointTarget, LineTarget, Planner, PlannerFeed, PlannerState, ToolSpeed
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm
from tests.sim.planner.driving import shifted

MODEL = load_model("xMate3")


@pytest.fixture(params=["ideal", "mujoco"])
def feed(request: pytest.FixtureRequest) -> PlannerFeed:
    arm = VirtualArm(MODEL, build_plant(request.param, MODEL), prefill=0)
    arm.resting_law = ControlLaw.POSITION
    planner = Planner(MODEL, MODEL.limits, arm.commanded.q)
    return PlannerFeed(arm, planner, MODEL.limits)


def test_the_arm_follows_the_targets_and_rests(feed: PlannerFeed) -> None:
    goal = shifted(MODEL.forward(MODEL.home), 0.0, 0.05, 0.0)
    feed.planner.add(JointTarget(id=1, q=tuple((MODEL.home + 0.05).tolist())))
    feed.planner.add(LineTarget(id=2, pose=goal, speed=ToolSpeed(velocity=0.2)))
    events = []
    for _ in range(2500):
        fed = feed.step()
        assert not fed.command_violations
        assert not fed.measured_violations
        events += fed.events
    assert [event.id for event in events if event.kind is EventKind.REACHED] == [1, 2]
    assert MODEL.forward(feed.arm.commanded.q).is_close(goal, 1e-8)
    np.testing.assert_allclose(feed.arm.signals.measured.q, feed.arm.commanded.q, atol=1e-3)
    assert not feed.is_feeding, "nothing moves any more"


def test_a_violation_stops_the_arm_and_discards_the_targets(feed: PlannerFeed) -> None:
    joint = MODEL.limits.joint
    feed.limits = replace(MODEL.limits, joint=replace(joint, velocity=np.full(MODEL.n, 0.2)))
    for number in (1, 2):
        feed.planner.add(JointTarget(id=number, q=tuple((MODEL.home + 0.3 * number).tolist())))
    fed = feed.step()
    events = [*fed.events]
    for _ in range(1000):
        fed = feed.step()
        events += fed.events
        if fed.command_violations:
            break
    (violation, *_) = fed.command_violations
    assert isinstance(violation, LimitViolation)
    assert (violation.axis, violation.condition.order, violation.bound) == (1, 1, 0.2)
    assert [event.kind for event in events] == [EventKind.BEGAN, EventKind.DISCARDED, EventKind.DISCARDED]
    for _ in range(1000):
        assert not feed.step().command_violations
    assert feed.arm.is_standstill
    assert feed.planner.state is PlannerState.IDLE


def test_the_next_target_begins_where_the_arm_has_stopped(feed: PlannerFeed) -> None:
    feed.planner.add(JointTarget(id=1, q=tuple((MODEL.home + 0.3).tolist())))
    for _ in range(150):
        feed.step()
    feed.abort()
    feed.planner.add(JointTarget(id=2, q=tuple(MODEL.home.tolist())))
    events = []
    for _ in range(3000):
        if feed.arm.resting_law is not ControlLaw.POSITION:
            feed.arm.resting_law = ControlLaw.POSITION
        fed = feed.step()
        assert not fed.command_violations
        events += fed.events
    assert [event[:2] for event in events] == [
        (1, EventKind.DISCARDED),
        (2, EventKind.BEGAN),
        (2, EventKind.REACHED),
    ]
    np.testing.assert_allclose(feed.arm.commanded.q, MODEL.home, atol=1e-9)
