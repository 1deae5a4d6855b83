"""Poses without an elbow leave it free: the check of a recorded motion comes to the controller's own result."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rcilab.recording.client_motions import ClientMotions
from rcilab.recording.run import Run, build_run
from rcilab.recording.sent_motion import check_sent, sent_motion
from tests.peers.franka import wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Callback, Output, Robot
from tests.peers.franka.wire import State

CYCLES = 500


def roll(start: State, angle: float) -> Callback:
    """The tool turned about x of the base, and moved along y.

    The joints that move least turn joint 3, too; with joint 3 held, the others accelerate more.
    """
    T = np.array(start.O_T_EE_c).reshape(4, 4).T

    def callback(_: State, k: int) -> Output:
        u = min(k / CYCLES, 1.0)
        turn = angle * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        c, s = math.cos(turn), math.sin(turn)
        M = T.copy()
        M[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]) @ T[:3, :3]
        M[1, 3] -= 0.5 * turn
        return Output(pose=tuple(M.T.ravel()))

    return callback


def record(place: FciArena, angle: float) -> tuple[Run, str]:
    """Returns the record of a motion of the tool, and how it ended."""
    ring = place.arena.server.ring
    assert ring is not None
    motions = ClientMotions(ring)
    with place.connect() as robot:
        ending = _play(robot, angle)
        if ending != "success":
            robot.ask("automatic_error_recovery")
        robot.skip(20)
    part = motions.poll(is_last=True)[-1]
    assert part.end is not None
    model, setup = part.motion.model, part.motion.setup
    return build_run(part.cycles, plan=None, model=model, setup=setup, realtime=False, stopped=part.end.stopped), ending


def with_elbow(run: Run) -> Run:
    """Returns the run as if the client had commanded the elbow of the start."""
    cycles = run.cycles.copy()
    cycles["command_psi"] = np.where(np.isfinite(cycles["command_pose"][:, 0, 0]), run.q_c[0, 2], math.nan)
    return replace(run, cycles=cycles)


def _play(robot: Robot, angle: float) -> str:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    return robot.play(start, roll(start, angle), cycles=CYCLES + 1).status


@pytest.mark.parametrize("version", [5, 10])
def test_a_motion_with_a_free_elbow_that_runs_conforms(version: int) -> None:
    with fci_arena(version, is_recorded=True) as place:
        run, ending = record(place, 0.3)
    assert ending == "success"
    psi = run.q_c[:, 2]
    assert np.ptp(psi) > 0.3
    motion = sent_motion(run)
    assert motion.q == pytest.approx(run.q_c[1 : len(motion.q) + 1], abs=1e-9)
    report = check_sent(run)
    assert report.ok, str(report)
    assert not any(row.condition.signal == "arm_angle" for row in report.rows)


def test_one_that_the_controller_stops_has_the_same_violation_in_the_check() -> None:
    with fci_arena(10, is_recorded=True) as place:
        run, ending = record(place, 0.42)
    assert ending == "reflex"
    (fault, *_) = run.faults
    first = check_sent(run).violations[0]
    assert first.fault is fault
    played = np.flatnonzero(run.cycles["played"])
    stopped = np.flatnonzero(run.cycles["faults"])[0] - played[0]
    assert first.time == pytest.approx(1e-3 * stopped, abs=1.5e-3)


def test_an_elbow_that_was_commanded_is_checked() -> None:
    with fci_arena(10, is_recorded=True) as place:
        run, _ = record(place, 0.3)
    held = with_elbow(run)
    report = check_sent(held)
    assert not report.ok
    assert any(row.condition.signal == "arm_angle" for row in report.rows)
    assert np.ptp(sent_motion(held).q[:, 2]) < 1e-9
