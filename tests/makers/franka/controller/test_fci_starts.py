"""The first command of a motion: a step that the jerk bounds allow is no error, as `rcilab.check` finds, too."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion
from tests.makers.franka.controller.test_fci_errors import recover
from tests.peers.franka import programs, wire
from tests.peers.franka.arena import MODELS, FciArena
from tests.peers.franka.faults import columns
from tests.peers.franka.robot import Output, Robot
from tests.peers.franka.wire import ERROR_NAMES

CYCLE = 0.001  # [s]


def path(jerk: float) -> np.ndarray:
    """Returns a short path with a constant jerk in either direction, from rest to rest."""
    rates = np.concatenate(([jerk, -jerk, -jerk, jerk], np.zeros(4)))
    return np.cumsum(np.cumsum(np.cumsum(rates))) * CYCLE**3


@pytest.mark.parametrize("share", [0.2, 0.5, 0.99])
@pytest.mark.parametrize("joint", [1, 6])
def test_a_motion_that_begins_with_its_largest_jerk_is_followed(
    robot: Robot, place: FciArena, joint: int, share: float
) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    home, jerk = place.controller.model.home, float(place.controller.model.limits.joint.jerk[joint])
    rows = np.tile(home, (8, 1))
    rows[:, joint] += path(share * jerk)
    assert check(Motion.from_cycles(rows), load_model(MODELS[robot.version]), start=home, distance=None).ok
    ending = robot.play(start, [Output(q=tuple(row)) for row in rows.tolist()])
    assert (ending.status, ending.state.errors) == ("success", ())


@pytest.mark.parametrize(("share", "errors"), [(0.7, (15,)), (1.05, (11,))])
def test_a_first_step_that_ends_at_once_and_a_larger_one_are_errors(
    robot: Robot, place: FciArena, share: float, errors: tuple[int, ...]
) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    home, jerk = place.controller.model.home, float(place.controller.model.limits.joint.jerk[6])
    rows = np.tile(home, (5, 1))
    rows[:, 6] += share * jerk * CYCLE**3
    found = {v.fault for v in check(Motion.from_cycles(rows), load_model(MODELS[robot.version]), start=home).violations}
    ending = robot.play(start, [Output(q=tuple(row)) for row in rows.tolist()])
    assert ending.state.errors == tuple(ERROR_NAMES[n] for n in errors)
    assert {f.manual_name for f in found if f is not None} >= set(ending.state.errors)
    recover(robot, ending.state.errors)


@pytest.mark.parametrize("share", [0.1, 0.25])
def test_a_tool_that_begins_with_a_step_is_followed(robot: Robot, place: FciArena, share: float) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    jerk = place.controller.model.limits.cartesian.translation_jerk
    poses = [programs.with_offset(start.O_T_EE_c, 14, off) for off in path(share * jerk).tolist()]
    ending = robot.play(start, [Output(pose=pose) for pose in poses])
    assert (ending.status, ending.state.errors) == ("success", ())


@pytest.mark.parametrize("share", [0.3, 0.45, 0.6, 0.75])
def test_the_first_velocities_of_the_tool_are_checked_as_the_poses_that_they_lead_to(
    robot: Robot, place: FciArena, share: float
) -> None:
    jerk = place.controller.model.limits.cartesian.translation_jerk
    rates = share * jerk * CYCLE**2 * np.array([1.0, 0.5, 0.22, 0.07, *[0.0] * 40])
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    paths = (start.O_T_EE_c[14] + CYCLE * np.cumsum(rates)).tolist()
    poses = robot.play(start, [Output(pose=(*start.O_T_EE_c[:14], z, 1.0)) for z in paths])
    if poses.state.errors:
        recover(robot, poses.state.errors)
    home = place.controller.model.home.tolist()
    place.simulate("place_arm", q=home)
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_VELOCITY)
    twists = robot.play(start, [Output(twist=(0.0, 0.0, rate, 0.0, 0.0, 0.0)) for rate in rates.tolist()])
    assert (twists.state.errors, twists.sent) == (poses.state.errors, poses.sent)
    if not poses.state.errors:
        assert twists.state.O_T_EE_c[14] == pytest.approx(paths[-1], abs=1e-7)


def test_an_orientation_that_is_a_rotation_within_its_tolerance_may_begin_a_motion(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    T = np.reshape(start.O_T_EE_c, (4, 4)).T.copy()
    T[:3, 0] *= 1.0 + 9e-6
    ending = robot.play(start, [Output(pose=columns(T))] * 20)
    assert (ending.status, ending.state.errors) == ("success", ())
