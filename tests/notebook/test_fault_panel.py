"""FaultPanel: a fault of the fault lab beside the notebook's own robot, which it never touches."""

from __future__ import annotations

import html
import math
import re
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rcilab
from rcilab import notebook
from rcilab.app.fault_lab import FaultDemo
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.rokae.faults import Fault
from rcilab.notebook.kernel_reachability import KernelReachability
from tests.processes import processes
from tests.waiting import wait_for

if TYPE_CHECKING:
    from rcilab.notebook import MotionPlot, Scene, Timeline

PRO7 = rcilab.load_model("xMatePro7")


def text_of(widget: Any) -> str:
    return html.unescape(re.sub(r"<[^>]*>", "", widget.value))


def require_at_moment(demo: FaultDemo, scene: Scene, timeline: Timeline, plot: MotionPlot) -> None:
    picture = scene._picture
    assert picture is not None
    assert timeline.moment == pytest.approx(demo.time)
    assert timeline.slider.value == round(1000.0 * demo.time)
    np.testing.assert_allclose(picture._arm._shown, demo.moved.at(demo.time).q)
    assert 'class="rl-violation"' in plot.html
    assert "left:" in plot._cursor.value
    assert scene.state.now.plan is None  # It is never one to execute.


def test_a_fault_is_provoked_on_a_private_controller_looked_at_and_the_session_is_left_alone() -> None:
    with rcilab.simulate(PRO7) as robot:
        before = robot.receive_state()
        own = processes()
        with (
            notebook.FaultPanel(robot, language="zh") as panel,
            notebook.Scene(panel, reachability=KernelReachability(route="loopback")) as scene,
        ):
            panel.fault.value = Fault.COMMAND_JOINT_ACCELERATION_DISCONTINUITY
            panel.provoke.click()
            assert panel.provoke.disabled
            assert panel.cancel.layout.display is None
            wait_for(lambda: panel.demo is not None and not panel.provoke.disabled, 30.0, "the demo")
            assert panel.demo is not None
            said = text_of(panel._details)
            assert "kCommandJointAccelerationDiscontinuity" in said
            assert f"{math.degrees(5000.0):.0f}°/s³" in said  # Five thousand rad/s^3, in the degrees of every widget.
            for part in (
                panel.demo.describe("explanation", "zh"),
                *panel.demo.recovery_steps("zh"),
                panel.demo.script,
            ):
                assert part in said
            assert "<circle" in panel._details.value
            ticks = re.findall(r'text-anchor="end"[^>]*>([-0-9.e+]+)<', panel._details.value)
            assert max(map(float, ticks)) > 1e4  # So are the ticks of its curve.
            assert panel.progress.layout.display == "none"
            with notebook.Timeline(panel) as timeline, notebook.MotionPlot(panel) as plot:
                require_at_moment(panel.demo, scene, timeline, plot)
                timeline.slider.value = 0
                panel.moment.click()
                require_at_moment(panel.demo, scene, timeline, plot)
                timeline.live.click()
                assert timeline.moment is None
                assert plot.html.count("<svg") == 0
                panel.moment.click()
                panel.state.pose(PRO7.home + 0.1)  # Something else is to be seen.
                assert timeline.moment is None
                panel.moment.click()
                panel.fault.value = Fault.COLLISION
                assert timeline.moment is None
            assert panel.moment.layout.display == "none"
            assert "<circle" not in panel._details.value
            assert len(processes() - own) == 1
        assert processes() == own
        after = robot.receive_state()
        np.testing.assert_array_equal(after.q_c, before.q_c)
        assert after.faults == ()


def test_who_cancels_or_closes_sees_nothing_and_leaves_nothing_behind() -> None:
    own, threads = processes(), threading.active_count()
    with notebook.FaultPanel(PRO7) as panel:
        panel.provoke.click()
        panel.cancel.click()
        wait_for(lambda: not panel.provoke.disabled, 10.0, "the button again")
        assert panel.demo is None
        panel.provoke.click()
    wait_for(lambda: threading.active_count() == threads, 10.0, "the end of the threads")
    assert processes() == own


def test_an_arm_of_six_axes_is_told_which_fault_it_cannot_have() -> None:
    with notebook.FaultPanel(rcilab.load_model("xMate7")) as panel:
        panel.fault.value = Fault.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION
        assert panel.provoke.disabled
        assert "7 axes" in text_of(panel._details)
        panel.fault.value = Fault.COLLISION
        assert not panel.provoke.disabled


def test_an_error_without_a_scenario_is_shown_with_the_reason_why_it_cannot_be_provoked() -> None:
    with notebook.FaultPanel(rcilab.load_model("Panda")) as panel:
        assert len(panel.fault.options) == 41
        panel.fault.value = FrankaError.POWER_LIMIT_VIOLATION
        assert panel.provoke.disabled
        told = text_of(panel._details)
        assert panel.fault.value.cause in told
        assert "no scenario for it on Panda" in told


def test_every_fault_has_a_short_name_in_both_languages() -> None:
    for language in LANGUAGES:
        assert {f"label.{fault.key}" for fault in Fault} <= load_ui_catalogue("rcilab.notebook", language).keys()
