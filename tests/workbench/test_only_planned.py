"""An arm that is neither simulated nor driven opens in preview: plan and check; Execute says why it cannot run."""

from __future__ import annotations

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from rcilab.app.arm_features import explain_missing_robot
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import GoalActions, PlanGoal
from rcilab.app.run.readiness import connection_note, obstacle
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import ModelError
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.panels.run import RunPanel
from rcilab.workbench.security import require_openable
from tests.waiting import wait_for


def test_it_is_planned_and_checked_in_preview_and_not_executed(only_planned):
    with Workbench(WorkbenchConfig(model=only_planned, port=0)) as bench:
        model = bench.store.state.model
        bench.store.update(goal=goal_at(model, model.home + 0.1))
        bench.dispatcher.ask(PlanGoal(page=None))
        wait_for(lambda: bench.store.state.plan is not None, what="a plan")
        plan = bench.store.state.plan
        assert plan is not None
        assert plan.report.ok
        assert plan.starts_at == pytest.approx(model.home)
        status = bench.session.status()
        assert (status.phase, bench.session.is_ready) == ("closed", False)
        reason = obstacle(bench.store.state, status)
        assert reason == explain_missing_robot(model, is_virtual=True)
        assert reason is not None
        assert reason.code == "error.only_planned"
        assert bench.dispatcher.errors == bench.renderer.errors == []


def test_why_it_cannot_run_stands_once_on_the_run_tab_and_its_verdict_needs_no_robot(only_planned):
    model = load_model(only_planned)
    store = Store(UiState(model=model, goal=goal_at(model, model.home + 0.1)))
    status, text = SupervisorStatus(), Text("en")
    GoalActions(store, SimpleNamespace(status=lambda: status)).plan(PlanGoal())
    panel = RunPanel(text, lambda request: None)
    panel.build(MagicMock(), store.state)
    panel.show(store.state, status)
    assert connection_note(store.state, status) == obstacle(store.state, status)  # Said beside the destination.
    assert panel._reason._shown == ""
    assert text("check.passed") in panel._planned._shown


def test_it_is_not_opened_at_an_address(only_planned):
    with pytest.raises(ModelError, match=f"{only_planned} is driven by Franka's own interface"):
        require_openable("127.0.0.1", None, "rci://127.0.0.1:1337", only_planned)
