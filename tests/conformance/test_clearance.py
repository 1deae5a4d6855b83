"""Distances along whole motions: judged as if every cycle had been looked at, and as a monitor judges each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.cell.clearance_path import MAX_STEP, MAX_TRAVEL, clearance_path, sample_cycle
from rcilab.conformance.check import HOLD_SAMPLES, check
from rcilab.conformance.clearance_conditions import clearance_conditions
from rcilab.conformance.clearance_monitor import ClearanceMonitor
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.core.clearance import FLOOR, ClearanceLimit, LinkPair
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_JOINT_CONDITIONS
from rcilab.model.kinematics.collision import ClearanceQuery
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint
from tests.arms import REPRESENTATIVE

MODELS = [load_model(name, tool=Pose((0.0, 0.02, 0.1))) for name in REPRESENTATIVE]
MODEL = MODELS[REPRESENTATIVE.index("xMatePro7")]
ASKED = ClearanceLimit(tool_radius=0.02, floor=0.01)
ON_THE_FLOOR = np.array([0.0, 2.0, 0.0, 0.3, 0.0, 0.2, 0.0])


def low_motion(model, seed: int, speed: float = 1.0, part: float = 0.3) -> Motion:
    """A motion somewhere in the joints' ranges whose middle is close to a bound more often than not."""
    rng = np.random.default_rng(seed)
    limits = model.limits.joint
    rim = 0.02 * (limits.upper - limits.lower)
    table = rng.uniform(limits.lower + rim, limits.upper - rim, (60, model.n))
    near = np.abs(model.clearance(table, ASKED).distance - 0.01).argmin()
    way = part * (rng.uniform(limits.lower + rim, limits.upper - rim) - table[near])
    ends = np.clip([table[near] - way / 2.0, table[near] + way / 2.0], limits.lower + rim, limits.upper - rim)
    return plan_joint(model, *ends, speed=speed)


def looked_at(q, levers) -> list[np.ndarray]:
    """The places that each cycle is judged by, its end the last."""
    return [sample_cycle(before, after, levers) for before, after in zip([q[0], *q[:-1]], q, strict=True)]


def cycles_of(report, id_: str, rows: int):
    flags = np.zeros(rows, dtype=bool)
    for violation in (*report.violations, *report.warnings):
        if violation.condition.id == id_:
            first = round(violation.time / CYCLE_TIME)
            flags[first : first + violation.count] = True
    return flags.tolist()


@settings(max_examples=10)
@given(st.sampled_from(MODELS), st.integers(0, 2**32), st.floats(0.2, 1.0))
def test_every_cycle_is_judged_by_its_own_distance_although_few_are_looked_at(model, seed, speed):
    q = low_motion(model, seed, speed).q
    geometry = model.collision_geometry(ASKED)
    query = ClearanceQuery(geometry)
    bounds = [0.0, 0.01, 0.02]
    for ask in (query.links, query.floor):
        smallest = [min(map(ask, places)) for places in looked_at(q, geometry.levers)]
        exact = np.array([distance for distance, _ in smallest])
        found = clearance_path(ask, q, q[0], geometry.levers, bounds)
        for bound in bounds:
            assert ((found.distance > bound) == (exact > bound)).all()
        assert exact.min() <= found.distance.min() <= exact.min() + MAX_TRAVEL / 2.0 + 1e-6
        worst = int(found.distance.argmin())
        assert found.distance[worst] == exact[worst]
        assert LinkPair(*found.links[worst].tolist()) == smallest[worst][1]


@settings(max_examples=10)
@given(st.sampled_from(MODELS), st.integers(0, 2**32))
def test_between_two_looks_no_point_moves_5_mm_or_as_far_as_the_room_that_was_found(model, seed):
    q = low_motion(model, seed, part=0.6).q
    geometry = model.collision_geometry(ASKED)
    query = ClearanceQuery(geometry)
    looks: list[tuple[bytes, float]] = []

    def spy(row):
        found = query.links(row)
        looks.append((row.tobytes(), found[0]))
        return found

    smallest = clearance_path(spy, q, q[0], geometry.levers, [0.02]).distance.min()
    rows = np.concatenate(looked_at(q, geometry.levers))
    places = {row.tobytes(): index for index, row in enumerate(rows)}
    order = sorted((places[row], distance) for row, distance in looks)
    assert (order[0][0], order[-1][0]) == (0, len(rows) - 1)
    tip = np.linalg.norm(np.diff(model.position_path(rows), axis=0), axis=1)
    assert tip.max() <= MAX_TRAVEL
    for (a, before), (b, _) in pairwise(order):
        assert tip[a:b].sum() <= max(MAX_TRAVEL, before - 0.02) + 1e-9
    fine = np.linspace(rows[:-1], rows[1:], 4)[:-1].transpose(1, 0, 2).reshape(-1, model.n)  # Three times as dense.
    dense = [query.links(row)[0] for row in fine[:: max(1, len(fine) // 300)]]
    assert min(dense) >= smallest - MAX_TRAVEL


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.integers(1, 400), st.floats(-5.0, -2.0))
def test_any_distance_that_changes_no_faster_than_the_arm_moves_is_judged_in_every_row(seed, count, size):
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.normal(size=(count, 2)) * 10.0**size, axis=0)
    levers = rng.uniform(0.1, 1.0, 2)
    walls = rng.uniform(-0.05, 0.05, 4)

    def distance(row):
        return float(np.abs(row @ levers - walls).min() - 0.004), LinkPair(0, FLOOR)

    bound = float(rng.uniform(-0.004, 0.01))
    found = clearance_path(distance, q, q[0], levers, [bound])
    exact = np.array([min(distance(row)[0] for row in places) for places in looked_at(q, levers)])
    assert ((found.distance > bound) == (exact > bound)).all()


def test_a_cycle_that_goes_far_is_looked_at_on_the_way_and_one_that_no_arm_can_go_only_at_its_end():
    levers = np.array([1.0, 0.5])
    start = np.array([0.3, 0.1])
    for travel, places in ((0.0, 1), (4e-3, 1), (6e-3, 2), (19e-3, 4), (21e-3, 1), (3.0, 1)):
        end = start + [travel / 2.0, travel]
        rows = sample_cycle(start, end, levers)
        assert len(rows) == places
        assert rows[-1].tolist() == end.tolist()
        assert np.abs(np.diff(np.vstack((start, rows)), axis=0) - (end - start) / places).max() < 1e-15
    for model in MODELS:  # Nothing that the joints' velocity limits allow is beyond it.
        levers = model.collision_geometry(ASKED).levers
        assert levers @ model.limits.joint.velocity * CYCLE_TIME < MAX_STEP


@settings(max_examples=15)
@given(st.sampled_from(MODELS), st.integers(0, 2**32), st.integers(0, 2))
def test_check_and_monitors_give_the_same_verdict_in_every_cycle(model, seed, spoils):
    rng = np.random.default_rng(seed)
    q = low_motion(model, seed, part=0.1).q.copy()
    for _ in range(spoils):
        q[rng.integers(len(q)), rng.integers(model.n)] += rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-4.0, 0.0)
    joints, monitor = JointMonitor(model.limits.joint, RCI_JOINT_CONDITIONS), ClearanceMonitor(model, ASKED)
    joints.reset(q[0].tolist())
    monitor.reset(q[0].tolist())
    report = check(Motion.from_cycles(q), model, distance=ASKED)
    played: dict[str, list[bool]] = {row.id: [] for row in clearance_conditions(ASKED)}
    kept, necessary = (
        True,
        {row.id for row in model.description.conditions().conditions if row.necessity == "necessary"},
    )
    for row in [*q, *[q[-1]] * HOLD_SAMPLES]:
        kept &= not any(violation.condition.id in necessary for violation in joints.step(row.tolist()))
        kept &= monitor.step(row.tolist())
        broken = {violation.condition.id for violation in monitor.violations()}
        for id_, flags in played.items():
            flags.append(id_ in broken)
    for row in report.rows:
        if row.id in played and row.necessity == "necessary":
            assert cycles_of(report, row.id, len(played[row.id])) == played[row.id]
        if row.id in played:
            assert row.broken == sum(played[row.id])
    monitored = {row.id for row in (*RCI_JOINT_CONDITIONS, *clearance_conditions(ASKED))}  # Not the tool's speed.
    assert any(violation.condition.id in monitored for violation in report.violations) != kept


@settings(max_examples=30)
@given(st.integers(5, 150), st.floats(-2.9, 2.9))
def test_exactly_the_spoiled_sample_is_flagged(row, turn):
    q = np.repeat(MODEL.home[np.newaxis], 160, axis=0)
    q[row] = ON_THE_FLOOR + [turn, 0, 0, 0, 0, 0, 0]
    report = check(Motion.from_cycles(q), MODEL)
    found = [violation for violation in report.violations if violation.condition.is_clearance]
    assert [(v.condition.id, v.count, v.links) for v in found] == [("clearance.floor", 1, LinkPair(7, FLOOR))]
    assert found[0].time == pytest.approx(row * CYCLE_TIME)
    assert found[0].value == MODEL.clearance(q[row]).distance


def test_a_motion_into_the_floor_is_refused_with_links_time_and_depth_in_both_languages():
    motion = plan_joint(MODEL, MODEL.home, ON_THE_FLOOR)
    report = check(motion, MODEL)
    depth = -float(MODEL.clearance(ON_THE_FLOOR).distance)
    [violation] = report.violations
    assert (report.ok, report.certificate, violation.fault, violation.links) == (False, None, None, LinkPair(7, FLOOR))
    first = int(np.flatnonzero(MODEL.clearance(motion.q).distance <= 0.0)[0])
    assert violation.time == pytest.approx(first * CYCLE_TIME)
    assert str(violation).startswith(f"link 7 and floor: distance from the floor {-depth:.4g} m, they overlap")
    assert "the robot would not notice before it hits" in str(report)
    assert "link 7 and floor" in report._repr_html_()
    english, chinese = report.explain("en"), report.explain("zh")
    for text in (english, chinese):
        assert f"{depth:.4g} m" in text
        assert f"t = {violation.time:.3f} s" in text
    assert f"link 7 and floor overlap by {depth:.4g} m" in english
    assert "although the robot would accept it" in english
    assert f"连杆 7 与 地面重叠 {depth:.4g} m" in chinese
    assert report.slow_down().obstacle == "position"


def test_a_hand_in_the_base_is_refused_and_the_report_says_who_meets_whom():
    folded = load_model("xMate7")
    limits = folded.limits.joint
    table = np.random.default_rng(0).uniform(limits.lower, limits.upper, (4000, 6))
    found = folded.clearance(table, ClearanceLimit(floor_height=None))
    worst = int(found.distance.argmin())
    motion = Motion.from_cycles(np.repeat(table[worst : worst + 1], 5, axis=0))
    report = check(motion, folded, distance=ClearanceLimit(floor_height=None))
    [violation] = report.violations
    assert violation.condition.id == "clearance.links"
    assert violation.value == found.distance[worst] < -0.05
    assert violation.links is not None
    assert violation.links[:2] == tuple(found.links[worst])
    assert {row.id for row in report.rows if row.condition.is_clearance} == {
        "clearance.links",
        "clearance.links.advised",
    }


def test_what_comes_near_is_advice_and_what_is_asked_for_is_a_bound():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
    nearest = float(MODEL.clearance(motion.q).distance.min())
    near = check(motion, MODEL, distance=ClearanceLimit(advised=nearest + 0.01))
    assert near.ok
    assert "clearance.links.advised" in {violation.condition.id for violation in near.warnings}
    refused = check(motion, MODEL, distance=ClearanceLimit(links=nearest))
    assert [v.condition.id for v in refused.violations] == ["clearance.links"]
    kept = check(motion, MODEL, distance=ClearanceLimit(links=nearest - 1e-6))
    row = next(row for row in kept.rows if row.id == "clearance.links")
    assert (kept.ok, row.location, row.value) == (True, "base and link 2", pytest.approx(nearest, abs=MAX_TRAVEL / 2.0))
    assert "clearance.links.advised" not in {row.id for row in kept.rows}  # What is asked for is more than that.


def test_without_a_distance_nothing_is_looked_for():
    report = check(plan_joint(MODEL, MODEL.home, ON_THE_FLOOR), MODEL, distance=None)
    assert report.ok
    assert not [row for row in report.rows if row.condition.is_clearance]
    with pytest.raises(InvalidValueError, match=r"distance: 0\.02 is not a ClearanceLimit"):
        check(plan_joint(MODEL, MODEL.home, MODEL.home), MODEL, distance=0.02)


def test_a_monitor_tells_distance_and_links_and_refuses_what_is_no_configuration():
    monitor = ClearanceMonitor(MODEL)
    assert monitor.step(MODEL.home.tolist())
    assert monitor.distance == MODEL.clearance(MODEL.home).distance
    assert monitor.violations() == []
    assert not monitor.step(ON_THE_FLOOR.tolist())
    assert monitor.links == LinkPair(7, FLOOR)
    assert monitor.violations()[0].text.startswith("link 7 and floor: distance from the floor -0.")
    with pytest.raises(InvalidValueError, match="q_c"):
        monitor.step([float("nan")] * 7)
