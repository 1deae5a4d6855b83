"""What the parts do, by their controls and without a browser: set as a hand would, read as an eye would."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from ipywidgets.widgets import widget

import rcilab
import rcilab.notebook
from rcilab import notebook
from rcilab.app.check.report_rows import row_tone
from rcilab.app.goal.goal_actions import SetLaw
from rcilab.app.planning import build_plan_view
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.i18n.catalogue import load_catalogue, load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES
from rcilab.makers.rokae.faults import Fault
from rcilab.notebook.kernel_reachability import KernelReachability
from tests.catalogues import require_equal
from tests.waiting import wait_for

if TYPE_CHECKING:
    from rcilab.notebook import Lab


PRO7 = rcilab.load_model("xMatePro7")
XMATE3 = rcilab.load_model("xMate3")
GOAL = PRO7.home + np.array([0.5, -0.4, 0.3, -0.6, 0.4, -0.5, 0.6])


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    with notebook.Lab(PRO7, reachability=KernelReachability(route="loopback")) as made:
        yield made


@pytest.fixture
def fresh(lab: Lab) -> Lab:
    with lab.state.lock:
        lab.state._last_position = PRO7.home
        lab.state.store.update(plan=None, no_plan=None, recording=None)
        lab.state.moment, lab.state.displayed = None, None
        lab.state.notify("plan", "moment", "goal")
    lab.jog.q = PRO7.home
    return lab


def text_of(widget: Any) -> str:
    return re.sub(r"<[^>]*>", "", widget.value)


def test_both_languages_say_the_same_things() -> None:
    require_equal(lambda language: load_catalogue("rcilab.notebook", language), LANGUAGES)
    for language in LANGUAGES:
        own, shared = (load_catalogue(package, language).keys() for package in ("rcilab.notebook", "rcilab.i18n"))
        assert not own & shared


def test_every_key_in_the_code_has_words() -> None:
    sources = Path(str(files("rcilab.notebook"))).glob("*.py")
    pattern = r"""(?:\btext|message|_button)\(\s*["']([a-z_]+\.[a-z_.]+)["']"""
    written = {key for path in sources for key in re.findall(pattern, path.read_text(encoding="utf-8"))}
    assert len(written) > 60
    assert sorted(written - load_ui_catalogue("rcilab.notebook", "en").keys()) == []


def test_the_names_of_the_architecture_are_there() -> None:
    assert set(rcilab.notebook.__all__) == {
        "FaultPanel", "JogPanel", "Lab", "MotionPlot", "PlanPanel", "ReportView", "RunPanel", "Scene", "TargetPanel",
        "Timeline",
    }  # fmt: skip


def said_by(widget: Any) -> Iterator[str]:
    """Every text of a widget and of what is in it, but for style sheets."""
    for name in ("value", "description", "tooltip"):
        text = getattr(widget, name, None)
        if isinstance(text, str) and "<style>" not in text:
            yield text
    for child in getattr(widget, "children", ()):
        yield from said_by(child)


def open_tabs(lab: Lab) -> None:
    for tab in range(len(lab.tabs.children)):
        lab.tabs.selected_index = tab


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_place_in_a_sentence_is_left_unfilled(language: str) -> None:
    with notebook.Lab(PRO7, language=language, reachability=KernelReachability(route="loopback")) as made:
        open_tabs(made)
        made.jog.q = GOAL
        made.plan.plan.click()
        texts = list(said_by(made.widget))
    assert len(texts) > 50
    assert [text for text in texts if re.search(r"\{[a-z_]+\}", text)] == []


@pytest.mark.parametrize("name", notebook.__all__)
def test_a_part_speaks_as_the_notebook_unless_somebody_says_otherwise(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("JPY_SESSION_NAME", "01_first_motion.zh.ipynb")
    make = getattr(notebook, name)
    with make(PRO7) as chinese, make(PRO7, language="en") as english, make(english) as beside:
        assert [part.text.language for part in (chinese, english, beside)] == ["zh", "en", "en"]
        with make(english, language="zh") as told:
            assert told.text.language == "zh"
            assert told.state is english.state


def test_every_tab_of_a_lab_speaks_as_the_lab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JPY_SESSION_NAME", "05_s_curves_and_limits.zh.ipynb")
    with notebook.Lab(PRO7, reachability=KernelReachability(route="loopback")) as made:
        open_tabs(made)
        assert {part.text.language for part in made._parts} == {"zh"}
        assert "关节 1" in list(said_by(made.widget))


def test_what_is_on_a_tab_is_made_once_when_it_is_opened_or_asked_for_and_ends_with_the_lab() -> None:
    with notebook.Lab(PRO7, reachability=KernelReachability(route="loopback")) as made:
        assert [len(reachability.children) for reachability in made.tabs.children] == [1, 0, 0, 0, 0, 0]
        made.tabs.selected_index = 2
        assert made.tabs.children[2].children == (made.plan.widget,)
        run = made.run
        made.tabs.selected_index = 4
        assert made.run is run
        assert made.tabs.children[4].children == (run.widget,)
    assert repr(run).endswith("closed>")
    with pytest.raises(UsageError, match="run its cell again"):
        made.faults  # noqa: B018  # Asking is what makes it.


def test_a_session_is_looked_after_before_its_tab_is_opened() -> None:
    with rcilab.simulate(PRO7) as robot, notebook.Lab(robot, reachability=KernelReachability(route="loopback")) as made:
        assert made.tabs.selected_index == 0
        assert made.state.robot is not None


def test_the_lab_opens_with_few_messages() -> None:
    # Each widget is a message to the browser.
    with notebook.Lab(PRO7, reachability=KernelReachability(route="loopback")):
        before = len(widget._instances)
        with notebook.Lab(PRO7, reachability=KernelReachability(route="loopback")):
            assert len(widget._instances) - before < 120


def test_a_slider_moves_the_goal_and_its_ends_are_the_limits(fresh: Lab) -> None:
    slider = fresh.jog.sliders[3]
    slider.value = 30.0
    assert np.degrees(fresh.jog.q[3]) == pytest.approx(30.0)
    assert fresh.jog.fields[3].box.value == "30.00"
    assert slider.max == pytest.approx(np.degrees(PRO7.limits.joint.upper[3]))


def test_a_typed_number_counts_and_a_bad_one_is_answered_below_the_field(fresh: Lab) -> None:
    field = fresh.jog.fields[0]
    for typed, sentence in (
        ("far", "is not a number"),
        ("1e999", "not a finite"),
        ("500", "outside -170° to 170°"),
        ("nan", "finite"),
    ):
        field.box.value = typed
        assert sentence in text_of(field.message_box), typed
        assert fresh.jog.q[0] == PRO7.home[0]
    field.box.value = "-0,25"
    assert np.degrees(fresh.jog.q[0]) == pytest.approx(-0.25)
    assert not field.problem


def test_undo_goes_back_to_the_pose_before_a_button(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    fresh.jog._on_button("zero")
    assert not fresh.jog.q.any()
    fresh.jog._on_button("undo")
    np.testing.assert_array_equal(fresh.jog.q, GOAL)


def test_a_typed_target_is_reached_as_the_library_reaches_it(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    height = 1000.0 * PRO7.forward(GOAL).position[2]
    fresh.target.fields[2].box.value = f"{height - 20.0:.1f}"
    wanted = PRO7.closest(fresh.state.now.goal.target, GOAL).q
    np.testing.assert_allclose(fresh.state.now.goal.q, wanted, atol=1e-12)
    assert PRO7.forward(fresh.state.now.goal.q).position[2] == pytest.approx(fresh.state.now.goal.target.position[2])


def test_branches_and_the_arm_angle_keep_the_tool_where_it_is(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    pose = PRO7.forward(GOAL)
    assert len(fresh.target.branches.options) > 1
    fresh.target.branches.value = next(
        number for _, number in fresh.target.branches.options if number != fresh.target.branches.value
    )
    assert np.abs(fresh.state.now.goal.q - GOAL).max() > 0.1
    assert PRO7.forward(fresh.state.now.goal.q).is_close(pose, 1e-6)
    fresh.target.psi.value = fresh.target.psi.value + 5.0
    assert PRO7.forward(fresh.state.now.goal.q).is_close(pose, 1e-6)


def test_a_target_out_of_reach_is_said_and_the_nearest_pose_taken(fresh: Lab) -> None:
    fresh.target.fields[0].box.value = "2500"
    assert fresh.state.now.goal.reach.tone == "bad"
    assert "Not reachable" in text_of(fresh.target._reach)


def test_the_circle_is_the_librarys(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    arcs = PRO7.feasible_arcs(PRO7.forward(GOAL)).arcs
    assert fresh.target._circle.value.count("<title>") == len(arcs)


def test_what_a_browser_rounds_to_the_steps_of_a_slider_moves_nothing(fresh: Lab) -> None:
    fresh.tabs.selected_index = 1
    fresh.jog.q = q = PRO7.home + 0.3
    fresh.plan._speed_field.box.value = "40.3"
    before = fresh.state.now.speed
    fresh.jog.sliders[1].value = round(np.degrees(PRO7.home[1]))  # What it showed before, told back late.
    for slider in (*fresh.jog.sliders, fresh.target.psi, fresh.plan.speed):
        slider.value = round(slider.value / slider.step) * slider.step  # As noUiSlider does with what it is given.
    np.testing.assert_array_equal(fresh.state.now.goal.q, q)
    assert fresh.state.now.speed == before == pytest.approx(0.403)
    for slider in (fresh.jog.sliders[0], fresh.plan.speed):
        slider.value += slider.step
    assert np.degrees(fresh.state.now.goal.q[0]) == pytest.approx(17.5)
    assert fresh.state.now.speed == pytest.approx(0.41)


def test_plan_check_and_plot_show_the_same_motion_as_the_library(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    fresh.plan.speed.value = 40.0
    fresh.plan.plan.click()
    plan = fresh.state.now.plan
    assert plan is not None
    np.testing.assert_array_equal(
        plan.motion.q, rcilab.plan_joint(PRO7, PRO7.home, GOAL, speed=0.4, law="torque_rate_limited").q
    )
    assert plan.report.ok
    assert fresh.report.report is plan.report
    assert fresh.plot.html.count("<svg") == 4
    assert "Passed" in text_of(fresh.plan._sentence)
    assert not plan.report.warnings


def test_a_posed_goal_without_a_plan_says_which_button_is_missing() -> None:
    with notebook.PlanPanel(PRO7, language="en") as plan, notebook.ReportView(plan) as report:
        plan.state.pose(GOAL)
        for said in (plan._sentence, report._verdict):
            assert "pose the goal, then press Plan there" in text_of(said)


def test_a_goal_that_was_moved_is_told_beside_the_plan(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    fresh.plan.plan.click()
    fresh.jog.sliders[0].value = 1.0
    assert "has moved" in text_of(fresh.plan._sentence)


def test_the_report_on_poses_of_an_fr3_has_the_distance_of_the_joints_from_the_plan() -> None:
    model = rcilab.load_model("FR3")
    motion = rcilab.plan_joint(model, model.home, model.home + 0.1, speed=0.3)
    plan = build_plan_view(model, motion, rcilab.check(motion, model)).completed("cartesian_position")
    with notebook.ReportView(model, language="en") as report:
        report.state.show(plan)
        assert f"The joints end up to {np.degrees(plan.away):.1f}° from the plan" in text_of(report._verdict)


def test_a_row_of_the_report_has_the_same_tone_as_on_the_page() -> None:
    checked = rcilab.check(rcilab.plan_joint(PRO7, PRO7.home, GOAL), PRO7)
    rows = tuple(replace(row, ratio=0.99) for row in checked.rows)
    with notebook.ReportView(PRO7, replace(checked, rows=rows)) as report:
        shown = re.findall("rl-card rl-(good|warn|bad)", report._rows.value)
    assert sorted(shown) == sorted(row_tone(row) for row in rows)


def test_what_breaks_a_limit_is_shaded_explained_and_slowed_down_to_fit(fresh: Lab) -> None:
    fast = rcilab.Motion.from_cycles(rcilab.plan_joint(PRO7, PRO7.home, GOAL, speed=1.0).q[::2])
    fresh.state.take_motion(fast)
    assert 'class="rl-violation"' in fresh.plot.html
    assert "Not safe" in text_of(fresh.report._verdict)
    assert "rl-bad" in fresh.report._rows.value
    fresh.plan.slow_down.click()
    assert fresh.state.now.plan is not None
    assert fresh.state.now.plan.report.ok


def test_what_takes_longer_shows_how_far_it_is_and_can_be_given_up(fresh: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    panel, go_on = fresh.plan, threading.Event()
    fresh.jog.q = GOAL
    panel.plan.click()
    before = fresh.state.now.plan
    assert before is not None
    monkeypatch.setattr(
        "rcilab.notebook.long_task.kernel_cells", lambda: SimpleNamespace(is_calling=False)
    )  # A hand's.
    monkeypatch.setattr("rcilab.app.goal.goal_actions.make_plan", lambda *_: go_on.wait(20.0) and before)
    panel.plan.click()
    assert panel.plan.disabled
    wait_for(lambda: panel.cancel.layout.display is None, what="Cancel")
    panel.cancel.click()
    wait_for(lambda: not panel.plan.disabled, what="the end of it")
    assert panel.cancel.layout.display == panel.progress.layout.display == "none"
    assert fresh.state.now.plan is before
    panel.plan.click()
    go_on.set()
    wait_for(lambda: fresh.state.now.plan is not before, what="the plan")


def test_what_only_goes_against_advice_can_be_slowed_down_too(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    fresh.state.ask(SetLaw(law="jerk_limited"))
    fresh.plan.plan.click()
    plan = fresh.state.now.plan
    assert plan is not None
    assert plan.report.ok
    assert plan.report.warnings
    assert fresh.plan.slow_down.layout.display is None
    fresh.plan.slow_down.click()
    slower = fresh.state.now.plan
    assert slower is not None
    assert len(slower.report.warnings) < len(plan.report.warnings)
    assert fresh.plan.slow_down.layout.display == "none"


def test_a_motion_that_no_slow_down_mends_says_so(fresh: Lab) -> None:
    fresh.state.take_motion(rcilab.Motion.from_cycles(rcilab.plan_joint(PRO7, PRO7.home, GOAL, speed=1.0).q[::9]))
    broken = fresh.state.now.plan
    assert broken is not None
    fresh.plan.slow_down.click()
    assert fresh.state.now.plan is broken
    assert broken.report.slow_down().explain("en") in text_of(fresh.plan._sentence)


def test_a_straight_line_is_planned_or_refused_in_words(fresh: Lab) -> None:
    fresh.plan.path_type.value = "line"
    fresh.jog.q = PRO7.home + 0.1
    fresh.plan.plan.click()
    fresh.plan.path_type.value = "joint"
    said = text_of(fresh.plan._sentence)
    assert "Passed" in said or "No plan" in said


def test_the_timeline_moves_cursor_and_arm_together(fresh: Lab) -> None:
    fresh.jog.q = GOAL
    fresh.plan.plan.click()
    assert fresh.state.now.plan is not None
    fresh.timeline.slider.value = 300
    assert fresh.state.moment == pytest.approx(0.3)
    assert "left:" in fresh.plot._cursor.value
    picture = fresh.scene._picture
    assert picture is not None
    np.testing.assert_allclose(picture._arm._shown, fresh.state.now.plan.motion.at(0.3).q)
    fresh.timeline.live.click()
    assert fresh.state.moment is None
    np.testing.assert_allclose(picture._arm._shown, GOAL)


def test_parts_that_are_given_each_other_share_an_arm() -> None:
    with (
        notebook.JogPanel(XMATE3) as jog,
        notebook.MotionPlot(jog) as plot,
        notebook.ReportView(plot) as report,
        notebook.PlanPanel(jog) as plan,
    ):
        jog.q = XMATE3.home + 0.2
        plan.plan.click()
        assert report.report is not None
        assert plot.html.count("<svg") == 4
        with notebook.JogPanel(XMATE3) as other:
            assert other.state is not jog.state


def test_a_six_axis_arm_has_no_arm_angle() -> None:
    with notebook.TargetPanel(XMATE3) as target:
        assert target.psi is None


def test_where_nothing_is_live_a_film_is_shown_and_said() -> None:
    with notebook.Scene(XMATE3, reachability=KernelReachability(route="static")) as scene:
        assert scene.url is None
        assert "srcdoc=" in scene._frame.value
        assert "jupyter-server-proxy" in text_of(scene._note)
        before = scene._frame.value
        scene.state.take_motion(rcilab.plan_joint(XMATE3, XMATE3.home, XMATE3.home + 0.3))
        assert "set_animation" in scene._make_animation().html() or scene._frame.value != before


def test_a_film_advises_nothing_that_does_not_help() -> None:
    with notebook.Scene(XMATE3, reachability=KernelReachability(route="static", proxy_helps=False)) as scene:
        assert "an animation of the plan" in text_of(scene._note)
        assert "jupyter-server-proxy" not in text_of(scene._note)


def test_behind_a_proxy_the_frame_goes_through_it() -> None:
    with notebook.Scene(XMATE3, reachability=KernelReachability(route="proxy", base="/user/ann/")) as scene:
        assert 'src="/user/ann/proxy/' in scene._frame.value


def test_a_viser_frame_shows_the_same_arm() -> None:
    with notebook.Scene(XMATE3, view="viser", reachability=KernelReachability(route="loopback")) as scene:
        assert scene.url is not None
        assert scene.url.startswith("http://127.0.0.1:")
        scene.state.pose(XMATE3.home + 0.1)


@pytest.mark.parametrize("name", ["JogPanel", "Scene", "MotionPlot", "Timeline", "RunPanel", "FaultPanel"])
def test_what_is_no_arm_is_refused_in_words(name: str) -> None:
    part = getattr(notebook, name)
    with pytest.raises(InvalidValueError, match="load_model"):
        part("xMatePro7")


def test_every_part_shows_itself_in_chinese_and_closes_twice() -> None:
    for name in sorted(set(notebook.__all__) - {"Lab", "Scene"}):
        made = getattr(notebook, name)(XMATE3, language="zh")
        assert "application/vnd.jupyter.widget-view+json" in made._repr_mimebundle_()
        made.close()
        made.close()
    with pytest.raises(InvalidValueError, match="language"):
        notebook.JogPanel(XMATE3, language="xx")


def test_a_fault_is_told_with_its_cause_and_remedy() -> None:
    with notebook.FaultPanel(PRO7) as panel:
        panel.fault.value = Fault.COLLISION
        told = text_of(panel._details)
        assert "kCollision" in told
        assert Fault.COLLISION.cause in told


def test_a_lab_keeps_the_soft_limits_tool_and_load_that_its_session_sets_later():
    joint = PRO7.limits.joint
    lower, upper = joint.lower.copy(), joint.upper.copy()
    upper[1] = PRO7.home[1] - 0.1
    with rcilab.simulate(PRO7) as robot, notebook.JogPanel(robot) as jog:
        state = jog.state
        robot.rci.set_joint_limit(lower, upper)
        robot.rci.set_coor(rcilab.Pose([0.0, 0.0, 0.1]))
        assert state.model.limits.joint.upper[1] == upper[1]
        assert state.model.forward(PRO7.home).is_close(PRO7.forward(PRO7.home) @ rcilab.Pose([0.0, 0.0, 0.1]))
        with pytest.raises(InvalidValueError, match="q of joint 2"):
            state.pose(PRO7.home)
        jog.sliders[0].value = 20.0  # The goal is beyond the soft limit meanwhile: it comes inside.
        assert state.now.goal.q[0] == pytest.approx(np.radians(20.0))
        assert state.now.goal.q[1] == upper[1]
        jog.sliders[1].value = np.degrees(joint.upper[1])
        assert state.now.goal.q[1] == upper[1]
        robot.power_on()
        state.take_motion(rcilab.plan_joint(PRO7, PRO7.home, PRO7.home + 0.05))
        assert state.now.plan is not None
        assert not state.now.plan.report.ok, "it leaves the soft range"


def test_a_soft_limit_of_six_characters_fits_its_field() -> None:
    with notebook.RunPanel(PRO7) as panel:
        panel.limits._on_open({"new": 0})
        box = panel.limits.fields[0][0].box
        width, label = (float(em.removesuffix("em")) for em in (box.layout.width, box.style.description_width))
        assert width - label >= 5.6  # [em] "-170.0", and what surrounds it in a field.


def test_the_label_of_the_mode_has_the_width_that_it_needs() -> None:
    with notebook.RunPanel(PRO7) as panel:
        assert panel.modes.mode.style.description_width == "initial"


def test_a_slip_in_the_name_of_an_attribute_is_not_taken_in_silence():
    panel = notebook.TargetPanel(rcilab.load_model("xMatePro7"))
    with pytest.raises(AttributeError, match=r"TargetPanel has no languge; "):
        panel.languge = "zh"
    panel.close()
