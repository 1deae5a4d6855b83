"""The button that leads an arm back inside its joint ranges, at a controller that another client left outside."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rcilab import connect
from rcilab.app.goal.goal_actions import PlanRecovery, PoseGoal
from rcilab.app.run.readiness import may_lead_inside
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.run.world_actions import PressSafety
from rcilab.app.text import Text
from rcilab.control_process.launch import start_controller
from rcilab.core.state import RobotMode
from rcilab.workbench.app import Workbench, WorkbenchConfig
from tests.outside import JOINT, drive_outside
from tests.workbench.opened import all_told, wait


@pytest.fixture
def bench() -> Iterator[Workbench]:
    controller = start_controller("xMatePro7")
    assert controller.address is not None
    try:
        with connect(controller.address) as robot:
            robot.power_on()
            drive_outside(robot)
            robot.recover()
            robot.power_on()
        with Workbench(WorkbenchConfig(target=controller.address, port=0, quality="light")) as bench:
            yield bench
            assert bench.dispatcher.errors == []
            assert bench.renderer.errors == []
    finally:
        controller.end()


def test_the_arm_is_led_back_inside_and_plans_start_there_again(bench):
    ask, store, session = bench.dispatcher.ask, bench.store, bench.session
    upper = store.state.model.limits.joint.upper[JOINT]
    wait(lambda: session.status().phase == "idle" and bool(session.status().powered), "an idle arm")
    assert may_lead_inside(store.state, session.status())
    wait(lambda: store.state.no_plan is not None and store.state.no_plan.code == "plan.start_limit", "a refusal")
    ask(PlanRecovery())
    wait(lambda: store.state.plan is not None and store.state.plan.complete, "a plan")
    ask(RobotCommand(what="execute"))
    wait(lambda: store.state.asked is not None, "the question")
    ask(RobotCommand(what="confirm"))
    wait(lambda: session.status().q_c[JOINT] < upper - 0.017, "the arm inside")
    wait(lambda: session.status().phase == "idle", "the arm to stop")
    ask(PoseGoal(name="home"))
    wait(lambda: store.state.plan is not None and store.state.plan.motion.start[JOINT] < upper, "a plan from inside")
    assert not may_lead_inside(store.state, session.status())


@pytest.mark.parametrize(("model", "library"), [("xArm7", "xarm"), ("RM65", "Robotic_Arm")])
def test_the_notice_of_a_refused_recovery_goes_once_the_robot_has_recovered(model, library):
    pytest.importorskip(library, reason="needs the extra of the maker")
    with Workbench(WorkbenchConfig(model=model, port=0, quality="light")) as bench:
        ask, session = bench.dispatcher.ask, bench.session
        wait(lambda: session.status().phase == "idle" and bool(session.status().powered), "an idle arm")
        wait(lambda: bench.store.state.world.status is not None, "the simulation port")
        ask(PressSafety(button="estop"))
        wait(lambda: session.status().robot_mode is RobotMode.USER_STOPPED, "the emergency stop")
        ask(RobotCommand(what="recover"))
        wait(lambda: "notice.refused" in all_told(bench), "the refusal")
        (refusal,) = (notice for notice in bench.store.state.notices if notice.text.code == "notice.refused")
        assert " 0 s" not in Text("en").render(refusal.text)
        ask(PressSafety(button="none"))
        wait(lambda: "safety.estop_over" in all_told(bench), "the release")
        ask(RobotCommand(what="recover"))
        wait(lambda: "notice.refused" not in all_told(bench), "the notice to go")
        assert bench.dispatcher.errors == []
