"""The time law that keeps the recommended torque rate as well."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab import Pose, check, load_model, plan_joint, plan_line, plan_program
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.diagnostics.bench.compute import program_of
from rcilab.motion import Program, Waypoint

MODEL = load_model("xMatePro7")
LAW = "torque_rate_limited"


def names_of(motion, model=MODEL):
    report = check(motion, model, distance=None)
    assert report.ok
    return [violation.condition.id for violation in report.warnings]


@pytest.mark.parametrize("name", ["xMate3", "xMatePro7"])
@pytest.mark.parametrize("speed", [0.2, 1.0])
def test_a_joint_motion_keeps_the_recommended_rows_for_a_few_percent_of_its_time(name, speed):
    model = load_model(name)
    joint, random = model.limits.joint, np.random.default_rng(23)
    for start, goal in random.uniform(0.9 * joint.lower, 0.9 * joint.upper, (5, 2, model.n)):
        fastest = plan_joint(model, start, goal, speed=speed)
        assert names_of(fastest, model) == ["joint.torque_rate"]
        motion = plan_joint(model, start, goal, speed=speed, law=LAW)
        assert names_of(motion, model) == []
        assert motion.law == LAW
        assert fastest.duration < motion.duration < 1.05 * fastest.duration


@pytest.mark.parametrize("speed", [0.2, 1.0])
def test_a_line_keeps_the_recommended_rows(speed):
    here = MODEL.forward(MODEL.home)
    goal = Pose(here.position + [0.1, 0.1, -0.1], here.wxyz)
    assert names_of(plan_line(MODEL, MODEL.home, goal, speed=speed, law=LAW)) == []


def test_a_program_with_blends_keeps_the_recommended_rows():
    program = program_of(MODEL, 8)
    fastest, motion = plan_program(MODEL, program), plan_program(MODEL, program, law=LAW)
    assert names_of(fastest) == ["joint.torque_rate"]
    assert names_of(motion) == []
    assert motion.law == LAW
    assert motion.duration < 1.05 * fastest.duration


def test_a_program_runs_by_the_s_profile_where_it_stops_at_every_waypoint():
    here = MODEL.forward(MODEL.home)
    away = Pose(here.position + [0.0, 0.1, 0.0], here.wxyz)

    def program(blend):
        waypoints = (Waypoint.line(away, blend=blend, speed=0.2), Waypoint.joint(MODEL.home, speed=0.2))
        return Program(model=MODEL.name, start=MODEL.home, waypoints=waypoints)

    motion = plan_program(MODEL, program(0.0), law="s_profile")
    line = plan_line(MODEL, MODEL.home, away, speed=0.2, law="s_profile")
    assert np.array_equal(motion.q[: len(line)], line.q)
    assert motion.law == "s_profile"
    with pytest.raises(PlanningError, match="blend 20 mm, but with the S profile the tool stops at every waypoint"):
        plan_program(MODEL, program(0.02), law="s_profile")
    with pytest.raises(InvalidValueError, match="known: jerk_limited, torque_rate_limited, s_profile"):
        plan_program(MODEL, program(0.0), law="fast")


def test_an_arm_that_stays_and_a_motion_through_a_file_keep_the_law(tmp_path):
    assert plan_joint(MODEL, MODEL.home, MODEL.home, law=LAW).duration == 0.0
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1, law=LAW)
    motion.save(tmp_path / "motion.npz")
    assert type(motion).load(tmp_path / "motion.npz").law == LAW
