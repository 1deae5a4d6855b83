"""Refusals name the soft limit that was set, and only where that and not the arm's own range is passed."""

from __future__ import annotations

import numpy as np
import pytest

import rcilab
from rcilab.app.goal.goal import evaluate_joints
from rcilab.app.jog.jog_state import Axis, at_limit
from rcilab.app.planning import make_plan
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_violation
from rcilab.core.errors import PlanningError
from rcilab.i18n.number_parsing import parse_number

ARM = rcilab.load_model("xMatePro7")
OWN = ARM.limits.joint
SOFT = ARM.with_joint_limits(OWN.lower, np.r_[np.radians(30.0), OWN.upper[1:]])
GOAL = np.radians([40.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0])
BELOW = np.radians([-175.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0])
BEYOND = np.radians([175.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0])


def refusal(model: rcilab.RobotModel, start: np.ndarray, goal: np.ndarray) -> str:
    with pytest.raises(PlanningError) as caught:
        rcilab.plan_joint(model, start, goal)
    return str(caught.value)


def test_a_planner_names_the_soft_limit_that_is_passed() -> None:
    assert "30.00° is the soft limit that was set" in refusal(SOFT, ARM.home, GOAL)
    assert "30.00° is the soft limit that was set" in refusal(SOFT, GOAL, ARM.home)
    assert "soft" not in refusal(SOFT, ARM.home, BELOW)  # Its lower bound is the arm's own one.
    assert "soft" not in refusal(ARM, ARM.home, BEYOND)


def test_limits_that_are_given_back_are_not_soft() -> None:
    whole = SOFT.with_joint_limits(OWN.lower, OWN.upper)
    assert "soft" not in refusal(whole, ARM.home, BEYOND)
    assert whole.fingerprint == ARM.fingerprint


@pytest.mark.parametrize(
    ("language", "words"), [("en", "the soft limit of 30.00° that was set"), ("zh", "软限位 30.00°")]
)
def test_a_check_advises_to_widen_the_soft_limit(language, words) -> None:
    report = rcilab.check(rcilab.plan_joint(ARM, ARM.home, GOAL), SOFT)
    violation = next(found for found in report.violations if found.condition.id == "joint.position")
    assert words in explain_violation(violation, language)
    other = rcilab.check(rcilab.plan_joint(ARM, ARM.home, GOAL), ARM.with_joint_limits(OWN.lower, OWN.upper))
    assert other.ok


@pytest.mark.parametrize("language", ["en", "zh"])
def test_the_page_names_the_soft_limit_of_a_goal(language) -> None:
    said = {
        "plan": make_plan(SOFT, ARM.home, GOAL, 0.5, "jerk_limited"),
        "start": make_plan(SOFT, GOAL, ARM.home, 0.5, "jerk_limited"),
        "reach": evaluate_joints(SOFT, GOAL).reason,
        "field": parse_number("40", -170.0, 30.0, "deg", soft_high=True).problem,
    }
    for place, message in said.items():
        words = Text(language).render(message)
        assert {"en": "soft limit", "zh": "软限位"}[language] in words, place
        assert "30°" in words or "30.0°" in words, place


def test_a_goal_beyond_the_range_is_not_called_at_its_limit() -> None:
    assert make_plan(ARM, ARM.home, BEYOND, 0.5, "jerk_limited").code == "plan.beyond_limit"
    assert evaluate_joints(ARM, BEYOND).reason.code == "reach.beyond_limit"
    at = np.r_[OWN.upper[0], GOAL[1:]]
    assert make_plan(ARM, ARM.home, at, 0.5, "jerk_limited").code == "plan.at_limit"
    assert evaluate_joints(ARM, at).reason.code == "reach.at_limit"


def test_a_jog_button_names_the_soft_limit_that_the_joint_is_at() -> None:
    at = np.r_[SOFT.limits.joint.upper[0], ARM.home[1:]]
    assert at_limit(SOFT, at, Axis("joint.0", 1)).code == "jog.at_soft_upper"
    own = np.r_[OWN.lower[0], ARM.home[1:]]
    assert at_limit(SOFT, own, Axis("joint.0", -1)).code == "jog.at_lower"
