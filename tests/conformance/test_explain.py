"""Reports in words: complete in both languages, for every condition of the table."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from rcilab.conformance.advice import advise
from rcilab.conformance.catalogue import Language, Phrase, load_catalogue, translate
from rcilab.conformance.check import check
from rcilab.conformance.common_conditions import condition_table
from rcilab.conformance.explain import explain_formula, explain_source, explain_violation
from rcilab.conformance.html import report_html
from rcilab.conformance.report import Violation
from rcilab.core.clearance import LinkPair
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.catalogue import load_catalogue as load_room_catalogue
from rcilab.i18n.units import Units
from rcilab.makers.franka.conditions import FCI_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, plan_joint
from rcilab.robots import ROBOT_NAMES, describe_robot
from tests.catalogues import require_equal

MODEL = load_model("xMatePro7")
MOTION = plan_joint(MODEL, MODEL.home, -MODEL.home, speed=0.4)
LANGUAGES: tuple[Language, ...] = get_args(Language)


PANDA = load_model("Panda")
FRANKA_CONDITIONS = FCI_CONDITIONS.conditions


def violation_of(row: Condition, count: int = 25, model: RobotModel = MODEL) -> Violation:
    """One that breaks a row in its first column by a tenth of the bound, or by a tenth of its unit."""
    lower, upper = (float(bound[0]) for bound in row.bounds(model.limits))
    bound, sign = (lower, -1.0) if row.is_clearance else (upper, 1.0)
    value = bound + sign * 0.1 * (abs(bound) or 1.0) if np.isfinite(bound) else float("nan")
    return Violation(
        condition=row,
        joint=1 if row.is_per_joint else 0,
        time=0.4,
        count=count,
        value=value,
        worst_time=0.412,
        bound=bound,
        ratio=1.1,
        advice=advise(row, MOTION, row=400, count=count, ratio=1.1, is_off_start=False, is_record=row.is_measured),
        links=LinkPair(0, 5) if row.is_clearance else None,
    )


def test_every_language_has_the_same_keys_and_places_to_fill():
    require_equal(load_catalogue, LANGUAGES)


def test_a_formula_with_words_in_it_has_them_in_every_language():
    symbols = {"T", "d", "x", "q", "v", "dv", "dq", "ddq", "psi", "dpsi", "omega", "domega", "pi", "sign"}
    for row in (*RCI_CONDITIONS.conditions, *FRANKA_CONDITIONS):
        assert explain_formula(row) == row.formula
        said = re.findall(r"[A-Za-z][\w,]*", explain_formula(row, "zh"), re.ASCII)
        assert [word for word in said if "_" not in word and word not in symbols] == []
    worded = {row.formula for row in (*RCI_CONDITIONS.conditions, *FRANKA_CONDITIONS)}
    assert {key.removeprefix("formula.") for key in load_catalogue("zh") if key.startswith("formula.")} <= worded


def test_no_two_rooms_have_the_same_key():
    packages = ("rcilab.conformance", "rcilab.makers.rokae", "rcilab.makers.franka")
    keys = [key for package in packages for key in load_room_catalogue(package, "en")]
    assert len(keys) == len(set(keys))


def test_english_words_are_those_of_the_table_and_of_the_faults():
    words = load_catalogue("en")
    for table in (RCI_CONDITIONS, FCI_CONDITIONS):
        for row in table.conditions:
            assert words[f"quantity.{row.id}"] == row.quantity
    for row in RCI_CONDITIONS.conditions:
        assert explain_source(row) == row.source
        said = re.sub(r"RCI|SDK|URDF|rcilab|setCollisionBehavior|Hz|deg", "", explain_source(row, "zh"))
        assert not re.search(r"[A-Za-z]{2}", said), said
    for faults in (Fault, FrankaError):
        assert [words[f"fault.{fault.maker}.{fault.name}"] for fault in faults] == [fault.cause for fault in faults]


@pytest.mark.parametrize(
    ("row", "model"),
    [*((row, MODEL) for row in RCI_CONDITIONS.conditions), *((row, PANDA) for row in FRANKA_CONDITIONS)],
    ids=lambda value: getattr(value, "id", getattr(value, "name", "")),
)
@pytest.mark.parametrize("language", LANGUAGES)
def test_every_condition_is_explained_with_place_time_amount_fault_and_remedy(row, model, language):
    violation = violation_of(row, model=model)
    text = explain_violation(violation, language)
    words = load_catalogue(language)
    assert words[f"quantity.{row.id}"] in text
    assert violation.advice.text(language) in text
    assert text.endswith(translate(language, "remedy", advice=violation.advice.text(language)))
    assert "{" not in text
    if row.fault is None:
        assert words["raises.nothing" if row.necessity == "recommended" else "raises.unnoticed"] in text
    else:
        assert row.fault.manual_name in text
        assert words[f"fault.{row.fault.maker}.{row.fault.name}"] in text
    if row.stage == "throughout":
        assert re.search(r"t = 0\.412 s.*t = 0\.400 s.*25 ms", text)
        assert "t = 0.400 s" in explain_violation(violation_of(row, count=1, model=model), language)
    if row.is_per_joint:
        assert {"en": "joint 1", "zh": "关节 1"}[language] in text
    if row.is_clearance:
        assert {"en": "base and link 5", "zh": "基座 与 连杆 5"}[language] in text
        assert f"{abs(violation.value):.4g} m" in text  # How deep, where they overlap.
    elif row.signal != "frame" and not np.isnan(violation.value):  # Of rows that name no bound.
        unit = words.get(f"unit.{row.unit}", row.unit)
        assert f"{violation.value:.4g} {unit}" in text
        assert ("°)" in text) == (row.unit == "rad")
    if language == "zh":  # Nothing is left in English but names, units and settings.
        text = text if row.fault is None else text.replace(row.fault.manual_name, "")
        text = re.sub(r"\bnan\b|\binf\b", "", text)  # Of rows that name no bound.
        left = re.sub(
            r"\{|\}|k[A-Z]\w+|state\.q_c|speed|law|torque_rate_limited|rcilab( doctor)?|[tsm]\b|rad|ms|N m", "", text
        )
        assert not re.search(r"[A-Za-z]{2,}", left), left


@pytest.mark.parametrize(
    ("id_", "advice"),
    [
        ("joint.position", "choose a path inside the joint's range"),
        ("joint.velocity", "lower speed to 0.36 or less"),
        ("arm_angle.position", "keep the arm angle from -180° to 180°"),
        ("cartesian.position", "choose a path inside the safety box"),
        ("clearance.links", "choose a path that keeps them farther apart"),
        ("cartesian.frame", "command valid poses within reach"),
        ("torque.rate", 'plan it with law="torque_rate_limited"'),
        ("torque.range", "command less torque"),
        ("joint.torque_rate", "it protects the drives; law="),
        ("measured.joint.velocity", "keep the commands farther from the bound"),
        ("external.torque", "check for contact"),
        ("lost.commands", "check the network"),
        ("start.position", "plan the motion from the arm's commanded position"),
        ("end.velocity", "end the motion at standstill"),
    ],
)
def test_the_remedy_suits_the_condition(id_, advice):
    row = next(row for row in RCI_CONDITIONS.conditions if row.id == id_)
    assert violation_of(row).advice.startswith(advice)


def test_a_sentence_in_full_in_both_languages():
    velocity = next(row for row in RCI_CONDITIONS.conditions if row.id == "joint.velocity")
    violation = replace(violation_of(velocity, count=1), joint=4, value=-2.31, bound=-2.175, ratio=2.31 / 2.175)
    assert explain_violation(violation) == (
        "joint 4: commanded velocity -2.31 rad/s passes the bound of -2.175 rad/s by 0.135 rad/s, which is 106.2 % of "
        "the bound, at t = 0.400 s. The controller would raise kCommandJointVelocityLimitsViolation: a commanded joint "
        "velocity is too high. Remedy: lower speed to 0.36 or less."
    )
    assert explain_violation(violation, "zh") == (
        "关节 4：指令速度 -2.31 rad/s，超过限值 -2.175 rad/s，超出 0.135 rad/s，为限值的 106.2 %，t = 0.400 s。"
        "控制器会触发 kCommandJointVelocityLimitsViolation：关节指令速度过高。处理办法：将 speed 降到 0.36 或更低。"
    )


def test_a_sentence_is_said_in_the_units_that_are_asked_for():
    velocity = next(row for row in RCI_CONDITIONS.conditions if row.id == "joint.velocity")
    violation = replace(violation_of(velocity, count=1), joint=4, value=-2.31, bound=-2.175, ratio=2.31 / 2.175)
    assert "commanded velocity -132.4°/s passes the bound of -124.6°/s by 7.735°/s" in violation.explain(units=Units())
    box = replace(
        violation_of(next(row for row in RCI_CONDITIONS.conditions if row.id == "cartesian.position")), value=0.042
    )
    assert "is 42 mm outside" in box.explain("en", Units())
    assert "0.042 m" in box.explain("zh", Units(length="m"))
    report = check(MOTION, MODEL)
    assert "rad" not in report.explain("en", Units())
    assert "°" not in report.explain("en", Units(angle="rad"))


def test_an_accepted_motion_is_told_with_what_is_nearest_to_its_bound():
    report = check(MOTION, MODEL)
    worst = report.worst
    assert report.explain().startswith(
        "The robot would accept this motion: it meets every necessary condition. Nearest"
    )
    assert f"joint {worst.joint}, {worst.condition.quantity}" in report.explain()
    assert f"{100 * worst.ratio:.1f} % of the bound" in report.explain()
    assert report.explain("zh").startswith("机器人会接受该运动")


def test_a_tool_close_to_a_wall_is_told_with_its_distance():
    T_base_box = MODEL.forward(MODEL.home) @ Pose((0.499, 0.0, 0.0))
    still = plan_joint(MODEL, MODEL.home, MODEL.home)
    report = check(still, MODEL, box=SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=T_base_box))
    assert "Nearest to a face of the safety box: the tool, 0.001 m inside" in report.explain()
    assert "0.001 m" in report.explain("zh")


def test_a_refused_motion_is_told_worst_first_and_ends_with_what_a_slow_down_does():
    q = MOTION.q.copy()
    q[400, 3] += 1e-5
    report = check(Motion.from_cycles(q), MODEL)
    lines = report.explain().splitlines()
    assert lines[0].startswith(
        f"The robot would not accept this motion. Violations of necessary conditions: {len(report.violations)}."
    )
    assert lines[1].startswith("- joint 4: commanded jerk")
    assert lines[-1] == str(report.slow_down())
    assert "times slower" in lines[-1]
    assert report.explain("zh").splitlines()[-1] == report.slow_down().explain("zh")


def test_a_thousand_violations_do_not_make_a_thousand_lines():
    rows = MODEL.home + 0.01 * np.random.default_rng(0).normal(size=(100, 7))
    report = check(Motion.from_cycles(rows), MODEL)
    lines = report.explain().splitlines()
    assert len(lines) < 12
    assert lines[-2] == f"- ... and {len(report.violations) + len(report.warnings) - 8} more."


def test_a_phrase_is_its_english_and_remembers_how_to_say_it_otherwise():
    phrase = Phrase("advice.speed_to", speed="0.50")
    assert phrase == "lower speed to 0.50 or less" == phrase.text("en")
    assert phrase.text("zh") == "将 speed 降到 0.50 或更低"


def test_a_language_that_nobody_speaks_here_is_refused():
    with pytest.raises(InvalidValueError, match="'de' is unknown; known: en, zh"):
        check(MOTION, MODEL).explain("de")  # type: ignore[arg-type]


def test_every_source_is_told_in_both_languages():
    tables = [condition_table(describe_robot(name)) for name in ROBOT_NAMES]
    for row in {row.source: row for table in tables for row in table.conditions}.values():
        assert explain_source(row) == row.source
        assert explain_source(row, "zh") != row.source
    own = replace(RCI_CONDITIONS.conditions[0], source="a page of somebody's own")
    assert explain_source(own, "zh") == own.source


def test_the_table_of_a_notebook_speaks_both_languages():
    broken = check(Motion.from_cycles(MOTION.q[::2]), MODEL)
    for report in (check(MOTION, MODEL), broken):
        english, chinese = report_html(report), report_html(report, "zh")
        assert english == report._repr_html_()
        assert english.count("<tr>") == chinese.count("<tr>") == len(report.rows) + 1
        words = set(re.findall(r"[a-z]{4,}", re.sub(r"<[^>]*>|^.*?<br>.*?<table>", "", chinese)))
        assert not words & {"commanded", "joint", "manual", "recommended", "condition", "exceeds", "bound", "source"}
