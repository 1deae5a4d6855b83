"""An RM65 on the page: the parts of its interface by their names, a motion, its limits, Chinese."""

from __future__ import annotations

import numpy as np
import pytest

from browser.other_arm import switch_arm
from rcilab.app.run.mode_actions import SetControl
from rcilab.app.view_actions import SetView

pytest.importorskip("Robotic_Arm", reason="the extra realman is not installed")


@pytest.fixture(scope="module")
def switched(opened):
    """The page with an RM65, chosen in its settings; afterwards with the arm of the other tests."""
    yield from switch_arm(opened, "RealMan RM65")


@pytest.fixture
def rm65(switched, page):
    assert page.state.model.name == "RM65"
    return page


def test_it_is_planned_for_checked_and_executed_and_keeps_the_limits_that_are_set(rm65, heard):
    page = rm65
    page.open_tab("Setup")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "Tool frame" in table.inner_text(), "the parts of this arm")
    for shown in ("Payload of the tool frame", "Joint ranges", "Joint speeds", "Collision stage"):
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
    page.wait(lambda: "工具坐标系" in table.inner_text() and "关节速度" in table.inner_text(), "its parts")
