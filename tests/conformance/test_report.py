import math
import re

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.explain import explain_source
from rcilab.conformance.html import COLORS
from rcilab.conformance.report import Report
from rcilab.i18n.rounding import format_pair
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
GOOD = plan_joint(MODEL, MODEL.home, -MODEL.home, speed=0.4, law="s_profile")


def spoiled() -> Motion:
    q = GOOD.q.copy()
    q[412, 3] += 0.01
    return Motion.from_cycles(q)


def test_a_violation_reads_as_one_sentence_with_everything_in_it():
    violation = next(v for v in check(spoiled(), MODEL).violations if v.condition.id == "joint.velocity")
    assert re.fullmatch(
        r"joint 4: commanded velocity -?[\d.]+ rad/s exceeds 2\.175 rad/s at t = 0\.413 s, "
        r"from t = 0\.412 s on for 2 ms "
        r"\(necessary condition\); the samples around this time jump: smooth them",
        str(violation),
    )


def test_a_smooth_motion_that_is_too_fast_is_to_be_slower_also_where_only_its_last_sample_is_beyond() -> None:
    u = np.linspace(0.0, 1.0, 501)
    q = np.tile(MODEL.home, (501, 1))
    q[:, 3] += 0.7 * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    velocity = np.diff(q[:, 3]) / 1e-3
    first = int(np.flatnonzero(velocity > 2.175)[0]) + 1
    found = check(Motion.from_cycles(q[: first + 1]), MODEL, distance=None).violations
    violation = next(v for v in found if v.condition.id == "joint.velocity")
    assert violation.count == 1
    assert "slower" in str(violation)
    assert "jump" not in str(violation)


def test_an_angle_is_told_in_both_units():
    q = np.repeat(MODEL.home[np.newaxis], 10, axis=0)
    q[:, 1] = 2.2
    sentence = str(check(Motion.from_cycles(q), MODEL, distance=None).violations[0])
    assert sentence.startswith("joint 2: commanded position 2.2 rad (126.05°) passes 2.094 rad (120.00°) at t = 0.000")


def test_the_worst_violation_comes_first_and_the_worst_row_agrees():
    report = check(spoiled(), MODEL)
    ratios = [violation.ratio for violation in report.violations]
    assert ratios == sorted(ratios, reverse=True)
    assert report.worst.condition is report.violations[0].condition
    assert report.worst.value == report.violations[0].value
    assert report.worst.joint == 4


def test_an_end_shows_the_commanded_value_and_the_applied_tolerance():
    q = np.repeat(MODEL.home[np.newaxis], 10, axis=0)
    q[-1, 0] += 1.29e-6  # Within what a cycle of the largest jerk changes.
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    row = next(row for row in report.rows if row.id == "end.velocity")
    assert row.ok
    assert row.value == pytest.approx(1.29e-3)
    assert row.bound == pytest.approx(1e-4 + MODEL.limits.joint.jerk[0] * 1e-6)
    assert row.texts == ("0.00129", "0 ± 0.0051", "")
    q[1:, 0] += 7.964e-6
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    sentence = next(str(found) for found in report.warnings if found.condition.id == "start.acceleration")
    assert "acceleration at the start is -7.964 rad/s^2, not 0 within 5.01 rad/s^2" in sentence


def test_rows_name_joint_time_value_bound_and_source():
    motion = plan_joint(MODEL, MODEL.home, -MODEL.home, speed=1.0)
    row = next(row for row in check(motion, MODEL).rows if row.id == "joint.velocity")
    assert row.ok
    assert row.ratio == pytest.approx(abs(row.value) / abs(row.bound))
    assert row.source == "RCI manual V1.3.1, 4.1 and 4.4"
    step = motion.q[round(row.time * 1000)] - motion.q[round(row.time * 1000) - 1]
    assert row.value == pytest.approx(step[row.joint - 1] / 0.001, rel=1e-9)


def test_the_manual_is_the_source_of_the_arm_s_own_limits_only():
    own = MODEL.limits.joint
    for change, source in ((0.5, "soft limit, set by a user"), (0.0, "RCI manual V1.3.1, 4.1 and 4.4")):
        for lower, upper in ((own.lower - change, own.upper + change), (own.lower + change, own.upper - change)):
            rows = {row.id: row for row in check(GOOD, MODEL.with_joint_limits(lower, upper)).rows}
            assert rows["joint.position"].source == source
            assert rows["joint.velocity"].source == "RCI manual V1.3.1, 4.1 and 4.4"
            assert explain_source(rows["joint.position"].condition, "zh") != source


def test_the_text_says_the_verdict_and_lists_every_condition():
    good, bad = check(GOOD, MODEL), check(spoiled(), MODEL)
    assert "conforms; nearest necessary bound: " in str(good)
    assert "does not conform" in str(bad)
    assert "kCommandJointAccelerationDiscontinuity" in str(bad)
    assert all(row.id in str(good) for row in good.rows)
    assert repr(good).startswith("<Report conforms")


def test_a_thousand_violations_do_not_make_a_thousand_lines():
    rows = MODEL.home + 0.01 * np.random.default_rng(0).normal(size=(300, 7))
    report = check(Motion.from_cycles(rows), MODEL)
    assert len(report.violations) > 100
    assert len(str(report).splitlines()) < 30
    assert len(report._repr_html_()) < 20000
    assert "more" in str(report)


def test_the_table_is_green_amber_or_red():
    amber = check(GOOD, MODEL, start=MODEL.home + 2e-9)
    assert amber.ok
    assert amber.warnings
    for report, color in ((check(GOOD, MODEL), "ok"), (amber, "advice"), (check(spoiled(), MODEL), "violated")):
        html = report._repr_html_()
        cells = html.split("<tbody><tr>")[1].split("</tr>")[0].split("</td>")
        assert ["nowrap" in cell for cell in cells[:-1]] == [True, False, True, True, True, False, True, False]
        assert html.startswith(f'<div><b style="color:{COLORS[color]}"')
        assert html.count("<tr>") == len(report.rows) + 1
    assert COLORS["violated"] not in amber._repr_html_()


@pytest.mark.parametrize(
    ("value", "bound", "texts"),
    [
        (2.31, 2.175, ("2.31", "2.175")),
        (2.17500001, 2.175, ("2.17500001", "2.175")),
        (10.0, 10.0, ("10", "10")),
        (math.nextafter(1.0, 2.0), 1.0, ("1.0000000000000002", "1.0")),
    ],
)
def test_value_and_bound_never_look_alike_when_they_differ(value, bound, texts):
    assert format_pair(value, bound) == texts


def test_a_violation_shows_itself_as_its_sentence_and_help_names_the_fields():
    violation = check(spoiled(), MODEL).violations[0]
    assert repr(violation) == f"<Violation: {violation}>"
    assert {"rows:", "violations:", "warnings:", "certificate:"} <= set(Report.__doc__.split())
