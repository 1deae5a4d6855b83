"""Lines and arcs as geometry, against the vendor's blocking moves and against laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.motion.cartesian import schedule
from rcilab.motion.path import build_arc, build_line, slerp

# Sampled from the vendor's client library with its filter off: (cycle, rotation and position row by row, arm angle).
DOWN = (1.0, 0.0, 0.0, 0.5, 0.0, -0.9899924966004454, -0.1411200080598672, 0.0,
        0.0, 0.1411200080598672, -0.9899924966004454, 0.4)  # fmt: skip
LINE_GOAL = (0.9950041652780258, 0.0334430115662647, -0.0940652755099238, 0.5,
             0.0, -0.9422223406686581, -0.3349881501559051, 0.2,
             -0.09983341664682815, 0.33331460472390634, -0.9375151535833258, 0.5)  # fmt: skip
LINE = (
    (507, (0.999989036986404, 0.00114151141380015, -0.0045412397753485, 0.5,
           0.000445703955547641, -0.988630761853383, -0.150362954430888, 0.00934949951952076,
           -0.00466125036755724, 0.150359281951243, -0.988620432257051, 0.40467474975976)),
    (2536, (0.998747208888028, 0.0143838592711727, -0.0479282519067967, 0.5,
            0.0025026028961311, -0.970955852205876, -0.239245627015218, 0.0999969599537831,
            -0.049977492105132, 0.238825956838087, -0.969775444431985, 0.449998479976892)),
)  # fmt: skip
ARC_START = (1.0, 0.0, 0.0, 0.5, 0.0, -0.9899924966004454, -0.1411200080598672, -0.1,
             0.0, 0.1411200080598672, -0.9899924966004454, 0.4)  # fmt: skip
ARC_GOAL = (0.9800665778412416, 0.11889806036861848, -0.15916266597144513, 0.5,
            0.0, -0.8011436155469337, -0.5984721441039565, 0.1,
            -0.19866933079506122, 0.5865425462052751, -0.7851740816484426, 0.45)  # fmt: skip
ARC = (
    (222, (0.999995221085465, 0.00119081495617037, -0.00285302750988462, 0.504812436801195,
           0.000753443691594525, -0.988887508016639, -0.148663811370645, -0.0996014517673287,
           -0.00299835435457418, 0.148660951323417, -0.98888367941977, 0.398896527857869)),
    (2108, (0.980149631844568, 0.118567151565913, -0.15889785953405, 0.500672530633192,
            0.000106626198255452, -0.801780498677285, -0.59761862468606, 0.100037306938039,
            -0.198259143107728, 0.585738732294826, -0.785877502963305, 0.449841194076212)),
)  # fmt: skip
VENDOR = 1e-12  # Commands as sent carry about 15 digits.


def pose(numbers) -> Pose:
    return Pose.from_row_major([*numbers, 0.0, 0.0, 0.0, 1.0])


def turned(yaw: float, position=(0.5, 0.0, 0.4)) -> Pose:
    return Pose.from_rpy(position, (0.0, 0.0, yaw))


def test_a_line_is_the_vendors():
    path = build_line(pose(DOWN), pose(LINE_GOAL))
    shares = schedule(path, 0.05)
    assert len(shares) - 1 == 5072 + 1  # The vendor sends nothing in the cycle in which it is finished.
    for cycle, numbers in LINE:
        assert np.allclose(path.at(shares[cycle])[0].as_row_major()[:12], numbers, rtol=0.0, atol=VENDOR)


def test_an_arc_is_the_vendors():
    path = build_arc(pose(ARC_START), Pose((0.6, 0.0, 0.4)), pose(ARC_GOAL))
    shares = schedule(path, 0.2)
    assert len(shares) - 1 == 2219 + 1
    for cycle, numbers in ARC:
        assert np.allclose(path.at(shares[cycle])[0].as_row_major()[:12], numbers, rtol=0.0, atol=VENDOR)


def test_the_arm_angle_runs_in_proportion_as_the_vendors():
    line = build_line(pose(DOWN), pose((*DOWN[:7], 0.2, *DOWN[8:11], 0.5)), 0.1, 0.6)
    shares = schedule(line, 0.2)
    assert line.at(shares[172])[1] == pytest.approx(0.105415140215535, abs=VENDOR)
    arc = build_arc(Pose((0.5, -0.1, 0.4)), Pose((0.6, 0.0, 0.4)), Pose((0.5, 0.1, 0.4)), 0.1, 0.8)
    assert arc.distance == pytest.approx(math.pi * 0.1, abs=1e-15)
    assert arc.at(schedule(arc, 0.2)[217])[1] == pytest.approx(0.110361607463161, abs=VENDOR)


def test_a_mere_turn_takes_its_angle_for_the_way_about_every_axis():
    path = build_line(turned(0.0), turned(0.5))
    assert (path.distance, path.unit) == (pytest.approx(0.5), "rad")
    assert len(schedule(path, 0.2)) - 1 == 3100  # About base z the vendor does the same.
    x, y = path.at(schedule(path, 0.2)[310])[0].rotation[:2, 0]
    assert math.atan2(y, x) == pytest.approx(math.asin(0.0122746871158254), abs=VENDOR)
    about_y = Pose.from_rpy((0.5, 0.0, 0.4), (0.0, 0.5, 0.0))
    assert build_line(turned(0.0), about_y).distance == pytest.approx(0.5)


def test_an_arm_angle_alone_is_a_way():
    assert build_line(IDENTITY, IDENTITY, 0.2, -0.5).distance == pytest.approx(0.7)


def test_a_line_from_a_pose_to_itself_has_no_length():
    path = build_line(turned(0.3), turned(0.3), 0.1, 0.1)
    assert path.distance == 0.0
    assert schedule(path, 1.0).tolist() == [1.0]


points = st.tuples(*[st.floats(-0.8, 0.8)] * 3)


@given(points, points, points, st.floats(0.0, 1.0))
def test_an_arc_starts_at_start_passes_via_ends_at_goal_and_keeps_its_radius(a, b, c, share):
    a, b, c = (np.array(p) for p in (a, b, c))
    area = float(np.linalg.norm(np.cross(b - a, c - a)))
    assume(area > 0.01)  # A thin triangle makes a circle of kilometres, on which rounding is seen.
    path = build_arc(Pose(a), Pose(b), Pose(c))
    circle = path.circle
    assert np.allclose(path.at(0.0)[0].position, a)
    assert np.allclose(path.at(1.0 - 1e-12)[0].position, c, atol=1e-9)
    center = np.array(circle.center)
    radius = math.hypot(*circle.first)
    assert np.linalg.norm(path.at(share)[0].position - center) == pytest.approx(radius, rel=1e-9)
    to_b = b - center
    angle = math.atan2(to_b @ np.array(circle.second), to_b @ np.array(circle.first)) % math.tau
    assert 0.0 < angle < circle.angle
    assert np.allclose(path.at(angle / circle.angle)[0].position, b, atol=1e-9)


@pytest.mark.parametrize(
    ("via", "goal", "hint"),
    [
        ((0.1, 0.0, 0.0), (0.2, 0.0, 0.0), "lie on a line .* use a straight line"),
        ((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), "two of the three points of the arc are the same"),
    ],
)
def test_points_that_make_no_circle_are_named(via, goal, hint):
    with pytest.raises(PlanningError, match=hint):
        build_arc(IDENTITY, Pose(via), Pose(goal))


def test_what_is_no_pose_is_named():
    with pytest.raises(InvalidValueError, match=r"goal must be a Pose"):
        build_line(IDENTITY, np.eye(3))


@given(st.floats(0.0, 1.0), st.floats(0.01, 3.1))
def test_slerp_turns_in_proportion(share, angle):
    a, b = IDENTITY.parts[0], turned(angle).parts[0]
    assert np.allclose(rotation_between(a, slerp(a, b, share)), (0.0, 0.0, share * angle), atol=1e-9)
