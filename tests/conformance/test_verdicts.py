"""Checks, monitors and the table's inequalities agree in every cycle, and blame exactly the sample that was spoiled.

Joint angles: `test_monitor.py` and `test_check.py`. Here are the safety box, tool poses, arm angles and torques.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.box_monitor import BoxMonitor
from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.check import HOLD_SAMPLES, check
from rcilab.conformance.common_conditions import TOOL_CONDITIONS, TORQUE_CONDITIONS
from rcilab.conformance.limit_violation import faults_of
from rcilab.conformance.torque_monitor import TorqueMonitor
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.safety_box import SafetyBox, box_for_start
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.conditions import RCI_CONDITIONS, RCI_TOOL_CONDITIONS, RCI_TORQUE_CONDITIONS
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits
ROWS = 60
COLUMNS = {"translation": 0, "rotation": 1, "arm_angle": 2}


def broken_cycles(values: Array, row: Condition) -> Array:
    """Cycles in which the table's inequality does not hold, for values of shape (N, columns)."""
    lower, upper = row.bounds(LIMITS)
    return ~((lower < values) & (values < upper)).all(axis=1)


def differences(values: Array) -> list[Array]:
    """Values and their first three backward differences; before the first row everything rested there."""
    tables = [values]
    for order in range(3):
        before = values[:1] if order == 0 else np.zeros_like(values[:1])
        tables.append(np.diff(np.concatenate((before, tables[-1])), axis=0) / CYCLE_TIME)
    return tables


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.integers(0, 2))
def test_the_box_is_judged_alike_by_check_and_monitor(seed, spoils):
    rng = np.random.default_rng(seed)
    q = plan_joint(MODEL, MODEL.home, MODEL.home + rng.uniform(-0.5, 0.5, 7), speed=1.0).q.copy()
    for _ in range(spoils):
        q[rng.integers(len(q)), rng.integers(7)] += rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-4.0, 0.0)
    T_base_box = MODEL.forward(q[0]) @ Pose.from_rpy(rng.uniform(-0.1, 0.1, 3), rng.uniform(-3.0, 3.0, 3))
    box = SafetyBox(size=tuple(rng.uniform(0.05, 0.6, 3)), T_base_box=T_base_box)
    monitor = BoxMonitor(box_for_start(box, MODEL.forward(q[0]).parts[1]), RCI_CONDITIONS.box)
    rows = [*q, *[q[-1]] * HOLD_SAMPLES]
    played = [bool(monitor.step(MODEL.forward(row).parts[1])) for row in rows]
    expected = np.zeros(len(rows), dtype=bool)
    for violation in check(Motion.from_cycles(q), MODEL, box=box, distance=None).violations:
        if violation.condition is RCI_CONDITIONS.box:
            first = round(violation.time / CYCLE_TIME)
            expected[first : first + violation.count] = True
    assert played == expected.tolist()


@st.composite
def tool_rows(draw):
    """Way along a line, turn about an axis and arm angle, smooth or shaken, one of them just past or short of a bound.

    Returned with the directions of way and turn.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    times = np.arange(ROWS)[:, np.newaxis] * CYCLE_TIME
    smooth = rng.uniform(-0.3, 0.3, 3) * times + rng.uniform(-1.0, 1.0, 3) * times**2
    noise = rng.normal(size=(ROWS, 3)) * 10.0 ** rng.uniform(-10.0, -2.0, 3)
    direction, axis = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
    rows = smooth + noise * draw(st.sampled_from([0.0, 1.0]))
    row = draw(st.sampled_from([row for row in TOOL_CONDITIONS if row.signal in COLUMNS and row.order > 0]))
    column = COLUMNS[row.signal]
    reach = np.abs(differences(rows)[row.order][:, column]).max() / row.bounds(LIMITS)[1][0]
    rows[:, column] *= (1.0 + draw(st.sampled_from([1.0, -1.0])) * 10.0 ** draw(st.floats(-6.0, -2.0))) / reach
    return rows - rows[0], direction, axis


def played(rows: Array, direction: Array, axis: Array) -> dict[str, list[int]]:
    """Cycles that a monitor finds broken, by condition, when it comes from rest at the first row."""
    monitor = CartesianMonitor(LIMITS, rows=RCI_TOOL_CONDITIONS)
    found: dict[str, list[int]] = {}
    for cycle, (way, angle, psi) in enumerate(rows.tolist()):
        pose = Pose(way * direction, [np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)])
        if cycle == 0:
            monitor.reset(pose, psi)
        faults = faults_of(monitor.step(pose, psi))
        violations = monitor.violations()
        assert set(faults) == {violation.condition.fault for violation in violations}
        for violation in violations:
            found.setdefault(violation.condition.id, []).append(cycle)
    return found


@settings(max_examples=60)
@given(tool_rows())
def test_every_row_on_tool_poses_is_judged_as_its_inequality_says(case):
    rows, direction, axis = case
    found = played(rows, direction, axis)
    tables = differences(rows)
    for row in TOOL_CONDITIONS:
        if row.signal in COLUMNS:
            values = tables[row.order][:, [COLUMNS[row.signal]]]
            expected = np.flatnonzero(broken_cycles(values, row))
            assert found.get(row.id, []) == expected.tolist(), row.id


@settings(max_examples=60)
@given(
    st.integers(0, 2**32),
    st.integers(1, ROWS - 5),
    st.sampled_from(sorted(COLUMNS)),
    st.floats(5e-5, 2e-4),
)
def test_a_spoiled_tool_sample_is_blamed_in_exactly_its_differences(seed, row, name, shift):
    rng = np.random.default_rng(seed)
    times = np.arange(ROWS)[:, np.newaxis] * CYCLE_TIME
    rows = 0.5 * rng.uniform(-1.0, 1.0, 3) * times**2  # From rest, far from every bound.
    axes = np.eye(3)[0], np.eye(3)[2]
    assert played(rows, *axes) == {}
    rows[row, COLUMNS[name]] += shift
    found = played(rows, *axes)
    kinds = {"arm_angle": ("arm_angle.acceleration", "arm_angle.jerk")}.get(
        name, (f"cartesian.acceleration.{name}", f"cartesian.jerk.{name}")
    )
    assert set(found) == set(kinds)
    assert found[kinds[0]] == [row, row + 1, row + 2]
    assert found[kinds[1]] == [row, row + 1, row + 2, row + 3]


def torque_violations(tau: Array) -> dict[str, set[tuple[int, int]]]:
    """Cycles and joints that a monitor finds broken, by condition, when the first row has lasted for a while."""
    monitor = TorqueMonitor(LIMITS.joint, RCI_TORQUE_CONDITIONS)
    monitor.reset(tau[0].tolist())
    found: dict[str, set[tuple[int, int]]] = {row.id: set() for row in TORQUE_CONDITIONS}
    for cycle, row in enumerate(tau.tolist()):
        faults = faults_of(monitor.step(row))
        violations = monitor.violations()
        assert set(faults) == {violation.condition.fault for violation in violations}
        for violation in violations:
            found[violation.condition.id].add((cycle, violation.axis))
    return found


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.integers(1, ROWS - 2), st.integers(0, 6), st.sampled_from([1.0, -1.0]))
def test_a_spoiled_torque_is_blamed_in_its_joint_and_in_exactly_its_two_differences(seed, row, joint, sign):
    rng = np.random.default_rng(seed)
    times = np.arange(ROWS)[:, np.newaxis] * CYCLE_TIME
    bounds = LIMITS.joint
    tau = 0.3 * bounds.torque * np.sin(rng.uniform(-3.0, 3.0, 7) + times * 0.5 * bounds.torque_rate / bounds.torque)
    assert torque_violations(tau) == {"torque.rate": set(), "torque.range": set()}
    step = rng.uniform(1.3, 500.0) * bounds.torque_rate[joint] * CYCLE_TIME
    tau[row, joint] += sign * step
    found = torque_violations(tau)
    assert found["torque.rate"] == {(row, joint + 1), (row + 1, joint + 1)}
    outside = abs(tau[row, joint]) >= bounds.torque[joint]
    assert found["torque.range"] == ({(row, joint + 1)} if outside else set())


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.floats(-2.0, 2.0))
def test_both_rows_on_torques_are_judged_as_their_inequalities_say(seed, scale):
    rng = np.random.default_rng(seed)
    tau = np.cumsum(rng.normal(scale=10.0**scale, size=(ROWS, 7)), axis=0)
    found = torque_violations(tau)
    for row in TORQUE_CONDITIONS:
        values = differences(tau)[row.order]
        lower, upper = row.bounds(LIMITS.joint)
        cycles, joints = np.nonzero(~((lower < values) & (values < upper)))
        assert found[row.id] == set(zip(cycles.tolist(), (joints + 1).tolist(), strict=True))
