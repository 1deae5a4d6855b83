"""Motions judged as tool poses and as torques: by `check` at once, by `Monitor` cycle by cycle, and both the same."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.conformance.common_conditions import condition_table
from rcilab.conformance.free_elbow import leaves_elbow_free
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.limit_violation import faults_of
from rcilab.conformance.motion_monitor import Monitor
from rcilab.conformance.report import Violation
from rcilab.conformance.signals import HOLD_SAMPLES, MotionSignals
from rcilab.conformance.start import StartState
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.errors import CertificateError, InvalidValueError, ModelError, PlanningError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.core.state import MODES, Mode
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, plan_arc, plan_circle, plan_joint, plan_line
from tests.arms import REPRESENTATIVE

MODELS = {name: load_model(name) for name in REPRESENTATIVE}
MODEL, PANDA = MODELS["xMatePro7"], MODELS["Panda"]
FRANKA = ("FR3", "Panda")
NEAR = 1e-4
"""Share of a range around a bound in which check and monitor may disagree: a third difference over 1 ms makes 1e-3
rad/s^3 of the 1e-12 rad to which the inverse is settled."""
names = st.sampled_from(sorted(MODELS))
takes_poses = names.filter(lambda name: "cartesian_position" in condition_table(MODELS[name].description).modes)
seeds = st.integers(0, 2**32)


@lru_cache(maxsize=64)
def line(model: RobotModel, seed: int, reach: float = 0.08) -> Motion:
    """A line with a turn, away from home by chance; from home, where no arm is near a singularity."""
    rng = np.random.default_rng(seed)
    T = model.forward(model.home)
    turn = Pose.from_rpy(np.zeros(3), rng.uniform(-0.2, 0.2, 3))
    goal = Pose(T.position + rng.uniform(-reach, reach, 3), (T @ turn).wxyz)
    return plan_line(model, model.home, goal, speed=0.6)


def as_state(start: StartState | Array) -> StartState:
    return start if isinstance(start, StartState) else StartState(start, np.zeros(len(start)), np.zeros(len(start)))


def commands(model: RobotModel, rows: Array, mode: Mode, start: StartState, last: int | None = None) -> list[Command]:
    """The commands that would make an arm follow some rows, the hold included; the last row's says so."""
    path = [*rows, *[rows[-1]] * HOLD_SAMPLES]
    last = len(rows) - 1 if last is None else last
    if mode == "torque":
        signals = MotionSignals(Motion.from_cycles(rows), model, start, None, None, mode)
        tau, _ = signals.table(condition_table(model.description).find("torque.range"))
        return [JointTorque(row, i == last) for i, row in enumerate(tau)]
    if mode.startswith("joint"):
        return [JointPosition(q, i == last) for i, q in enumerate(path)]
    poses = [(model.forward(q).matrix, model.arm_angle(q) if model.n == 7 else None) for q in path]
    return [CartesianPosition(T, psi, i == last) for i, (T, psi) in enumerate(poses)]


def played(
    model: RobotModel, rows: Array, mode: Mode, start: StartState | Array, box: SafetyBox | None = None
) -> dict[str, set[tuple[int, int]]]:
    """Cycles and axes that a monitor finds broken, by condition."""
    monitor = Monitor(model, mode, box=box)
    monitor.reset(start)
    state = as_state(start)
    found: dict[str, set[tuple[int, int]]] = {}
    path = [*rows, *[rows[-1]] * HOLD_SAMPLES]
    sent = commands(model, rows, mode, state)
    before = state.q
    for cycle in range(int(state.moving), len(sent)):
        violations = monitor.step(sent[cycle])
        if mode == "torque":
            violations += monitor.observe(path[cycle], (path[cycle] - before) / CYCLE_TIME)
            before = path[cycle]
        for violation in violations:
            found.setdefault(violation.condition.id, set()).add((cycle, violation.axis))
    return found


def expected(model: RobotModel, rows: Array, mode: Mode, start: StartState | Array, box: SafetyBox | None = None):
    """What `check` finds broken, by condition, and the cycles in which a value is too near its bound to compare."""
    signals = MotionSignals(Motion.from_cycles(rows), model, as_state(start), box, None, mode)
    table = condition_table(model.description)
    broken: dict[str, set[tuple[int, int]]] = {}
    near: dict[str, set[tuple[int, int]]] = {}
    for row in table.rows(mode, has_elbow=model.n == 7, has_box=box is not None):
        values, _ = signals.table(row)
        lower, upper = row.bounds(model.limits)
        if row.bounds_at is not None and row.depends_on_angles(model.limits.joint):
            lower, upper = row.bounds_at(model.limits.joint, signals.angles_before())
        width = np.where(np.isfinite(lower) & np.isfinite(upper), upper - lower, 1e-3)
        close = np.minimum(np.abs(values - lower), np.abs(values - upper)) < NEAR * width
        places = (np.argwhere(mask).tolist() for mask in (~((lower < values) & (values < upper)), close))
        # A velocity at the start is judged with the second command, an acceleration with the third.
        first = {"throughout": 0, "start": row.order, "end": len(rows) - 1}[row.stage]
        broken[row.id], near[row.id] = (
            {(first + c, axis + 1 if row.is_per_joint else 0) for c, axis in p} for p in places
        )
    return broken, near


def from_violations(violations: Sequence[Violation]) -> dict[str, set[tuple[int, int]]]:
    found: dict[str, set[tuple[int, int]]] = {}
    for violation in violations:
        first = round(violation.time / CYCLE_TIME)
        cycles = {(cycle, violation.joint) for cycle in range(first, first + violation.count)}
        found.setdefault(violation.condition.id, set()).update(cycles)
    return found


def spoiled(model: RobotModel, seed: int) -> Array:
    """A line with one to three samples, steps or ramps put on top, of any size that matters."""
    rng = np.random.default_rng(seed)
    rows = line(model, int(rng.integers(3)), 0.02).q[: rng.integers(20, 90)].copy()
    for _ in range(rng.integers(1, 4)):
        row = int(rng.integers(0, len(rows)))
        joint = (
            2 if rng.random() < 0.3 else int(rng.integers(0, model.n))
        )  # At home the elbow moves with joint 3 alone.
        size = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-7.0, -1.2)
        if rng.random() < 0.5:
            rows[row, joint] += size
        else:
            rows[row:, joint] += size * (1.0 if rng.random() < 0.5 else np.arange(len(rows) - row) / 10.0)
    return rows


def require_same(model: RobotModel, mode: Mode, rows: Array, start: StartState | Array, box: SafetyBox | None):
    found = played(model, rows, mode, start, box)
    broken, near = expected(model, rows, mode, start, box)
    skipped = int(as_state(start).moving)
    judged = set(broken) | {name for name in found if not name.startswith("measured.") or name in broken}
    for name in judged:
        here = {place for place in broken.get(name, set()) if place[0] >= skipped} - near.get(name, set())
        assert found.get(name, set()) - near.get(name, set()) == here, (model.name, mode, name)


def require_mode_of(name: str, mode: Mode) -> RobotModel:
    """Returns an arm; skips a mode for which its interface has no conditions."""
    model = MODELS[name]
    if mode not in condition_table(model.description).modes:
        pytest.skip("the interface has no such mode")
    return model


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("mode", MODES)
@settings(max_examples=6)
@given(seeds, st.booleans())
def test_monitor_and_check_give_the_same_verdict_row_by_row_in_every_mode(name, mode, seed, boxed):
    model = require_mode_of(name, mode)
    rows = spoiled(model, seed)
    box = SafetyBox(size=(0.02, 0.02, 0.05), T_base_box=model.forward(model.home)) if boxed else None
    require_same(model, mode, rows, rows[0], box)
    broken, _ = expected(model, rows, mode, rows[0], box)
    if leaves_elbow_free(model, mode):  # The monitor was given the elbow, which a session does not send.
        return
    report = check(Motion.from_cycles(rows), model, box=box, distance=None, mode=mode)
    necessary = {row.id for row in condition_table(model.description).conditions if row.necessity == "necessary"}
    assert from_violations(report.violations) == {
        name: places for name, places in broken.items() if places and name in necessary
    }


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position", "torque"])
@settings(max_examples=3)
@given(seeds)
def test_they_agree_from_a_moving_start_and_from_one_elsewhere(name, mode, seed):
    model = require_mode_of(name, mode)
    rows = spoiled(model, seed)
    rng = np.random.default_rng(seed)
    moving = StartState(rows[0], rng.uniform(-0.2, 0.2, model.n), rng.uniform(-3.0, 3.0, model.n))
    require_same(model, mode, rows, moving, None)
    require_same(model, mode, rows, rows[0] + 10.0 ** rng.uniform(-10.0, -4.0) * rng.normal(size=model.n), None)


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("way", [-1.0, 1.0])
@pytest.mark.parametrize("joint", range(7))
def test_they_agree_where_a_joint_leaves_its_range_turns_the_elbow_or_meets_a_singularity(name, joint, way):
    model = MODELS[name]
    if joint == model.n:
        return
    limits = model.limits.joint
    far = (limits.upper if way > 0.0 else limits.lower)[joint] - model.home[joint]
    count = 20 + int(abs(far) / 0.03)  # Steps that do not leap over what counts as singular.
    rows = np.repeat(model.home[np.newaxis], count, axis=0)
    rows[:, joint] += np.linspace(0.0, far + way * 0.04, count)
    broken, near = expected(model, rows, "cartesian_position", rows[0])
    frame = sorted(cycle for cycle, _ in broken["cartesian.frame"])
    lost = frame[0] if frame else len(rows) + HOLD_SAMPLES
    monitor = Monitor(model, "cartesian_position")
    sent = commands(model, rows[: lost + 1], "cartesian_position", as_state(rows[0]), last=len(rows) - 1)
    for cycle, command in enumerate(sent):
        if cycle > lost:
            break
        q = rows[min(cycle, len(rows) - 1)]
        side = model.elbow(q)[1] if name in FRANKA else None
        found = {(violation.condition.id, violation.axis) for violation in monitor.step(command, side=side)}
        wanted = {(row, axis) for row, places in broken.items() for at, axis in places if at == cycle}
        close = {(row, axis) for row, places in near.items() for at, axis in places if at == cycle}
        assert found - close == wanted - close, cycle
    if not frame:
        assert broken["inverse.joint.position" if name in FRANKA else "joint.position"]


SPOILS = {  # What is displaced, by how much; the highest difference that must notice, and its name.
    "translation": (3e-5, "cartesian.{}.translation"),
    "rotation": (1e-4, "cartesian.{}.rotation"),
    "elbow": (5e-5, "arm_angle.{}"),
}


@settings(max_examples=30)
@given(takes_poses.filter(lambda name: name != "FR3"), st.sampled_from(sorted(SPOILS)), seeds, st.integers(8, 60))
def test_a_spoiled_pose_is_flagged_in_exactly_its_differences(name, what, seed, place):
    model = MODELS[name]
    if what == "elbow" and model.n == 6:
        return
    rng = np.random.default_rng(seed)
    still = np.repeat(model.home[np.newaxis], 70, axis=0)
    T, psi = model.forward(model.home), model.arm_angle(model.home) if model.n == 7 else None
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    size, row = SPOILS[what]
    if what == "translation":
        size = max(size, 1.2 * model.limits.cartesian.translation_acceleration * CYCLE_TIME**2)
        spoiled_pose = Pose(T.position + size * axis, T.wxyz)
    elif what == "rotation":
        spoiled_pose = T @ Pose.from_rpy(np.zeros(3), size * axis)
    else:
        spoiled_pose, psi = T, psi + size
    rows = still.copy()
    rows[place] = model.inverse(spoiled_pose, psi, model.home).nearest(model.home)
    if what == "elbow" and name in FRANKA:
        row = "elbow.{}"
    report = check(Motion.from_cycles(rows), model, distance=None, mode="cartesian_position")
    found = from_violations((*report.violations, *report.warnings))  # RealMan's controller has no error for a jerk.
    assert found[row.format("jerk")] == {(place + i, 0) for i in range(4)}
    assert found[row.format("acceleration")] == {(place + i, 0) for i in range(3)}
    touched = {cycle for places in found.values() for cycle, _ in places}
    assert touched == {place, place + 1, place + 2, place + 3}
    others = {"translation", "rotation", "arm_angle", "elbow"} - {row.split(".")[0], row.split(".")[-1]}
    assert not any(part in id_ for id_ in found for part in others if "joint" not in id_)


@settings(max_examples=25)
@given(takes_poses.filter(lambda name: name != "FR3"), st.integers(0, 3), seeds, st.integers(10, 40))
def test_a_joint_spoiled_in_position_velocity_acceleration_or_jerk_is_flagged_where_it_is(name, order, seed, place):
    model = MODELS[name]
    rng = np.random.default_rng(seed)
    joint = int(rng.integers(model.n))
    rows = np.repeat(model.home[np.newaxis], 60, axis=0)
    bound = {1: model.limits.joint.velocity, 2: model.limits.joint.acceleration, 3: model.limits.joint.jerk}
    prefix = "inverse." if name in FRANKA else ""
    kind = ("position", "velocity", "acceleration", "jerk")[order]
    if order == 0:
        rows[place, joint] = model.limits.joint.upper[joint] + 1e-3
    else:  # A polynomial that begins at the place: its difference of that order is constant, 1.1 times the bound.
        k = np.arange(60 - place) + 1.0
        binomial = {1: k, 2: k * (k + 1) / 2.0, 3: k * (k + 1) * (k + 2) / 6.0}[order]
        end = 3 if order == 3 else 1
        rows[place : place + end, joint] += 1.1 * bound[order][joint] * CYCLE_TIME**order * binomial[:end]
        rows[place + end :, joint] = rows[place + end - 1, joint]
    report = check(Motion.from_cycles(rows), model, distance=None, mode="cartesian_position")
    found = from_violations((*report.violations, *report.warnings))  # RealMan's controller has no error for a jerk.
    places = found[f"{prefix}joint.{kind}"]
    assert {axis for _, axis in places} == {joint + 1}
    assert min(cycle for cycle, _ in places) == place
    if order < 2:
        assert places == {(place + i, joint + 1) for i in range(2 if order and rows[-1, joint] == 0 else 1)}


TORQUE_FAULTS = {
    "rokae": Fault.COMMAND_TORQUE_DISCONTINUITY,
    "franka": FrankaError.CONTROLLER_TORQUE_DISCONTINUITY,
    "realman": None,
}


@settings(max_examples=20)
@given(names.filter(lambda name: MODELS[name].description.maker in TORQUE_FAULTS), seeds, st.integers(5, 50))
def test_a_spoiled_torque_is_flagged_in_exactly_its_two_differences(name, seed, place):
    model = MODELS[name]
    rng = np.random.default_rng(seed)
    joint = int(rng.integers(model.n))
    bound = model.limits.joint.torque_rate[joint] * CYCLE_TIME
    monitor = Monitor(model, "torque")
    found = []
    for cycle in range(60):
        tau = np.zeros(model.n)
        tau[joint] = rng.choice((-1.3, 1.3)) * bound if cycle == place else 0.0
        found += [(cycle, b.condition.id, b.axis, b.condition.fault) for b in monitor.step(JointTorque(tau))]
    fault = TORQUE_FAULTS[model.description.maker]
    assert found == [(cycle, "torque.rate", joint + 1, fault) for cycle in (place, place + 1)]


def test_a_plan_that_is_too_fast_for_torques_is_to_be_slower_for_nothing_was_measured():
    model = load_model("FR3")
    u = np.linspace(0.0, 1.0, 1001)[:, np.newaxis]
    way = np.eye(7)[0] * 2.4 * u**3 * (10.0 - 15.0 * u + 6.0 * u * u)  # Joint 1 reaches 4.5 rad/s.
    (violation,) = check(Motion.from_cycles(model.home + way), model, mode="torque").violations
    assert violation.condition.id == "measured.joint.velocity"
    assert "times slower" in str(violation)


def test_torques_are_necessary_in_torque_mode_and_recommended_for_positions():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3, speed=0.5)
    told, moved = check(motion, MODEL, mode="torque"), check(motion, MODEL)
    assert moved.ok
    assert {v.fault for v in told.violations} == {Fault.COMMAND_TORQUE_DISCONTINUITY}
    names = {row.id: row.necessity for row in told.rows}
    assert (names["torque.rate"], names["torque.range"]) == ("necessary", "necessary")
    panda = plan_joint(PANDA, PANDA.home, PANDA.home + 0.3, speed=0.5)
    names = {row.id: row.necessity for row in check(panda, PANDA, mode="torque").rows}
    assert (names["torque.rate"], names["torque.range"], names["start.torque"]) == (
        "necessary", "recommended", "recommended")  # fmt: skip


def test_a_slow_down_makes_a_motion_fit_the_tool_and_its_report_is_of_the_same_mode():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3, speed=0.5)
    report = check(motion, MODEL, mode="cartesian_position", distance=None)
    assert {v.fault for v in report.violations} == {
        Fault.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION,
        Fault.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION,
    }
    found = report.slow_down()
    assert found.factor == pytest.approx(1.64, abs=0.05)
    assert found.report.certificate.parts["mode"] == "cartesian_position"
    assert check(found.motion, MODEL, mode="cartesian_position").ok
    for language in ("en", "zh"):
        assert "kCommandCartesianVelocityLimitsViolation" in report.explain(language)


def test_a_hand_off_in_another_mode_is_refused_and_says_why():
    motion = line(MODEL, 1)
    certificate = check(motion, MODEL, mode="cartesian_position").require().certificate
    certificate.verify(motion, MODEL, MODEL.home, mode="cartesian_position")
    with pytest.raises(CertificateError, match="for the mode cartesian_position, not for the mode joint"):
        certificate.verify(motion, MODEL, MODEL.home)
    with pytest.raises(CertificateError, match="mode='torque'"):
        check(motion, MODEL).certificate.verify(motion, MODEL, MODEL.home, mode="torque")


def test_a_singular_pose_on_the_way_is_refused_in_cartesian_modes_only():
    folded = MODEL.home.copy()
    folded[3] = 0.3
    motion = plan_joint(MODEL, folded, folded - [0, 0, 0, 0.6, 0, 0, 0], speed=0.05)
    assert check(motion, MODEL, distance=None).ok
    report = check(motion, MODEL, distance=None, mode="cartesian_position")
    row = next(row for row in report.rows if row.id == "cartesian.frame")
    assert (row.ok, row.fault) == (False, Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME)
    singular = [v for v in report.violations if v.condition is row.condition]
    for violation in singular:
        q = motion.at(violation.time).q
        assert abs(np.sin(q[3])) < 0.0201
    assert "singular" in str(singular[0])
    assert report.slow_down().obstacle == "position"


def test_an_elbow_that_flips_is_refused_for_the_panda_where_it_flips():
    start = PANDA.home.copy()
    start[3] = -0.6
    motion = plan_joint(PANDA, start, start + [0, 0, 0, 0.3, 0, 0, 0], speed=0.1)
    report = check(motion, PANDA, distance=None, mode="cartesian_position")
    (violation,) = [v for v in report.violations if v.condition.id == "elbow.sign"]
    assert violation.fault is FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT
    flip = PANDA.description.elbow_flip
    cycle = round(violation.time / CYCLE_TIME)
    assert motion.q[cycle - 1, 3] <= flip < motion.q[cycle, 3]
    assert "elbow_sign_inconsistent" in report.explain()
    assert "翻转" in report.explain("zh")


@settings(max_examples=12)
@given(names, seeds, st.sampled_from(["line", "arc", "circle"]))
def test_planned_paths_keep_the_tools_limits(name, seed, kind):
    model = MODELS[name]
    rng = np.random.default_rng(seed)
    T = model.forward(model.home)
    via, goal = (Pose(T.position + rng.uniform(-0.1, 0.1, 3), T.wxyz) for _ in range(2))
    try:
        if kind == "line":
            motion = line(model, seed, 0.15)
        elif kind == "arc":
            motion = plan_arc(model, model.home, via, goal)
        else:
            motion = plan_circle(model, model.home, through=(via, goal))
    except PlanningError:
        return
    if "cartesian_position" not in condition_table(model.description).modes:
        assert check(motion, model, distance=None).ok
        return
    report = check(motion, model, distance=None, mode="cartesian_position")
    assert {v.condition.id for v in report.violations} <= {"cartesian.frame"}, report
    assert report.ok == report.rows[0].ok


def test_a_six_axis_arm_has_no_rows_on_an_arm_angle():
    six = MODELS["xMate3"]
    report = check(line(six, 3), six, distance=None, mode="cartesian_position")
    assert report.ok
    assert not any(row.condition.signal == "arm_angle" for row in report.rows)


def test_an_unknown_mode_and_a_command_of_another_kind_are_refused_in_words():
    motion = line(MODEL, 2)
    with pytest.raises(InvalidValueError, match="'cartesian' is unknown; known: joint_position, joint_impedance"):
        check(motion, MODEL, mode="cartesian")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="must be a CartesianPosition in the mode cartesian_position"):
        Monitor(MODEL, "cartesian_position").step(JointPosition(MODEL.home))
    with pytest.raises(InvalidValueError, match="must be 7 numbers"):
        Monitor(MODEL).step(JointPosition(MODEL.home[:6]))


@pytest.mark.parametrize("spoil", ["reflection", "nan", "stretched", "far"])
@pytest.mark.parametrize("name", sorted(MODELS))
def test_what_is_no_pose_or_out_of_reach_breaks_the_frame(name, spoil):
    model = MODELS[name]
    monitor = Monitor(model, "cartesian_position")
    T = model.forward(model.home).matrix
    assert monitor.step(CartesianPosition(T.copy())) == ()
    if spoil == "reflection":
        T[:3, 0] *= -1.0
    elif spoil == "nan":
        T[0, 3] = np.nan
    elif spoil == "stretched":
        T[:3, :3] *= 1.1
    else:
        T[0, 3] += 5.0
    frames = [violation for violation in monitor.step(CartesianPosition(T)) if violation.condition.signal == "frame"]
    assert len(frames) == 1
    assert "improper" in frames[0].text


def test_a_joint_monitor_of_a_panda_speaks_its_makers_names():
    monitor = Monitor(PANDA)
    found = monitor.step(JointPosition(PANDA.home + 1e-3))
    assert {violation.condition.fault for violation in found if violation.condition.necessity == "necessary"} == {
        FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
        FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY,
        FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY,
    }
    assert {violation.condition.id for violation in found if violation.condition.fault is None} == {
        "joint.torque", "joint.torque_rate"}  # fmt: skip
    assert faults_of(found) == (
        FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID,
        FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY,
        FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY,
    )


@pytest.mark.parametrize("name", sorted(MODELS))
def test_a_monitor_raises_the_faults_of_the_table_that_it_is_given(name):
    model = MODELS[name]
    table = condition_table(model.description)
    rows = [row for row in table.motion if row.stage == "throughout" and row.signal == "joint"]
    monitor = JointMonitor(model.limits.joint, rows)
    monitor.reset(model.home.tolist())
    found = monitor.step((model.home + 9.0).tolist())
    assert found == monitor.violations()
    assert faults_of(found) == tuple(sorted({row.fault for row in rows if row.fault is not None}))
    assert {type(fault) for fault in faults_of(found)} == {model.description.faults}
    common = JointMonitor(model.limits.joint)
    common.reset(model.home.tolist())
    assert [violation.condition.id for violation in common.step((model.home + 9.0).tolist())] == [
        violation.condition.id for violation in found
    ]
    assert faults_of(common.violations()) == ()


@pytest.mark.parametrize("name", sorted(MODELS))
@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position"])
def test_rest_is_asked_for_at_both_ends_and_nowhere_else(name, mode):
    model = require_mode_of(name, mode)
    whole = line(model, 1, 0.02).q
    monitor = Monitor(model, mode)
    part = len(whole) // 4
    for rows, wanted in ((whole, set()), (whole[part : 2 * part], {"start", "end"}), (whole[part:], {"start"})):
        monitor.reset(rows[0])
        found = [b for c in commands(model, rows, mode, as_state(rows[0])) for b in monitor.step(c)]
        assert {b.condition.stage for b in found} - {"throughout"} == wanted
        report = check(Motion.from_cycles(rows), model, distance=None, mode=mode)
        assert {v.condition.stage for v in report.warnings} - {"throughout"} == wanted


@pytest.mark.parametrize("name", ["RM75", "xArm6"])
@pytest.mark.parametrize("mode", ["torque", "cartesian_position"])
def test_a_mode_that_the_controller_has_not_is_refused(name, mode):
    model = load_model(name)
    motion = plan_joint(model, model.home, model.home + 0.05, speed=0.3)
    word = mode.replace("_", " ")
    with pytest.raises(ModelError, match=f"the controller of {name} has no {word} mode; its modes: joint position$"):
        check(motion, model, mode=mode)
