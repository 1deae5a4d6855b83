from __future__ import annotations

import math
import re

import numpy as np
import pytest

import rcilab
from rcilab.core.errors import InvalidValueError
from rcilab.notebook import widgets

PRO7 = rcilab.load_model("xMatePro7")


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7"])
def test_every_joint_has_a_slider_with_its_limits_at_the_ends(name: str) -> None:
    model = rcilab.load_model(name)
    sliders = widgets.JointSliders(model).sliders
    np.testing.assert_allclose([math.radians(s.min) for s in sliders], model.limits.joint.lower, rtol=1e-12)
    np.testing.assert_allclose([math.radians(s.max) for s in sliders], model.limits.joint.upper, rtol=1e-12)


def test_moving_one_slider_poses_the_arm_in_radians() -> None:
    shown: list[np.ndarray] = []
    sliders = widgets.JointSliders(PRO7, show=shown.append)
    sliders.sliders[3].value = -45.0
    expected = PRO7.home.copy()
    expected[3] = math.radians(-45.0)
    np.testing.assert_array_equal(shown[-1], expected)
    np.testing.assert_array_equal(sliders.q, expected)


def test_what_a_browser_rounds_to_the_steps_of_a_slider_moves_nothing() -> None:
    sliders = widgets.JointSliders(PRO7)
    sliders.q = PRO7.home + 0.3
    angle = math.degrees(sliders.q[0])
    sliders.sliders[0].value = round(2.0 * angle) / 2.0  # As noUiSlider does with what it is given.
    np.testing.assert_array_equal(sliders.q, PRO7.home + 0.3)
    sliders.sliders[0].value += 0.5
    assert math.degrees(sliders.q[0]) == round(2.0 * angle) / 2.0 + 0.5


def test_the_arm_is_shown_where_it_begins_and_home_and_zero_lead_back() -> None:
    shown: list[np.ndarray] = []
    start = np.full(7, 0.3)
    sliders = widgets.JointSliders(PRO7, start, show=shown.append)
    np.testing.assert_array_equal(shown[0], start)
    sliders.zero.click()
    np.testing.assert_array_equal(shown[-1], np.zeros(7))
    sliders.home.click()
    np.testing.assert_array_equal(shown[-1], PRO7.home)


def test_setting_all_joints_shows_them_once_and_exactly() -> None:
    shown: list[np.ndarray] = []
    sliders = widgets.JointSliders(PRO7, show=shown.append)
    before = len(shown)
    q = np.linspace(-0.9, 0.9, 7) / 3.0
    sliders.q = q
    assert len(shown) == before + 1
    np.testing.assert_array_equal(shown[-1], q)
    np.testing.assert_allclose([slider.value for slider in sliders.sliders], np.degrees(q), atol=1e-12)


def test_a_slider_at_its_end_stays_inside_the_limit() -> None:
    sliders = widgets.JointSliders(PRO7)
    for slider in sliders.sliders:
        slider.value = slider.max
    assert (sliders.q <= PRO7.limits.joint.upper).all()


def test_the_pose_is_told_in_millimetres_and_degrees() -> None:
    sliders = widgets.JointSliders(PRO7, np.zeros(7))
    assert "z 1529.5 mm" in sliders.pose.value  # The sum of the lengths in the manual's table 4.5.
    assert "no arm angle here" in sliders.pose.value
    sliders.home.click()
    assert "arm angle 0.0°" in sliders.pose.value
    assert "-0.0" not in sliders.pose.value


def test_the_notebook_decides_the_language_unless_somebody_else_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JPY_SESSION_NAME", "01_first_motion.zh.ipynb")
    chinese, english = widgets.JointSliders(PRO7), widgets.JointSliders(PRO7, language="en")
    assert [slider.description for slider in chinese.sliders[:2]] == ["关节 1", "关节 2"]
    assert (chinese.zero.description, english.zero.description) == ("零位", "Zero")
    assert not re.search(r"[a-z]{3}", chinese.pose.value.replace("code", "")), chinese.pose.value
    assert "Tool in base" in english.pose.value
    with pytest.raises(InvalidValueError, match="language"):
        widgets.JointSliders(PRO7, language="fr")


def test_angles_beyond_a_limit_are_refused_by_joint_and_bound() -> None:
    q = PRO7.home.copy()
    q[1] = 2.2
    with pytest.raises(InvalidValueError, match=r"joint 2 must be from -2\.0944 to 2\.0944 rad, got 2\.2"):
        widgets.JointSliders(PRO7, q)


def test_sliders_can_wait_until_they_are_let_go() -> None:
    assert all(s.continuous_update for s in widgets.JointSliders(PRO7).sliders)
    assert not any(s.continuous_update for s in widgets.JointSliders(PRO7, continuous=False).sliders)
