"""The way back inside the joint ranges."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab import SafetyBox, check, load_model, plan_recovery
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import PlanningError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Text
from rcilab.motion import Motion, Program, Waypoint, plan_joint, plan_line, plan_program
from rcilab.motion.bounds import limit_touched

MODELS = ["xMate3", "xMatePro7", "Panda"]


def beyond(model, degrees, joint=0):
    """Returns home with one joint so far outside its range."""
    q = model.home.copy()
    q[joint] = model.limits.joint.upper[joint] + np.radians(degrees)
    return q


def in_both(error):
    """Returns the words of an error, English and Chinese."""
    return "\n".join(Text(language, "rcilab.app").render(describe_error(error)) for language in ("en", "zh"))


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("degrees", [0.0, 0.99, 19.9])
def test_a_joint_outside_is_led_straight_back_and_the_others_stay(name, degrees):
    model = load_model(name)
    q = beyond(model, degrees)
    motion = plan_recovery(model, q)
    assert (np.diff(motion.q[:, 0]) <= 0.0).all()
    assert motion.goal[0] == pytest.approx(model.limits.joint.upper[0] - np.radians(1.0))
    assert (motion.q[:, 1:] == q[1:]).all()
    assert check(motion, model, distance=ClearanceLimit()).certificate is not None


def test_an_arm_that_is_inside_stays():
    model = load_model("xMate3")
    assert plan_recovery(model, model.home).duration == 0.0


def test_the_range_of_a_soft_limit_counts():
    model = load_model("xMate3")
    soft = model.with_joint_limits(model.home - 0.1, model.home + 0.1)
    motion = plan_recovery(soft, model.home + 0.2)
    assert motion.goal == pytest.approx(model.home + 0.1 - np.radians(1.0))


def test_a_joint_too_far_beyond_a_soft_limit_is_told_that_limit_and_the_other_is_not():
    model = load_model("xMate3")
    soft = model.with_joint_limits(model.home - 0.1, model.home + 0.1)
    with pytest.raises(
        PlanningError, match=r"outside the soft limit of 5\.73° that was set.*widen the soft limit"
    ) as caught:
        plan_recovery(soft, model.home + 0.6)
    assert caught.value.code == "recovery_range_soft"
    assert "5.73°" in in_both(caught.value)
    with pytest.raises(PlanningError) as caught:
        plan_recovery(model, beyond(model, 20.1))
    assert "soft" not in str(caught.value)
    assert "软限位" not in in_both(caught.value)


@pytest.mark.parametrize("law", ["jerk_limited", "torque_rate_limited", "s_profile"])
def test_a_way_of_the_tool_past_a_soft_limit_is_told_that_limit(law):
    model = load_model("xMatePro7")
    T = model.forward(model.home)
    goal = Pose(T.position + [-0.15, 0.1, -0.1], T.wxyz)
    upper = model.limits.joint.upper.copy()
    upper[3] = np.radians(78.0)
    soft = model.with_joint_limits(model.limits.joint.lower, upper)
    with pytest.raises(PlanningError, match=r"joint 4 would pass the soft limit of 78\.00 deg that was set") as caught:
        plan_line(soft, model.home, goal, law=law)
    assert in_both(caught.value).count("78.00°") >= 2
    program = Program(model=model.name, start=model.home, waypoints=(Waypoint.line(goal),))
    with pytest.raises(PlanningError, match=r"joint 4 would pass the soft limit of 78\.00 deg that was set"):
        plan_program(soft, program, law=law)


def test_a_pose_behind_a_soft_limit_is_told_that_limit():
    model = load_model("xMatePro7")
    T = model.forward(model.home)
    lower = model.limits.joint.lower.copy()
    lower[5] = np.radians(80.0)
    soft = model.with_joint_limits(lower, model.limits.joint.upper)
    with pytest.raises(
        UnreachableError, match=r"joint 6 .* beyond the soft limit of 80\.00 deg that was set"
    ) as caught:
        soft.inverse(Pose(T.position + [-0.15, 0.1, -0.1], T.wxyz), psi=0.0)
    assert in_both(caught.value).count("80.00°") == 2


@pytest.mark.parametrize(("angle", "code"), [(1.0, "touches_soft"), (-3.2, "touches")])
def test_a_planned_motion_that_touches_a_bound_is_told_which(angle, code):
    model = load_model("xMatePro7")
    upper = model.limits.joint.upper.copy()
    upper[0] = 1.0
    limits = model.with_joint_limits(model.limits.joint.lower, upper).limits.joint
    touched = limit_touched(limits, 1, angle)
    assert touched.code == code
    assert ("57.30" in str(touched), in_both(touched).count("57.30°") >= 2) == (code == "touches_soft",) * 2


def test_a_joint_too_far_outside_is_refused_with_the_bound():
    model = load_model("xMate3")
    with pytest.raises(PlanningError, match=r"joint 1: 190\.10° .* is 20\.10° outside its range.* up to 20°"):
        plan_recovery(model, beyond(model, 20.1))
    rows = np.linspace(beyond(model, 20.1), beyond(model, -1.0), 5000)
    assert any(v.condition.id == "joint.position" for v in check(Motion.from_cycles(rows), model).violations)


def test_a_motion_from_outside_may_not_lead_farther_out():
    model = load_model("xMate3")
    q = beyond(model, 1.0)
    wide = model.with_joint_limits(2.0 * model.limits.joint.lower, 2.0 * model.limits.joint.upper)
    report = check(plan_joint(wide, q, beyond(model, 2.0), speed=0.05), model)
    assert [v.condition.id for v in report.violations] == ["joint.position"]


@pytest.mark.parametrize("name", MODELS)
def test_planning_from_outside_names_the_way_back(name):
    model = load_model(name)
    with pytest.raises(PlanningError, match=r"start .* plan_recovery\(model, q\) moves back inside"):
        plan_joint(model, beyond(model, 1.0), model.home)


@pytest.mark.parametrize(("height", "is_allowed"), [(-0.06, True), (0.02, False)])
def test_a_tool_that_starts_outside_its_box_may_only_move_in(height, is_allowed):
    model = load_model("xMate3")
    here = model.forward(model.home)
    box = SafetyBox(size=(0.2, 0.2, 0.2), T_base_box=Pose(here.position - [0.0, 0.0, 0.15]))
    motion = plan_line(model, model.home, Pose(here.position + [0.0, 0.0, height], here.wxyz), speed=0.2)
    assert check(motion, model, box=box).ok is is_allowed


def test_the_row_of_the_box_says_how_far_outside_the_tool_starts():
    model = load_model("xMatePro7")
    x, y, z = model.forward(model.home).position
    box = SafetyBox(size=(0.4, 0.4, 0.4), T_base_box=Pose((x, y, z - 0.25)), active=True)
    motion = plan_recovery(model, model.home, box)
    report = check(motion, model, box=box)
    row = next(row for row in report.rows if row.condition.signal == "position")
    assert row.ok
    assert row.start_excess == pytest.approx(0.05)
    assert row.texts == ("0.05", "0", "")
    assert not row.has_share
    assert box.excess(model.forward(motion.goal).position) == pytest.approx(-0.01, abs=1e-6)
    inside = next(
        row
        for row in check(motion, model, box=SafetyBox(size=(2, 2, 2), T_base_box=Pose())).rows
        if row.condition.signal == "position"
    )
    assert inside.start_excess == 0.0
    assert inside.has_share
