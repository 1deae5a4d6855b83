"""What a motion uses of its limits in every cycle agrees with the report's own rows."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.limit_utilisation import near_bound
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
HOME = np.array(MODEL.home)


def test_a_motion_at_half_speed_uses_half_of_its_velocity_limit_at_most():
    motion = plan_joint(MODEL, HOME, HOME + 0.3, speed=0.5)
    usage = check(motion, MODEL, distance=None).usage()
    assert len(usage.ratio) == len(motion.times)
    cruising = int(np.argmax(np.abs(motion.dq).max(axis=1)))
    assert usage.ratio[cruising] >= np.abs(motion.dq[cruising] / MODEL.limits.joint.velocity).max() - 1e-3
    assert usage.ratio.max() < 1.0


def test_it_passes_one_exactly_where_a_necessary_condition_is_broken():
    q = np.array(plan_joint(MODEL, HOME, HOME + 0.3, speed=0.5).q)
    q[len(q) // 2 :] += 0.01
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    assert not report.ok
    usage = report.usage()
    assert usage.ratio.max() == pytest.approx(report.worst.ratio)
    assert usage.conditions[int(usage.row[int(usage.ratio.argmax())])].id == report.worst.id


def test_few_points_keep_the_largest_of_all_between_them():
    usage = check(plan_joint(MODEL, HOME, HOME + 0.3, speed=0.5), MODEL, distance=None).usage()
    rows = np.linspace(0, len(usage.ratio) - 1, 7).astype(int)
    few = usage.at_most(rows)
    assert few.max() == usage.ratio.max()
    assert few[2] == usage.ratio[rows[2] : rows[3]].max()


def test_only_the_outer_part_of_a_range_is_used():
    assert near_bound(np.array([0.0, 0.75, 0.9, 1.0, 1.1])).tolist() == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.5])
