"""Programs as motions: inside every limit, smooth, off the way only inside blend radii, segments told apart."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import rcilab
from rcilab.conformance.cartesian_monitor import CartesianMonitor
from rcilab.conformance.check import check
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, Program, Waypoint, plan_joint, plan_line, plan_program
from rcilab.motion.blend import build_blend
from rcilab.motion.program_expansion import expand
from rcilab.motion.segment import Segment, build_segments
from rcilab.motion.segment_spline import build_segment_spline

TOOL = Pose((0.0, 0.02, 0.1))
MODELS = {name: load_model(name, tool=TOOL) for name in ("xMatePro3", "xMatePro7", "xMate3", "xMate7", "Panda", "FR3")}
SEVEN, SIX = MODELS["xMatePro7"], MODELS["xMate3"]
TYPES = ("joint", "line", "arc", "circle", "nullspace")
names, seeds = st.sampled_from(sorted(MODELS)), st.integers(0, 2**32)


def at(model, step, rpy=(0.0, 0.0, 0.0)) -> Pose:
    """The pose of the tool at home, moved in base and turned in its own axes."""
    T = model.forward(model.home)
    return Pose(T.position + step, (T @ Pose.from_rpy((0, 0, 0), rpy)).wxyz)


def program(model, *waypoints, start=None) -> Program:
    return Program(model=model.name, start=model.home if start is None else start, waypoints=waypoints)


def segments_of(model, steps: Program) -> list[Segment]:
    return build_segments(model, steps.start, expand(steps.waypoints).moves)


def drawn(model, seed, count, types=TYPES) -> Program:
    """A random program close to home."""
    rng = np.random.default_rng(seed)
    start = model.home + rng.uniform(-0.2, 0.2, model.n)
    T = model.forward(start)
    waypoints = []
    for _ in range(count):
        how = {
            "speed": float(rng.choice([0.3, 1.0])),
            "blend": float(rng.choice([0.0, 0.003, 0.02, 0.08, 0.4], p=[0.1, 0.2, 0.3, 0.3, 0.1])),
            "dwell": float(rng.choice([0.0, 0.0, 0.0, 0.0, 0.02])),
        }
        q = model.home + rng.uniform(-0.3, 0.3, model.n)
        goal = model.forward(q)
        psi = float(rng.uniform(-0.3, 0.3)) if model.n == 7 and rng.random() < 0.5 else None
        kind = types[rng.integers(len(types))]
        if kind == "nullspace" and model.n == 7:
            way = "longer" if rng.random() < 0.1 else "shorter"
            waypoints.append(Waypoint.nullspace(float(rng.uniform(-0.5, 0.5)), way=way, **how))
            continue
        if kind == "circle":
            angle = float(rng.uniform(1.0, math.tau))
            center = T.position - (0.04, 0.0, 0.0)
            turning = rng.random() < 0.5
            orientation = "turning" if turning else "held"
            waypoints.append(Waypoint.circle(center, (0.0, 0.0, 1.0), angle, orientation=orientation, psi=psi, **how))
            R = Pose.from_rpy((0, 0, 0), (0.0, 0.0, angle * turning))
            goal = Pose(center + 0.04 * np.array([math.cos(angle), math.sin(angle), 0.0]), (R @ T).wxyz)
        elif kind == "arc":
            via = (T.position + goal.position) / 2.0 + rng.uniform(-0.05, 0.05, 3)
            over = via if rng.random() < 0.5 else Pose(via, T.wxyz)
            waypoints.append(Waypoint.arc(over, goal, psi=psi, **how))
        elif kind == "joint":
            waypoints.append(Waypoint.joint(q if rng.random() < 0.5 else goal, **how))
        else:
            waypoints.append(Waypoint.line(goal, psi=psi, **how))
        T = goal
    return program(model, *waypoints, start=start)


def planned(model, steps, **options):
    try:
        return plan_program(model, steps, **options)
    except PlanningError:
        assume(False)


def angle_of(model, q):
    return model.arm_angle(q) if model.n == 7 else None


def require_smooth(motion):
    """Position, velocity and acceleration continuous, rest at both ends."""
    coefficients = motion.polynomial.coefficients
    lengths = np.diff(motion.polynomial.breaks)[:, np.newaxis]
    for order, tolerance in ((0, 1e-11), (1, 1e-8), (2, 1e-5)):
        powers = lengths ** np.arange(coefficients.shape[2])
        last = (coefficients * powers[:, np.newaxis, :]).sum(axis=2)
        assert np.abs(last[:-1] - coefficients[1:, :, 0]).max(initial=0.0) < tolerance, order
        coefficients = coefficients[:, :, 1:] * np.arange(1.0, coefficients.shape[2])
    for sample in (motion.at(0.0), motion.end()):
        assert np.abs(sample.dq).max() < 1e-9
        assert np.abs(sample.ddq).max() < 1e-6


def require_joint_limits(model, motion):
    assert check(motion, model).ok
    joint = model.limits.joint
    times = np.linspace(0.0, motion.duration, 5 * len(motion))
    for order, bound in ((1, joint.velocity), (2, joint.acceleration), (3, joint.jerk)):
        assert (np.abs(motion.polynomial.sample(times, order)) < bound).all()
    q = motion.polynomial.sample(times)
    assert ((joint.lower < q) & (q < joint.upper)).all()


def radius_at(segments, i):
    """The radius that the tool may exit_share its way within at the end of a segment; 0 where it stops."""
    waypoint, ahead = segments[i].waypoint, segments[i + 1 : i + 2]
    is_stop = waypoint.dwell > 0.0 or not ahead or segments[i].is_stationary or ahead[0].is_stationary
    return 0.0 if is_stop else waypoint.blend


def distance_to_way(points, way):
    """How far points are from the way through the rows of another table, each of shape (N,)."""
    d = np.sqrt(((points[:, np.newaxis, :] - way) ** 2).sum(axis=2))
    nearest = d.argmin(axis=1)
    best = np.full(len(points), np.inf)
    for side in (-1, 0):
        a = way[np.clip(nearest + side, 0, len(way) - 2)]
        b = way[np.clip(nearest + side, 0, len(way) - 2) + 1]
        along = ((points - a) * (b - a)).sum(axis=1) / np.maximum(((b - a) ** 2).sum(axis=1), 1e-20)
        foot = a + np.clip(along, 0.0, 1.0)[:, np.newaxis] * (b - a)
        best = np.minimum(best, np.sqrt(((points - foot) ** 2).sum(axis=1)))
    return best


@pytest.mark.parametrize("name", sorted(MODELS))
@settings(max_examples=2)
@given(seed=seeds)
def test_a_random_program_keeps_every_joint_limit_is_smooth_and_arrives(name, seed):
    model = MODELS[name]
    steps = drawn(model, seed, 4)
    motion = planned(model, steps)
    require_joint_limits(model, motion)
    require_smooth(motion)
    assert np.array_equal(motion.q[0], steps.start)
    assert np.allclose(motion.q[-1], segments_of(model, steps)[-1].goal, atol=1e-9)


@pytest.mark.parametrize("name", sorted(MODELS))
@settings(max_examples=1)
@given(seed=seeds)
def test_between_paths_of_the_tool_its_limits_and_the_arm_angles_are_kept_too(name, seed):
    model = MODELS[name]
    motion = planned(model, drawn(model, seed, 3, TYPES[1:]))
    monitor = CartesianMonitor(model.limits)
    monitor.reset(model.forward(motion.q[0]), angle_of(model, motion.q[0]))
    for q in [*motion.q, *[motion.q[-1]] * 3]:
        assert monitor.step(model.forward(q), angle_of(model, q)) == [], monitor.violations()


@settings(max_examples=8)
@given(names, seeds)
def test_the_tool_leaves_its_way_only_inside_the_blend_radius(name, seed):
    model = MODELS[name]
    steps = drawn(model, seed, 4)
    motion = planned(model, steps)
    times = np.arange(0.0, motion.duration, 0.0193)
    points = model.position_path(motion.polynomial.sample(times))
    segments = segments_of(model, steps)
    index = np.clip(np.searchsorted(motion.segment_starts, times, side="right") - 1, 0, len(segments) - 1)
    for i, segment in enumerate(segments):
        mine = points[index == i]
        corners = [(segments[j], radius_at(segments, j)) for j in (i - 1, i) if j >= 0]
        if not len(mine):
            continue
        off = distance_to_way(mine, segment.positions(model, np.linspace(0.0, 1.0, 1001)))
        for corner, radius in corners:
            to_corner = np.sqrt(((mine - corner.positions(model, np.ones(1))) ** 2).sum(axis=1))
            off = np.where(to_corner <= radius, 0.0, off)
        assert off.max() < 1e-6


@settings(max_examples=20)
@given(names, seeds, st.sampled_from(TYPES), st.sampled_from(TYPES), st.floats(0.001, 0.3))
def test_every_pair_of_types_blends_inside_the_radius(name, seed, first, second, radius):
    model = MODELS[name]
    rng = np.random.default_rng(seed)
    two = [drawn(model, int(rng.integers(2**32)), 1, (kind,)).waypoints[0] for kind in (first, second)]
    two = [replace(waypoint, blend=radius, dwell=0.0) for waypoint in two]
    try:
        before, after = segments_of(model, program(model, *two))
    except PlanningError:
        assume(False)
    assume(not before.is_stationary and not after.is_stationary)
    blend = build_blend(model, before, after, before.waypoint.blend)
    assert 0.0 < blend.radius <= radius
    assert 0.5 <= blend.exit_share <= 1.0
    assert 0.0 <= blend.entry_share <= 0.5
    spline = build_segment_spline(model, [before, after], [blend], 1.0)
    steps = np.diff(spline.knots)[:, np.newaxis]
    powers = [power[:, : model.n] for power in spline.powers]
    for _ in range(3):
        end = sum(power * steps**order for order, power in enumerate(powers))
        assert np.abs(end[:-1] - powers[0][1:]).max() < 1e-9
        powers = [float(order) * power for order, power in enumerate(powers)][1:]
    s = np.concatenate((np.linspace(0.0, spline.knots[-1], 150), np.linspace(-0.5, 0.5, 150) + spline.corners[0]))
    points = model.position_path(spline.sample(s)[0][:, : model.n])
    ways = [segment.positions(model, np.linspace(0.0, 1.0, 2001)) for segment in (before, after)]
    off = np.minimum(*(distance_to_way(points, way) for way in ways))
    away = np.sqrt(((points - after.positions(model, np.zeros(1))[0]) ** 2).sum(axis=1))
    assert np.where(away <= blend.radius, 0.0, off).max() < 2e-6


@settings(max_examples=5)
@given(names, seeds)
def test_segments_are_told_in_order_and_reach_their_waypoints(name, seed):
    model = MODELS[name]
    steps = drawn(model, seed, 4)
    motion = planned(model, steps)
    assert motion.segment.shape == (len(motion),)
    assert (np.diff(motion.segment) >= 0).all()
    assert motion.segment[0] == 0
    assert motion.segment[-1] == len(steps.waypoints) - 1
    points = model.position_path(motion.q)
    for i, segment in enumerate(segments_of(model, steps)[:-1]):
        last = points[np.flatnonzero(motion.segment <= i)[-1]]
        corner = segment.positions(model, np.ones(1))[0]
        waypoint = segment.waypoint
        radius = waypoint.blend if waypoint.dwell == 0.0 else 0.0
        assert np.linalg.norm(last - corner) <= radius + 1e-3


def test_without_blends_it_is_one_planners_motion_after_the_other():
    goal = at(SEVEN, (0.0, 0.1, -0.05))
    q = SEVEN.home + 0.2
    steps = program(SEVEN, Waypoint.line(goal, speed=0.5), Waypoint.joint(q, speed=0.7, dwell=0.1))
    motion = plan_program(SEVEN, steps)
    line = plan_line(SEVEN, SEVEN.home, goal, speed=0.5)
    joint = plan_joint(SEVEN, line.goal, q, speed=0.7)
    assert np.allclose(motion.q[: len(line)], line.q, atol=1e-9)
    assert np.allclose(motion.q[len(line) - 1 :][: len(joint)], joint.q, atol=1e-9)
    assert len(motion) == len(line) + len(joint) - 1 + 100
    assert motion.at(motion.duration - 0.1).q == pytest.approx(q, abs=1e-9)
    assert np.array_equal(motion.segment, [0] * (len(line) - 1) + [1] * (len(joint) + 100))


def test_a_blended_corner_is_faster_lies_in_the_plane_and_does_not_stop():
    corner, end = at(SEVEN, (0.0, 0.2, 0.0)), at(SEVEN, (-0.2, 0.2, 0.0), (0.0, 0.3, 0.0))
    sharp = plan_program(SEVEN, program(SEVEN, Waypoint.line(corner), Waypoint.line(end)))
    blended = plan_program(SEVEN, program(SEVEN, Waypoint.line(corner, blend=0.05), Waypoint.line(end)))
    assert blended.duration < sharp.duration - 0.05
    middle = slice(200, -200)
    assert np.abs(sharp.dq[middle]).max(axis=1).min() < 1e-6
    assert np.abs(blended.dq[middle]).max(axis=1).min() > 0.01
    positions = SEVEN.position_path(blended.q)
    assert np.ptp(positions[:, 2]) < 1e-8
    assert 0.001 < np.linalg.norm(positions - corner.position, axis=1).min() < 0.05


def test_a_straight_way_through_a_blend_stays_straight_and_at_speed():
    middle, end = at(SEVEN, (0.0, 0.1, 0.0)), at(SEVEN, (0.0, 0.2, 0.0))
    motion = plan_program(SEVEN, program(SEVEN, Waypoint.line(middle, blend=0.03), Waypoint.line(end)))
    positions = SEVEN.position_path(motion.q)
    assert np.ptp(positions[:, [0, 2]], axis=0).max() < 1e-8
    assert motion.duration < 1.02 * plan_line(SEVEN, SEVEN.home, end).duration


def test_an_arc_turns_through_the_orientation_of_its_via_or_evenly_without_one():
    via, goal = at(SEVEN, (-0.05, 0.05, 0.0), (0.2, 0.1, 0.0)), at(SEVEN, (-0.1, 0.0, 0.0), (0.0, 0.0, 0.2))
    for point, passes in ((via, True), (via.position, False)):
        end = Waypoint.line(at(SEVEN, (-0.1, -0.1, 0.0)))
        motion = plan_program(SEVEN, program(SEVEN, Waypoint.arc(point, goal, blend=0.01), end))
        T = SEVEN.forward_path(motion.q)
        nearest = T[np.linalg.norm(T[:, :3, 3] - via.position, axis=1).argmin()]
        assert (np.abs(nearest[:3, :3] - via.rotation).max() < 0.01) == passes


def test_there_and_back_turns_inside_the_radius():
    away = at(SIX, (0.0, 0.15, 0.0))
    motion = plan_program(SIX, program(SIX, Waypoint.line(away, blend=0.04), Waypoint.line(at(SIX, (0, 0, 0)))))
    require_joint_limits(SIX, motion)
    reached = np.linalg.norm(SIX.position_path(motion.q) - away.position, axis=1).min()
    assert 0.0 < reached < 0.04


def test_a_radius_too_long_is_shortened_to_half_the_way_and_said():
    steps = program(
        SEVEN,
        Waypoint.line(at(SEVEN, (0.0, 0.04, 0.0)), blend=0.2),
        Waypoint.line(at(SEVEN, (0.0, 0.04, -0.2)), blend=0.01),
        Waypoint.line(at(SEVEN, (-0.1, 0.04, -0.2)), blend=0.5),
    )
    motion = plan_program(SEVEN, steps)
    assert len(motion.notes) == 1  # The last waypoint is a stop, whatever its radius.
    assert "waypoint 1 (line): blend radius 200.0 mm shortened to 20.0 mm" in motion.notes[0]
    require_joint_limits(SEVEN, motion)


def test_blends_that_meet_in_the_middle_of_a_segment_leave_nothing_of_it():
    square = [(0.0, 0.1, 0.0), (-0.1, 0.1, 0.0), (-0.1, 0.0, 0.0), (0.0, 0.0, 0.0)]
    motion = plan_program(SEVEN, program(SEVEN, *(Waypoint.line(at(SEVEN, p), blend=0.05, speed=1.0) for p in square)))
    assert motion.notes == ()
    require_joint_limits(SEVEN, motion)
    require_smooth(motion)


def test_a_dwell_and_a_waypoint_where_the_tool_is_are_stops():
    here, there = at(SEVEN, (0.0, 0.0, 0.0)), at(SEVEN, (0.0, 0.1, 0.0))
    steps = program(
        SEVEN,
        Waypoint.line(here, blend=0.05),
        Waypoint.line(there, blend=0.05, dwell=0.25),
        Waypoint.joint(SEVEN.home, blend=0.05),
        Waypoint.joint(SEVEN.home, blend=0.05, dwell=0.1),
    )
    motion = plan_program(SEVEN, steps)
    still = np.abs(motion.dq).max(axis=1) < 1e-9
    assert still.sum() >= 350
    assert motion.segment[0] == 1
    assert motion.segment[-1] == 3
    require_joint_limits(SEVEN, motion)
    nothing = plan_program(SEVEN, program(SEVEN, Waypoint.line(here)))
    assert nothing.duration == 0.0
    assert np.array_equal(nothing.q, [SEVEN.home])
    waiting = plan_program(SEVEN, program(SEVEN, Waypoint.line(here, dwell=0.05)))
    assert len(waiting) == 51


def test_a_program_with_a_tool_is_planned_with_it():
    bare = load_model("xMatePro7")
    goal = at(SEVEN, (0.0, 0.1, 0.0))
    steps = Program(
        model="xMatePro7", start=bare.home, waypoints=(Waypoint.line(goal),), tool=(*TOOL.position, *TOOL.wxyz)
    )
    assert SEVEN.forward(plan_program(bare, steps).goal).is_close(goal, 1e-9)


def test_the_speed_of_all_can_be_scaled():
    steps = program(SEVEN, Waypoint.line(at(SEVEN, (0.0, 0.1, 0.0)), blend=0.02, speed=0.4), Waypoint.joint(SEVEN.home))
    slow = plan_program(SEVEN, steps, speed=0.25)
    assert slow.duration > 1.5 * plan_program(SEVEN, steps).duration
    assert slow.speed == 0.1


def test_segments_and_notes_survive_saving_and_slowing_down(tmp_path):
    steps = program(SEVEN, Waypoint.line(at(SEVEN, (0.0, 0.1, 0.0)), blend=0.5), Waypoint.joint(SEVEN.home))
    motion = rcilab.plan_program(SEVEN, steps)
    motion.save(tmp_path / "a.npz")
    again = Motion.load(tmp_path / "a.npz")
    assert np.array_equal(again.segment, motion.segment)
    assert again.notes == motion.notes != ()
    slower = motion.slowed(2.0)
    assert slower.segment_starts[1] == 2.0 * motion.segment_starts[1]
    assert set(plan_joint(SEVEN, SEVEN.home, SEVEN.home + 0.1).segment) == {0}
    with pytest.raises(InvalidValueError, match=r"segment_starts must begin at 0 and never decrease"):
        Motion(polynomial=motion.polynomial, goal=motion.goal, law="samples", segment_starts=np.array([0.0, 2.0, 1.0]))


@pytest.mark.parametrize(
    ("waypoint", "hint"),
    [
        (
            Waypoint.line(at(SEVEN, (2.0, 0.0, 0.0))),
            r"waypoint 2 \(line\): the line cannot be followed at .* of .* m .*reach",
        ),
        (Waypoint.joint(at(SEVEN, (2.0, 0.0, 0.0))), r"waypoint 2 \(joint\): .*out of reach by"),
        (
            Waypoint.joint([0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            r"waypoint 2 \(joint\): joint 2: goal 171\.89° ",
        ),
        (
            Waypoint.arc(at(SEVEN, (0.6, 0.15, 0.0)), at(SEVEN, (0.0, 0.3, 0.0))),
            r"waypoint 2 \(arc\): the arc .*at 0\.\d+ of",
        ),
        (Waypoint.circle((0.5, 0.0, 0.1), (0.0, 0.0, 1.0)), r"waypoint 2 \(circle\): .*out of the plane"),
        (Waypoint.line([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), r"waypoint 2 \(line\): arm angle: shoulder and wrist are"),
    ],
)
def test_what_cannot_be_followed_is_told_with_waypoint_place_and_reason(waypoint, hint):
    with pytest.raises(PlanningError, match=hint):
        plan_program(SEVEN, program(SEVEN, Waypoint.joint(SEVEN.home, blend=0.01), waypoint))


def test_a_line_to_angles_on_another_branch_is_refused():
    q = np.array([0.3, -0.3, 0.2, 1.2, 0.1, 0.9, 0.0])
    other = next(
        other for other in SEVEN.inverse(SEVEN.forward(q), psi=SEVEN.arm_angle(q)) if np.abs(other - q).max() > 0.5
    )
    with pytest.raises(PlanningError, match=r"waypoint 2 \(line\): the line ends with joint .* is on another branch"):
        plan_program(SEVEN, program(SEVEN, Waypoint.joint(q), Waypoint.line(other)))


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("xMatePro7", program(SEVEN, Waypoint.joint(SEVEN.home))), "is a name; use load_model"),
        ((SEVEN, "program.json"), "program must be a Program"),
        ((SIX, program(SEVEN, Waypoint.joint(SEVEN.home))), "is the model of the program, not xMate3"),
        ((SEVEN, program(SEVEN, Waypoint.joint(SEVEN.home)), 0.0), "speed must be above 0.*, got 0.0"),
        (
            (SEVEN, program(SEVEN, Waypoint.joint(SEVEN.home, speed=0.002)), 0.1),
            r"waypoint 1 \(joint\), speed times 0.1",
        ),
    ],
)
def test_a_bad_argument_is_named(arguments, hint):
    with pytest.raises(InvalidValueError, match=hint):
        plan_program(*arguments[:2], **({"speed": arguments[2]} if len(arguments) > 2 else {}))


def test_a_start_outside_the_limits_is_told():
    with pytest.raises(PlanningError, match=r"the start: joint 2: start 171\.89° "):
        plan_program(SEVEN, program(SEVEN, Waypoint.joint(SEVEN.home), start=[0.0, 3.0, 0.0, 1.0, 0.0, 1.0, 0.0]))


@pytest.mark.parametrize("law", ["jerk_limited", "torque_rate_limited"])
@pytest.mark.parametrize("degrees", [150, 170, 179, 180])
@pytest.mark.parametrize("radius", [0.005, 0.03])
def test_a_blend_at_a_sharp_corner_takes_hardly_longer_than_a_stop(radius, degrees, law):
    turn = math.radians(degrees)
    end = (-0.1 * math.sin(turn), 0.0, -0.1 - 0.1 * math.cos(turn))
    times = {}
    for blend in (0.0, radius):
        way = program(SEVEN, Waypoint.line(at(SEVEN, (0, 0, -0.1)), blend=blend), Waypoint.line(at(SEVEN, end)))
        times[blend] = plan_program(SEVEN, way, law=law).duration
    assert times[radius] <= 1.03 * times[0.0]


@pytest.mark.parametrize("shift", [0.0, 1e-6, 1e-3, 1e-2])
def test_joints_may_turn_back_in_a_blend(shift):
    """The blend was refused as close to a singularity, or crept for seconds, as the third joint was a little off."""
    up, down = SEVEN.home.copy(), SEVEN.home.copy()
    up[1], down[1] = math.radians(20), math.radians(70)
    down[2] += shift
    ways = [
        program(SEVEN, *(Waypoint.joint(q, blend=b, speed=0.2) for q, b in ((down, 0), (up, blend), (down, 0))))
        for blend in (0.0, 0.01)
    ]
    stopping, blended = (plan_program(SEVEN, way) for way in ways)
    assert blended.duration <= 1.01 * stopping.duration
