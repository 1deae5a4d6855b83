"""While somebody drags, collisions are not looked for; once the goal rests they are, and in any case before it runs."""

from __future__ import annotations

import time
from types import SimpleNamespace

import numpy as np
import pytest

from rcilab.app.goal import goal_actions
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, MoveTarget
from rcilab.app.planning import Plan, make_plan
from rcilab.app.store import Store, UiState
from rcilab.core.errors import CertificateError
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)
ON_THE_FLOOR = np.array([0.0, 2.0, 0.0, 0.3, 0.0, 0.2, 0.0])


def planned(goal: np.ndarray) -> Plan:
    plan = make_plan(MODEL, HOME, goal, 0.5, "jerk_limited")
    assert isinstance(plan, Plan)
    return plan


def test_a_plan_is_judged_but_for_collisions_until_it_is_completed():
    quick = planned(ON_THE_FLOOR)
    assert quick.report.ok
    assert not quick.complete
    whole = quick.completed()
    assert whole.complete
    assert [violation.condition.id for violation in whole.report.violations] == ["clearance.floor"]
    assert whole.report.certificate is None
    assert whole.motion is quick.motion
    assert whole.completed() is whole


def test_only_a_completed_plan_has_a_certificate_to_run_with():
    quick = planned(HOME + 0.2)
    with pytest.raises(CertificateError, match="collisions were not checked"):
        quick.report.certificate.verify(quick.motion, MODEL, HOME)
    quick.completed().report.certificate.verify(quick.motion, MODEL, HOME)


def test_a_goal_that_rests_is_looked_at_for_collisions_and_one_that_is_dragged_is_not(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(goal_actions, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=time.sleep))
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, ON_THE_FLOOR)))
    actions = GoalActions(store, SimpleNamespace(status=lambda: SimpleNamespace(phase="idle", q_c=HOME)))
    actions.plan()
    dragged = store.state.plan
    now[0] += 0.9 * goal_actions.SETTLED
    actions.settle()
    assert store.state.plan is dragged
    assert dragged.report.ok
    now[0] += 0.2 * goal_actions.SETTLED
    actions.settle()
    assert not store.state.plan.report.ok
    settled = store.state.plan
    actions.settle()
    assert store.state.plan is settled


def test_a_target_in_a_hand_has_come_to_rest_when_it_is_let_go_or_after_a_longer_pause(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(goal_actions, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=time.sleep))
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, HOME)))
    actions = GoalActions(store, SimpleNamespace(status=lambda: SimpleNamespace(phase="idle", q_c=HOME)))
    position, wxyz = tuple(store.state.goal.target.position - (0.0, 0.05, 0.05)), tuple(store.state.goal.target.wxyz)

    def is_looked_at(ended: bool, after: float) -> bool:
        actions.move_target(MoveTarget(position=position, wxyz=wxyz, ended=ended))
        now[0] += after
        actions.settle()
        return store.state.plan.complete

    assert not is_looked_at(ended=False, after=0.9 * goal_actions.RESTED)
    assert is_looked_at(ended=False, after=1.1 * goal_actions.RESTED)
    assert is_looked_at(ended=True, after=1.1 * goal_actions.SETTLED)
