"""The way back inside the joint ranges."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab import SafetyBox, check, load_model, plan_recovery
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.motion import Motion, plan_joint, plan_line

MODELS = ["xMate3", "xMatePro7", "Panda"]


def beyond(model, degrees, joint=0):
    """Returns home with one joint so far outside its range."""
    q = model.home.copy()
    q[joint] = model.limits.joint.upper[joint] + np.radians(degrees)
    return q


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


def test_a_joint_too_far_outside_is_refused_with_the_bound():
    model = load_model("xMate3")
    with pytest.raises(PlanningError, match=r"joint 1: 190\.10° .* is 20\.10° outside its range.* from 20° at most"):
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
    with pytest.raises(PlanningError, match=r"start .* plan_recovery\(model, q\) leads back inside"):
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
    assert row.led_in == pytest.approx(0.05)
    assert row.texts == ("0.05", "0", "")
    assert not row.has_share
    assert box.excess(model.forward(motion.goal).position) == pytest.approx(-0.01, abs=1e-6)
    inside = next(
        row
        for row in check(motion, model, box=SafetyBox(size=(2, 2, 2), T_base_box=Pose())).rows
        if row.condition.signal == "position"
    )
    assert inside.led_in == 0.0
    assert inside.has_share
