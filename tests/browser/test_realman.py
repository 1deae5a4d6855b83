"""An RM65 on the page: the parts of its interface by their names, a motion, its limits, Chinese."""

from __future__ import annotations

import numpy as np
import pytest

from browser.test_settings import choose
from rcilab.app.run.mode_actions import SetControl
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.view_actions import SetView

pytest.importorskip("Robotic_Arm", reason="the extra realman is not installed")


@pytest.fixture(scope="module")
def switched(opened):
    """The page with an RM65, chosen in its settings; afterwards with the arm of the other tests."""

    def wait_for_arm(name: str) -> None:
        opened.wait(lambda: opened.state.model.name == name, "the other model", 30)
        opened.wait(lambda: opened.status.phase == "idle" and bool(opened.status.powered), "a ready arm", 30)
        opened.wait(lambda: opened.shows("live", opened.status.q), "the arm in the scene", 30)

    opened.start_afresh()
    opened.open_tab("Settings")
    choose(opened, "Robot", "RealMan RM65")
    wait_for_arm("RM65")
    yield opened
    opened.bench.dispatcher.ask(SetView(name="language", value="en"))
    opened.bench.dispatcher.ask(ChooseRobot(model="xMatePro7"))
    wait_for_arm("xMatePro7")


@pytest.fixture
def rm65(switched, page):
    assert page.state.model.name == "RM65"
    return page


def test_it_is_planned_for_checked_and_executed_and_keeps_the_limits_that_are_set(rm65, heard):
    page = rm65
    page.open_tab("Setup")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "Tool frame" in table.inner_text(), "the parts of this arm")
    for shown in ("Payload of the tool frame", "Joint ranges", "Largest speeds of the joints", "Collision stage"):
        assert shown in table.inner_text()
    page.bench.dispatcher.ask(SetControl(group="joint_velocity", index=0, value=0.5))
    page.wait(lambda: page.state.model.limits.joint.velocity[0] == 0.5, "the limit of the plans")
    page.wait(lambda: page.status.setup.control is page.state.drive.control, "the controller to have it", 30)
    page.plan_to(1, -40.0 if page.status.q_c[0] > 0 else 40.0)
    assert np.abs(np.diff(page.state.plan.motion.q[:, 0])).max() <= 0.5e-3
    page.open_tab("Check")
    verdict = page.tab.locator(".rl-verdict.rl-good:visible").first
    page.wait(lambda: "Passed" in verdict.inner_text(), "a green report")
    goal = np.array(page.state.goal.q)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.phase == "idle" and np.abs(page.status.q - goal).max() < 2e-5, "the arrival", 30)
    page.wait(lambda: page.state.recording is not None and page.state.recording.tracking is not None, "a recording")


def test_it_speaks_chinese(rm65):
    page = rm65
    page.bench.dispatcher.ask(SetView(name="language", value="zh"))
    page.open_tab("配置")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "工具坐标系" in table.inner_text() and "关节最大速度" in table.inner_text(), "its parts")
