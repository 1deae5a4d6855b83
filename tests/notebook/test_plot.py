from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib import colors

import rcilab
from rcilab.core.errors import InvalidValueError
from rcilab.notebook import widgets
from rcilab.notebook.plot import JOINT_COLORS, VIOLATION_COLOR, plot
from rcilab.notebook.preview import preview
from tests.recording.runs import PLAN, some_run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


PRO7 = rcilab.load_model("xMatePro7")
MOTION = rcilab.plan_joint(PRO7, PRO7.home, PRO7.home + np.array([0.5, -0.4, 0.3, -0.6, 0.7, -0.8, 1.0]))
TOO_FAST = rcilab.Motion.from_cycles(MOTION.q[::2])


def hatched(ax: Axes) -> list[tuple[float, float]]:
    """Spans of time that are marked as violated."""
    spans = [patch for patch in ax.patches if colors.to_hex(patch.get_facecolor()).upper() == VIOLATION_COLOR]
    boxes = [span.get_extents().transformed(ax.transData.inverted()) for span in spans]
    return [(box.x0, box.x1) for box in boxes]


def main_axes(figure: Figure) -> list[Axes]:
    return list(figure.axes)


def test_four_panels_show_the_signals_in_si_units() -> None:
    labels = [ax.get_ylabel() for ax in main_axes(plot(MOTION, PRO7))]
    assert labels == ["q [rad]", "dq [rad/s]", "ddq [rad/s²]", "jerk [rad/s³]"]


def test_it_is_written_in_chinese_where_there_is_a_font_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def words(language: str | None = None) -> str:
        figure = plot(TOO_FAST, PRO7, joints=[1], language=language)
        ax = main_axes(figure)[0]
        return figure.get_suptitle() + main_axes(figure)[-1].get_xlabel() + ax.get_legend().get_texts()[0].get_text()

    assert "hatched" in words()
    monkeypatch.setenv("JPY_SESSION_NAME", "01_first_motion.zh.ipynb")
    monkeypatch.setattr("rcilab.notebook.fonts.chinese_font", lambda: None)
    assert "hatched" in words()
    monkeypatch.setattr("rcilab.notebook.fonts.chinese_font", lambda: "A Font")
    assert re.search(r"以斜线标出.*时间.*关节 1", words())
    assert "hatched" in words("en")
    family = plot(MOTION, PRO7)._suptitle.get_fontfamily()  # type: ignore[attr-defined]
    assert family[-1] == "A Font"
    assert len(family) > 1  # The usual one writes what it can.


def test_every_joint_is_drawn_with_every_sample_and_a_colour_of_its_own() -> None:
    lines = [line for line in main_axes(plot(MOTION, PRO7))[0].lines if len(line.get_xdata()) > 10]
    assert len({line.get_color() for line in lines}) == len(lines) == 7 <= len(JOINT_COLORS)
    for joint, line in enumerate(lines):
        np.testing.assert_array_equal(np.asarray(line.get_ydata())[: len(MOTION.q)], MOTION.q[:, joint])


def test_a_conforming_motion_has_nothing_hatched_and_says_so() -> None:
    figure = plot(rcilab.plan_joint(PRO7, PRO7.home, PRO7.home + 0.3, law="torque_rate_limited"), PRO7)
    assert [hatched(ax) for ax in main_axes(figure)] == [[], [], [], []]
    assert "inside all limits" in figure.get_suptitle()


def test_what_check_finds_is_hatched_from_its_first_to_its_last_sample() -> None:
    violations = rcilab.check(TOO_FAST, PRO7).violations
    spans = {f"joint.{name}": hatched(ax) for name, ax in zip(
        ("position", "velocity", "acceleration", "jerk"), main_axes(plot(TOO_FAST, PRO7)), strict=True
    )}  # fmt: skip
    assert {name for name, found in spans.items() if found} == {v.condition.id for v in violations}
    for violation in violations:
        first, last = violation.time, violation.time + (violation.count - 1) * 1e-3
        found = spans[violation.condition.id]
        assert any(begin <= first + 1e-9 and last <= end + 1e-9 for begin, end in found)
    covered = sum(end - begin for begin, end in spans["joint.acceleration"])
    assert covered < TOO_FAST.duration / 2.0  # Only where it is broken: in the middle of this motion all is well.


def test_each_distinct_limit_in_sight_has_its_line() -> None:
    velocity = main_axes(plot(MOTION, PRO7))[1]
    levels = {line.get_ydata()[0] for line in velocity.lines if len(line.get_xdata()) == 2}
    assert levels == {2.175, 2.61, -2.175, -2.61}


def test_chosen_joints_alone_are_drawn() -> None:
    ax = main_axes(plot(MOTION, PRO7, joints=[4]))[1]
    assert [line.get_label() for line in ax.lines if len(line.get_xdata()) > 10] == ["joint 4"]


@pytest.mark.parametrize("joints", [[0], [8], [], [1.5]])
def test_a_joint_that_the_arm_does_not_have_is_refused(joints: list[int]) -> None:
    with pytest.raises(InvalidValueError, match="must be numbers from 1 to 7"):
        plot(MOTION, PRO7, joints=joints)


def test_a_run_adds_what_the_robot_did_and_the_difference() -> None:
    with rcilab.simulate(PRO7) as robot:
        robot.power_on()
        motion = rcilab.plan_joint(PRO7, robot.state.q_c, robot.state.q_c + 0.02)
        run = robot.execute(motion, rcilab.check(motion, PRO7).certificate)
    axes = main_axes(plot(motion, PRO7, run))
    assert axes[-1].get_ylabel() == "actual - plan [mrad]"
    for ax, measured in zip(axes, (run.q, run.dq), strict=False):
        actual = [line for line in ax.lines if line.get_alpha() == 0.45]
        np.testing.assert_array_equal(actual[2].get_ydata(), measured[:, 2])
    np.testing.assert_allclose(axes[-1].lines[2].get_ydata(), 1e3 * run.error[:, 2])
    # On a still line a curve can be late unseen: in the jerk of what was commanded a cycle is plain to see.
    actual, planned = (
        next(line for line in axes[3].lines if line.get_alpha() == alpha and len(line.get_xdata()) > 10)
        for alpha in (0.45, None)
    )
    assert run.delay > 0
    late = np.interp(planned.get_xdata(), actual.get_xdata(), actual.get_ydata()) - planned.get_ydata()
    assert np.abs(late[5:-5]).max() < 1.0
    for ax in axes:
        drawn = [line.get_xdata()[0] for line in ax.lines if len(line.get_xdata()) == len(run.t)]
        assert set(drawn) == {run.t[0] - run.delay * 1e-3}


def test_a_figure_shows_itself_without_pyplot_or_a_display() -> None:
    code = """
import sys, rcilab
model = rcilab.load_model("xMate3")
figure = rcilab.plot(rcilab.plan_joint(model, model.home, model.home + 0.2), model)
assert figure._repr_png_()[:8] == b"\\x89PNG\\r\\n\\x1a\\n"
assert "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, env={"PATH": "", "HOME": "/nonexistent"})


def test_one_jump_of_all_joints_is_one_place_in_the_title() -> None:
    q = MOTION.q.copy()
    q[len(q) // 2 :] += 0.05
    assert len(rcilab.check(rcilab.Motion.from_cycles(q), PRO7).violations) == 21
    assert "limit exceeded once," in plot(rcilab.Motion.from_cycles(q), PRO7).get_suptitle()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((MOTION, "xMatePro7"), r"use load_model\('xMatePro7'\)"),
        ((PRO7, MOTION), "motion must be a motion.*, got RobotModel"),
        ((None, PRO7), "motion must be a motion.*, got None"),
        ((MOTION, PRO7, "x"), "run: 'x' is not a run"),
    ],
)
def test_wrong_types_are_refused_in_words(arguments: tuple[Any, ...], sentence: str) -> None:
    with pytest.raises(InvalidValueError, match=sentence):
        plot(*arguments)


def test_a_bare_joint_number_is_refused_in_words() -> None:
    with pytest.raises(InvalidValueError, match=r"joints must be a list"):
        plot(MOTION, PRO7, joints=3)  # type: ignore[arg-type]


def test_a_name_where_a_model_belongs_is_refused_by_previews_and_sliders_too() -> None:
    for make in (lambda name: preview(MOTION, name), widgets.JointSliders):
        with pytest.raises(InvalidValueError, match=r"use load_model\('xMatePro7'\)"):
            make("xMatePro7")


def test_a_run_is_drawn_with_its_plan_or_what_a_callback_commanded():
    run = some_run()
    for given in (run, replace(run, plan=None)):
        figure = plot(given, run.model)
        assert len(figure.axes) == 5
        drawn = next(line.get_ydata() for line in figure.axes[0].lines if line.get_label() == "joint 1")
        assert np.allclose(drawn[: len(PLAN.q) - 1], PLAN.q[:-1, 0], rtol=0, atol=1e-9)


def test_the_headline_names_the_advice_that_is_not_kept():
    model = rcilab.load_model("xMatePro7")
    motion = rcilab.plan_joint(model, model.home, model.home + 0.3)
    report = rcilab.check(motion, model)
    assert report.ok
    assert [warning.condition.id for warning in report.warnings] == ["joint.torque_rate"]
    title = plot(motion, model, language="en")._suptitle.get_text()
    assert "meets every limit, but not the recommendations for joint.torque_rate" in title
