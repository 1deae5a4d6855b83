"""Cost of planning and checking: the calls that run at every drag of the target."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rcilab.cell.clearance_path import clearance_path
from rcilab.conformance.check import check
from rcilab.core.arrays import Array
from rcilab.core.clearance import ADVISED_DISTANCE
from rcilab.core.errors import UnreachableError
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.fastest import fastest_straight, slowest_alone
from rcilab.diagnostics.bench.measure import Measurement, cost_by_length, summarise, time_calls
from rcilab.model.kinematics.collision import ClearanceQuery
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion.joint import plan_joint
from rcilab.motion.motion import Motion
from rcilab.motion.online import Jog
from rcilab.motion.plan_program import plan_program
from rcilab.motion.program import Program
from rcilab.motion.waypoint import Waypoint

_ROBOT = "xMatePro7"
_SEED = 20
_LENGTHS = (1.0, 10.0, 100.0)  # [s] of motion.


def bench_forward() -> Measurement:
    """Forward kinematics of a 7-axis arm at random poses; of whole paths in the note."""
    model = load_model(_ROBOT)
    times = time_calls(model.forward, list(_random_q(model, 5000)))
    growth = _growth(model.forward_path, {n: _random_q(model, n) for n in (10, 100, 1000, 10_000)})
    return summarise("forward", times, "us", 10.0, f"{_ROBOT}, 5000 random poses; forward_path of N rows: {growth}")


def bench_inverse() -> Measurement:
    """All branches of the inverse kinematics at one arm angle."""
    model = load_model(_ROBOT)
    cases = [(model.forward(q), model.arm_angle(q)) for q in _random_q(model, 2000)]
    branches: list[int] = []

    def solve(case: Any) -> None:
        try:
            branches.append(len(model.inverse(case[0], psi=case[1])))
        except UnreachableError:  # Cannot happen: each pose is computed from joint angles inside the limits.
            branches.append(0)

    times = time_calls(solve, cases)
    note = (
        f"{_ROBOT}, 2000 reachable poses, all 8 branches computed, {np.mean(branches):.1f} inside the limits on average"
    )
    if not all(branches):
        note += f"; {branches.count(0)} POSES WITHOUT A SOLUTION"
    return summarise("inverse", times, "us", 40.0, note)


def bench_inverse_batch() -> Measurement:
    """All branches of the inverse kinematics for many poses in one call, per pose."""
    model, count = load_model(_ROBOT), 10_000
    poses = model.forward_path(_random_q(model, count))
    times = time_calls(model.inverse_batch, [poses] * 20, warm_up=2)
    growth = _growth(model.inverse_batch, {n: poses[:n] for n in (10, 100, 1000, count)})
    one, many = _panda_inverse(count)
    note = (
        f"{_ROBOT}, time per pose in batches of {count}, limits checked; whole batches: {growth}; Panda, whose offsets "
        f"lead to a polynomial of degree 16: {one:.0f} us single, {many:.1f} us per pose"
    )
    return summarise("inverse_batch", np.array(times) / count, "us", 2.0, note)


def _panda_inverse(count: int) -> tuple[float, float]:
    """Returns the time of a Panda's inverse kinematics at a given elbow: single, and in a batch, [us]."""
    model = load_model("Panda")
    q = _random_q(model, count)
    poses = model.forward_path(q)
    some = [(model.forward(row), float(row[2])) for row in q[:200]]
    one = np.median(time_calls(lambda case: model.inverse(case[0], psi=case[1]), some))
    many = np.median(time_calls(lambda psi: model.inverse_batch(poses, psi), [q[:, 2]] * 3, warm_up=1)) / count
    return 1e6 * float(one), 1e6 * float(many)


def bench_feasible_arcs() -> Measurement:
    """The feasible arm angles of a pose, with the reasons against the others."""
    model = load_model(_ROBOT)
    poses = [model.forward(q) for q in _random_q(model, 500)]
    arcs = np.mean([len(model.feasible_arcs(pose).arcs) for pose in poses])
    note = f"{_ROBOT}, 500 reachable poses, {arcs:.1f} arcs on average"
    panda = load_model("Panda")
    others = time_calls(panda.feasible_arcs, [panda.forward(q) for q in _random_q(panda, 30)])
    note += f"; Panda, searched along its self-motion: {1e3 * float(np.median(others)):.1f} ms"
    return summarise("feasible_arcs", time_calls(model.feasible_arcs, poses), "us", 300.0, note)


def bench_plan_joint() -> Measurement:
    """A jerk-limited motion between two random poses, planned but not yet sampled."""
    model = load_model(_ROBOT)
    ends = _random_q(model, 400).reshape(200, 2, model.n)
    times = time_calls(lambda pair: plan_joint(model, pair[0], pair[1]), list(ends))
    some = [motion_of(model, duration) for duration in _LENGTHS]
    growth = cost_by_length(
        lambda case: plan_joint(model, case[0], case[1], speed=case[2]).q,
        [(motion.duration, [(motion.start, motion.q[-1], motion.speed)] * 5) for motion in some],
    )
    straight, alone = _ratios(model, ends)
    note = (
        f"{_ROBOT}, 200 random pairs, {straight.max():.4f} times as long as the fastest straight motion at most; "
        f"against the slowest joint by itself, which a straight motion cannot always match, {np.median(alone):.4f} "
        f"(median), {alone.max():.3f} at most; with every 1 ms sample of q {growth}"
    )
    return summarise("plan_joint", times, "ms", 1.0, note)


def bench_program() -> Measurement:
    """A program of 20 waypoints with blends, planned as one motion; other lengths in the note."""
    model = load_model(_ROBOT)
    program = program_of(model, 20)
    times = time_calls(lambda steps: plan_program(model, steps), [program] * 10, warm_up=1)
    motion = plan_program(model, program)
    others = [program_of(model, count) for count in (2, 20, 160)]
    growth = cost_by_length(
        lambda steps: plan_program(model, steps), [(plan_program(model, it).duration, [it] * 3) for it in others]
    )
    note = (
        f"{_ROBOT}, 15 lines, 3 arcs and 2 joint moves at speed 0.5, every corner blended by 20 mm, "
        f"{motion.duration:.1f} s; 10 % quantile {1e3 * np.percentile(times, 10):.0f} ms; {growth}"
    )
    return summarise("program", times, "ms", 200.0, note)


def bench_program_close() -> Measurement:
    """A program of 1000 waypoints a few mm apart, every blend shortened, planned as one motion; scaling in the note."""
    model = load_model(_ROBOT)
    plan_program(model, close_program_of(model, 20))  # The first call loads the planner.
    medians: dict[int, list[float]] = {
        count: time_calls(lambda steps: plan_program(model, steps), [close_program_of(model, count)] * 3, warm_up=0)
        for count in (250, 500, 1000)
    }
    program = close_program_of(model, 1000)
    gentle = time_calls(lambda steps: plan_program(model, steps, law="torque_rate_limited"), [program], warm_up=0)
    growth = ", ".join(f"{count} waypoints {np.median(times):.2f} s" for count, times in medians.items())
    note = f"{_ROBOT}, lines of 4 mm at speed 0.5, blends of 10 mm requested; {growth}; torque_rate_limited, as the "
    note += f"page plans programs: 1000 waypoints {gentle[0]:.2f} s"
    return summarise("program_close", medians[1000], "s", 3.0, note)


def bench_check() -> Measurement:
    """The check of a 7-joint motion of 10 s during a drag: all conditions except collisions."""
    model = load_model(_ROBOT)
    return _bench_check("check", lambda motion: check(motion, model, distance=None), model, 10.0)


def bench_check_full() -> Measurement:
    """The check of a 7-joint motion of 10 s by all conditions, including torques and collisions."""
    model = load_model(_ROBOT)
    found = _bench_check("check_full", lambda motion: check(motion, model), model, 150.0)
    geometry, motion = model.collision_geometry(), motion_of(model, 10.0)
    query, count = ClearanceQuery(geometry), 0
    for compute_distance in (query.links, query.floor):
        count += clearance_path(
            compute_distance, motion.q, motion.start, geometry.levers, (0.0, ADVISED_DISTANCE)
        ).queries
    travel = float((np.abs(np.diff(motion.q, axis=0)) @ geometry.levers).sum())
    return replace(found, note=f"{found.note}; {count} distance queries on {travel:.1f} m of travel")


def bench_check_joint_rows() -> Measurement:
    """The check of a 7-joint motion of 10 s by the conditions on joint angles only."""
    model = load_model(_ROBOT)
    assert model.description.conditions is not None
    check_again = check(motion_of(model, 1.0), model, distance=None).check_again
    rows = tuple(row for row in model.description.conditions().motion if row.signal == "joint")
    return _bench_check("check_joint_rows", lambda motion: check_again(motion, rows), model, 5.0)


def _bench_check(name: str, call: Callable[[Motion], object], model: RobotModel, target: float) -> Measurement:
    """Measures a check on new motions, so that nothing is cached, and its scaling with the length."""
    motions = [motion_of(model, 10.0) for _ in range(30)]
    times = time_calls(call, motions, warm_up=0)
    some = ([motion_of(model, duration) for _ in range(5)] for duration in _LENGTHS)
    growth = cost_by_length(call, ((row[0].duration, row) for row in some))
    note = f"{_ROBOT}, {len(motions[0].times)} samples; {growth}"
    return summarise(name, times, "ms", target, note)


def bench_jog() -> Measurement:
    """One cycle of on-line re-planning while the tool is jogged with changing twists; other commands in the note."""
    model = load_model(_ROBOT)
    twists = 0.05 * np.random.default_rng(_SEED).normal(size=(20, 6))

    def steps(command: Callable[[Jog, int], None], every: int) -> list[float]:
        jog = Jog(model, model.home)

        def step(k: int) -> None:
            if k % every == 0:
                command(jog, k)
            jog.step()

        return time_calls(step, range(2000))

    def turn(jog: Jog, k: int) -> None:
        jog.set_twist(twists[k // 100 % len(twists)], frame="tool")

    def follow(jog: Jog, k: int) -> None:
        jog.set_target(model.home + 0.3 * np.sin(2e-3 * k))

    def drive(jog: Jog, k: int) -> None:
        jog.set_joint_velocity(0.3 * np.sin(0.02 * k + np.arange(model.n)))

    others = ", ".join(
        f"{name} {1e6 * float(np.median(steps(command, every))):.0f} us"
        for name, command, every in (("joint velocities every cycle", drive, 1), ("a target every cycle", follow, 1))
    )
    note = f"{_ROBOT}, tool frame, another twist every 100 cycles; {others}"
    return summarise("jog", steps(turn, 100), "us", 50.0, note)


def program_of(model: RobotModel, count: int) -> Program:
    """Returns a program around home: the tool along a rising square, with some arcs and some joint motions.

    Args:
        model: The arm.
        count: Number of waypoints; of 20, 15 are lines, 3 arcs and 2 joint moves.
    """
    T = model.forward(model.home)

    def pose(x: float, y: float, z: float, turn: float) -> Pose:
        return Pose(T.position + (x, y, z), (T @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, turn, 0.0))).wxyz)

    corners = ((0.0, 0.12), (-0.12, 0.12), (-0.12, -0.12), (0.0, -0.12))
    waypoints: list[Waypoint] = []
    for i in range(count):
        x, y = corners[i % 4]
        height, turn = -0.02 * (i % 3), 0.15 * (i % 2)
        if i % 7 == 6:
            q = model.home + 0.15 * np.sin(np.arange(model.n) + i)
            waypoints.append(Waypoint.joint(q, speed=0.5, blend=0.02))
        elif i % 6 == 3:
            waypoints.append(
                Waypoint.arc(
                    (*(T.position[:2] + (x - 0.08, y / 2.0)), T.position[2]),
                    pose(x, y, height, turn),
                    speed=0.5,
                    blend=0.02,
                )
            )
        else:
            waypoints.append(Waypoint.line(pose(x, y, height, turn), speed=0.5, blend=0.02))
    return Program(model=model.name, start=tuple(model.home.tolist()), waypoints=tuple(waypoints))


def close_program_of(model: RobotModel, count: int) -> Program:
    """Returns a program of lines to waypoints a few millimetres apart, on a zigzag around a rising circle.

    Args:
        model: The arm.
        count: Number of waypoints; 100 per revolution.
    """
    T = model.forward(model.home)
    positions = (
        T.position + (0.05 * (np.cos(turn) - 1.0), 0.05 * np.sin(turn), -5e-5 * i + 2e-3 * (i % 2))
        for i, turn in enumerate(np.arange(1, count + 1) * 2.0 * np.pi / 100.0)
    )
    waypoints = tuple(Waypoint.line(Pose(position, T.wxyz), speed=0.5, blend=0.01) for position in positions)
    return Program(model=model.name, start=tuple(model.home.tolist()), waypoints=waypoints)


def motion_of(model: RobotModel, duration: float, start: Array | None = None) -> Motion:
    """Returns a new motion of about this duration towards the upper end of every joint's range, or back home.

    Args:
        model: The arm.
        duration: Duration, [s].
        start: Start, shape (n,), [rad]; None: near the lower end of every joint's range.
    """
    near = -0.9 * model.limits.joint.upper if start is None else start
    far = 0.9 * model.limits.joint.upper
    if np.linalg.norm(near - far) < np.linalg.norm(near - model.home):
        far = model.home
    fastest = plan_joint(model, near, far, speed=1.0).duration
    if duration <= fastest:
        return plan_joint(model, near, near + (far - near) * duration / fastest, speed=1.0)
    return plan_joint(model, near, far, speed=fastest / duration)


def _ratios(model: RobotModel, ends: Array) -> tuple[Array, Array]:
    """Returns the durations of motions at full speed relative to the fastest straight one, and to the slowest joint."""
    limits = model.limits.joint
    durations = [plan_joint(model, start, goal, speed=1.0).duration for start, goal in ends]
    bounds = np.array([(fastest_straight(limits, b - a), slowest_alone(limits, b - a)) for a, b in ends])
    straight, alone = np.array(durations) / bounds.T
    return straight, alone


def _random_q(model: RobotModel, count: int) -> Array:
    """Returns joint angles distributed over the joint ranges, shape (count, n), [rad], the same on every machine."""
    limits = model.limits.joint
    return np.random.default_rng(_SEED).uniform(0.98 * limits.lower, 0.98 * limits.upper, (count, model.n))


def _growth(call: Any, cases: dict[int, Any]) -> str:
    """Returns the cost of a call by the size of its argument, as text."""
    costs = []
    for size, argument in cases.items():
        start = time.perf_counter()
        for _ in range(3):
            call(argument)
        costs.append(f"N={size} {1e6 * (time.perf_counter() - start) / 3:.0f} us")
    return ", ".join(costs)
