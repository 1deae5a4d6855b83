"""Soft joint limits of the Setup tab: the controller has them, and what is planned keeps inside them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.check.freshness import outdated
from rcilab.app.goal.goal_actions import MoveJoint, PoseGoal
from rcilab.app.request import TypeField
from rcilab.app.run.readiness import obstacle
from rcilab.app.run.world_actions import SetWiring
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.setup.setup_actions import PressSetup
from rcilab.app.text import Text
from rcilab.execution.simulation_control import SimulationControl
from rcilab.model.robot_model import load_model
from rcilab.workbench.app import Workbench
from tests.workbench.opened import opened, wait

OWN = load_model("xMatePro7").limits.joint


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


def test_a_typed_limit_reaches_controller_and_plans_and_undo_takes_it_back(bench: Workbench) -> None:
    ask, state, status = bench.dispatcher.ask, lambda: bench.store.state, bench.session.status
    own = state().model.limits.joint.upper[0]
    ask(TypeField(field="setup.joints.upper.0", text="30"))
    wait(lambda: status().setup.joints is not None and status().phase == "idle", "the controller's yes")
    assert status().setup.joints.upper[0] == pytest.approx(np.radians(30.0))
    assert state().model.limits.joint.upper[0] == pytest.approx(np.radians(30.0))
    ask(PressSetup(what="undo"))
    wait(lambda: status().setup.joints.upper[0] == own, "the whole range at the controller")
    assert state().model.limits.joint.upper[0] == own


def test_a_limit_that_leaves_the_goal_or_the_arm_outside_is_named_at_once() -> None:
    with opened() as bench:
        ask, state = bench.dispatcher.ask, lambda: bench.store.state
        here = bench.session.status().q_c
        assert here is not None
        ask(MoveJoint(joint=0, angle=float(here[0]) + 0.5))
        wait(lambda: state().goal.reach.tone == "good", "the goal")
        ask(TypeField(field="setup.joints.upper.0", text=f"{np.degrees(here[0]) + 10.0:.2f}"))
        wait(lambda: state().goal.reach.reason.code == "reach.at_soft", "the goal's new verdict")
        assert state().goal.reach.reason.values["joint"] == 1
        ask(PressSetup(what="undo"))
        wait(lambda: state().goal.reach.tone == "good" and outdated(state()) is None, "the old verdict")
        outside = state().model.with_joint_limits(OWN.lower, np.r_[here[0] - 0.1, OWN.upper[1:]])
        reason = obstacle(replace(state(), model=outside), bench.session.status())
        assert reason is not None
        assert reason.code == "plan.start_soft"
        ask(PoseGoal(name="here"))
        wait(lambda: state().plan is None, "no plan at the goal")
        ask(TypeField(field="setup.joints.upper.0", text=f"{np.degrees(here[0]) - 10.0:.2f}"))
        wait(lambda: state().model.limits.joint.upper[0] < here[0], "the limit")
        wait(lambda: not pending_parts(state(), bench.session.status()), "the controller to have it")
        reason = obstacle(state(), bench.session.status())
        assert reason is not None
        assert reason.code == "plan.start_soft"
        assert reason.values["joint"] == 1


def test_a_plan_that_was_checked_inside_other_limits_is_out_of_date(bench: Workbench) -> None:
    ask, state = bench.dispatcher.ask, lambda: bench.store.state
    here = bench.session.status().q_c
    assert here is not None
    ask(MoveJoint(joint=0, angle=float(here[0]) - 0.9))
    wait(lambda: state().plan is not None and outdated(state()) is None, "a plan")
    limits = state().model.limits.joint
    lower = limits.lower.copy()
    lower[0] = here[0] - 0.8
    changed = outdated(replace(state(), model=state().model.with_joint_limits(lower, limits.upper)))
    assert changed is not None
    assert "soft joint limits" in Text("en").render(changed)


def test_a_limit_outside_the_arm_or_past_the_other_end_is_refused_beside_the_field(bench: Workbench) -> None:
    ask, state = bench.dispatcher.ask, lambda: bench.store.state
    for field, text in (("setup.joints.upper.1", "400"), ("setup.joints.lower.2", "170")):
        before = state().setup.wanted.joints
        ask(TypeField(field="setup.joints.upper.2", text="160"))
        wait(lambda before=before: state().setup.wanted.joints is not before, "an edit")
        ask(TypeField(field=field, text=text))
        wait(lambda field=field: field in state().problems, "a complaint")
    ask(PressSetup(what="whole"))
    wait(lambda: not state().problems, "no complaint")


def test_auto_limit_goes_to_our_own_controller(bench: Workbench) -> None:
    bench.dispatcher.ask(SetWiring(name="auto_limit", on=True))
    wait(lambda: bench.store.state.world.auto_limit, "the switch")


def test_the_box_follows_the_controller_whoever_set_it(bench: Workbench) -> None:
    address = bench.session.status().world_address
    assert address is not None
    host, _, port = address.partition(":")
    with SimulationControl(host, int(port)) as world:
        # What the test before has asked for on the page has arrived, or it would come after what is set here.
        wait(lambda: world.status().auto_limit is bench.store.state.world.auto_limit, "the page's own request")
        for on in (True, False, True):
            world.set_auto_limit(on)
            wait(lambda on=on: bench.store.state.world.auto_limit is on, "the box")
