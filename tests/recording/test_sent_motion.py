"""What a foreign client commanded, found in the record of a virtual controller: a scripted peer, over real sockets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.lib.recfunctions import repack_fields

from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import RATE_FIELDS
from rcilab.motion.motion import Motion
from rcilab.recording.run import Run, load_run
from rcilab.recording.sent_motion import check_sent, sent_motion, with_stop
from tests.peers import kinematics, programs, wire
from tests.peers.robot import ControlException, Output, Robot
from tests.recording.test_client_motions import MODEL, NEAR, SECONDS, as_run, collect, watched


@pytest.fixture(scope="module")
def sine() -> Run:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.joint_sine(robot, SECONDS, period=SECONDS)
        return as_run(collect(motions, 2)[1])


@pytest.fixture(scope="module")
def line() -> Run:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)
        return as_run(collect(motions, 2)[1])


def send_poses(robot: Robot, offsets: list[tuple[float, float, float]], law: int) -> None:
    """Commands the pose of the tool, moved by an offset a cycle, [m]."""
    poses = iter(offsets)
    robot.start_move(law, wire.CARTESIAN)
    begin: list[np.ndarray] = []

    def callback(state: wire.State) -> Output:
        if not begin:
            begin.append(kinematics.matrix(state.pos_m))
        T = begin[0].copy()
        T[:3, 3] += next(poses)
        return Output(pose=tuple(T.ravel().tolist()), psi=state.psi_m[0])

    robot.control(callback)


def recorded_poses(offsets: list[tuple[float, float, float]], law: int = wire.CARTESIAN_POSITION) -> Run:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        with pytest.raises(ControlException):
            send_poses(robot, offsets, law)
        parts = collect(motions, 2)[1]
    assert parts[-1].end is not None
    return replace(as_run(parts), stopped=parts[-1].end.stopped)


def without(run: Run, rows: slice, *, arrived: bool) -> Run:
    """The controller had no command to play in some cycles: they came too late, or never."""
    cycles = run.cycles.copy()
    pause = np.flatnonzero(cycles["played"])[rows]
    sources = pause - cycles["age"][pause].astype(int)
    cycles["played"][pause], cycles["missed"][pause] = 0, 1
    cycles["q_c"][pause] = cycles["q_c"][pause[0] - 1]  # The arm is held there.
    if not arrived:
        cycles["command"][sources] = np.nan
    return replace(run, cycles=cycles)


def test_a_first_pose_far_from_the_arm_does_not_conform() -> None:
    run = recorded_poses([(0.0, 0.1, 0.0)] * 100)
    assert run.stopped
    report = check_sent(run)
    assert not report.ok
    assert report.violations[0].time <= CYCLE_TIME
    assert "cartesian.velocity.translation" in {violation.condition.id for violation in report.violations}


@pytest.mark.parametrize("count", [0, 20])
def test_a_pose_without_joint_angles_is_the_violation(count: int) -> None:
    run = recorded_poses([(0.0, 0.0, 0.0)] * count + [(3.0, 0.0, 0.0)] * 100)
    report = check_sent(run)
    assert {violation.condition.id for violation in report.violations} == {"cartesian.frame"}
    (violation,) = report.violations
    assert violation.time == pytest.approx(max(count, 1) * CYCLE_TIME)
    assert violation.count == 1


@pytest.mark.parametrize("value", [np.inf, -1e300, np.nan])
def test_commands_that_are_not_numbers_do_not_conform(sine: Run, value: float) -> None:
    cycles = sine.cycles.copy()
    played = np.flatnonzero(cycles["played"])[200]
    cycles["command"][played - int(cycles["age"][played])] = value
    report = check_sent(replace(sine, cycles=cycles), distance=None)
    assert "joint.position" in {violation.condition.id for violation in report.violations}
    if not np.isfinite(value):
        (violation,) = report.violations
        assert str(violation).startswith("joint 1: commanded position is not a finite number at t = 0.200 s (necessary")
        assert "关节 1：指令位置不是有限的数" in violation.explain("zh")
    assert len(str(report)) < 5000  # No number is written with all of its 300 digits.


@pytest.mark.parametrize("value", [np.inf, -1e300, np.nan])
def test_poses_that_are_not_numbers_do_not_conform(line: Run, value: float) -> None:
    cycles = line.cycles.copy()
    played = np.flatnonzero(cycles["played"])[100]
    cycles["command_pose"][played - int(cycles["age"][played]), 0, 3] = value
    report = check_sent(replace(line, cycles=cycles), distance=None)
    assert "cartesian.frame" in {violation.condition.id for violation in report.violations}


def test_poses_are_checked_by_their_own_angles() -> None:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.nullspace(robot, SECONDS, period=SECONDS)
        run = as_run(collect(motions, 2)[1])
    motion = sent_motion(run)
    rows = np.flatnonzero(run.cycles["played"])
    np.testing.assert_allclose(motion.q, run.q_c[rows], rtol=0, atol=1e-9)
    assert check_sent(run).ok


def test_late_commands_count_at_their_place(sine: Run) -> None:
    late = without(sine, slice(300, 320), arrived=True)
    assert not check(late.commanded(), MODEL, distance=None).ok
    motion = sent_motion(late)
    assert motion.notes == ()
    assert motion.q.tobytes() == sent_motion(sine).q.tobytes()


def test_commands_that_never_arrived_are_interpolated(sine: Run) -> None:
    motion = sent_motion(without(sine, slice(300, 320), arrived=False))
    assert motion.notes == (
        "20 commands are missing in the record and interpolated: they never came, or came too late",
    )
    np.testing.assert_allclose(motion.q, sent_motion(sine).q, rtol=0, atol=1e-6)


def test_a_late_command_that_has_no_row_is_interpolated(sine: Run) -> None:
    """After a pause the client answers its last state again: it sends one more command than there are states."""
    cycles = without(sine, slice(300, 320), arrived=True).cycles.copy()
    sent = np.flatnonzero(np.isfinite(sine.command).all(axis=1))
    cycles["command"][sent[320:-1]] = sine.command[sent[321:]]
    cycles["late"][np.flatnonzero(sine.cycles["played"])[320] :] = 21
    motion = sent_motion(replace(sine, cycles=cycles))
    assert motion.notes == ("1 command is missing in the record and interpolated: it never came, or came too late",)
    np.testing.assert_allclose(motion.q[:1000], sent_motion(sine).q[:1000], rtol=0, atol=1e-6)


def test_a_client_that_goes_on_where_it_paused_has_no_gap(sine: Run) -> None:
    cycles = without(sine, slice(300, 320), arrived=False).cycles.copy()
    sent = np.flatnonzero(np.isfinite(sine.command).all(axis=1))
    cycles["command"][sent[320:]] = sine.command[sent[300:-20]]
    motion = sent_motion(replace(sine, cycles=cycles))
    assert motion.notes == ()
    assert motion.q.tobytes() == sent_motion(sine).q[:-20].tobytes()


def test_pauses_with_one_command_between_them_are_one(sine: Run) -> None:
    cycles = without(without(sine, slice(300, 310), arrived=False), slice(301, 311), arrived=False).cycles.copy()
    sent = np.flatnonzero(np.isfinite(sine.command).all(axis=1))
    cycles["command"][sent[310]] = sine.command[sent[300]]
    cycles["command"][sent[321:]] = sine.command[sent[301:-20]]
    motion = sent_motion(replace(sine, cycles=cycles))
    assert motion.notes == ()
    assert motion.q.tobytes() == sent_motion(sine).q[:-20].tobytes()


def test_a_cycle_that_catches_up_leaves_no_gap(sine: Run) -> None:
    """It plays a command and has no state, so that the age of all later commands is one less."""
    rows = sine.cycles
    played = np.flatnonzero(rows["played"])
    place = int(played[400])
    sources = played - rows["age"][played].astype(int)
    cycles = np.insert(rows, place, rows[place])
    cycles["command"][place], cycles["sent_ns"][place] = np.nan, 0
    moved = sources + (sources >= place)
    cycles["played"][played[-1] + 1] = 0
    for number, source in enumerate(moved):
        cycles["age"][played[number]] = played[number] - source if source < played[number] else 0
    found = sent_motion(replace(sine, cycles=cycles))
    assert found.notes == ()
    assert found.q.tobytes() == sent_motion(sine).q[: len(found.q)].tobytes()


def test_a_motion_lasts_from_its_first_played_command_to_the_last(sine: Run) -> None:
    report = check_sent(sine)
    assert report.motion.duration == pytest.approx(sine.duration)
    assert sine.duration == pytest.approx(SECONDS, abs=2.5 * CYCLE_TIME)
    assert sine.t[-1] > sine.duration


def test_a_command_without_a_cycle_of_its_own_is_in_a_note_on_the_duration(sine: Run) -> None:
    cycles = np.delete(sine.cycles, np.flatnonzero(sine.cycles["played"])[-1])
    played = replace(sine, cycles=cycles)
    last = np.flatnonzero(cycles["played"])[-1]
    cycles["age"][last] = max(int(cycles["age"][last]) - 1, 0)  # It overtakes the one before it.
    report = check_sent(played, distance=None)
    assert report.motion.duration == pytest.approx(played.duration + CYCLE_TIME)
    text = f"last {report.motion.duration:.3f} s, one a cycle; the controller played them in {played.duration:.3f} s"
    assert any(text in note for note in report.motion.notes)


def test_the_hold_after_the_last_command_is_not_the_clients(sine: Run) -> None:
    """A client that ends at speed is advised to end at standstill; one that was stopped is not."""
    end = int(np.flatnonzero(sine.cycles["played"])[300])
    cut = replace(sine, cycles=sine.cycles[: end + 1])
    assert not check(sent_motion(cut), MODEL, distance=None).ok
    report = check_sent(cut, distance=None)
    assert report.ok
    assert "end.velocity" in {row.condition.id for row in report.warnings}
    stopped = check_sent(replace(cut, stopped="an emergency stop was pressed"), distance=None)
    assert not any(row.condition.stage == "end" for row in stopped.rows)
    assert stopped.certificate is None
    assert check(with_stop(report.motion, MODEL, "joint_position"), MODEL, distance=None).ok


def test_a_jump_at_the_end_is_a_violation(sine: Run) -> None:
    end = int(np.flatnonzero(sine.cycles["played"])[300])
    cycles = sine.cycles[: end + 1].copy()
    cycles["command"][end - int(cycles["age"][end]), 1] += 1e12
    cycles["faults"][end] = 1
    cut = replace(sine, cycles=cycles)
    report = check_sent(cut)
    assert {violation.joint for violation in report.violations if violation.joint} == {2}
    assert with_stop(report.motion, MODEL, "joint_position") is report.motion


def test_a_run_without_its_beginning_is_checked_from_there_on(sine: Run) -> None:
    cut = replace(sine, cycles=sine.cycles[300:], truncated=True)
    report = check_sent(cut, distance=None)
    assert report.ok
    assert not any(row.condition.stage == "start" for row in report.rows)
    assert abs(next(row.value for row in report.rows if row.id == "joint.jerk")) < 50.0


def test_a_first_step_that_no_limit_forbids_needs_no_advice(sine: Run) -> None:
    cycles = sine.cycles.copy()
    cycles["q_c"][0] -= 5e-8
    report = check_sent(replace(sine, cycles=cycles))
    assert next(row for row in report.rows if row.id == "start.position").ok
    cycles["q_c"][0] -= 5e-5
    report = check_sent(replace(sine, cycles=cycles))
    assert not next(row for row in report.rows if row.id == "start.position").ok


@pytest.mark.parametrize("off", [1e-4, 9e-4])
def test_a_start_that_the_controller_absorbed_is_not_a_jerk(sine: Run, off: float) -> None:
    cycles = sine.cycles.copy()
    cycles["q_c"][0, 0] -= off
    report = check_sent(replace(sine, cycles=cycles), distance=None)
    assert report.ok
    (start,) = (row for row in report.rows if row.id == "start.position")
    assert (start.verdict, start.value) == ("advice", pytest.approx(off, rel=1e-3))
    assert any("of joint 1 from the arm's commanded position" in note for note in report.motion.notes)
    first = np.flatnonzero(cycles["played"])[0]
    cycles["faults"][first:] = 1
    refused = check_sent(replace(sine, cycles=cycles[: first + 1]), distance=None)
    assert "joint.jerk" in {violation.condition.id for violation in refused.violations}


@pytest.mark.parametrize(("off", "is_absorbed"), [(1e-6, False), (4e-6, True), (8e-6, True)])
def test_a_start_that_is_a_step_or_absorbed_is_what_conforms(sine: Run, off: float, is_absorbed: bool) -> None:
    """Within one cycle's jerk, 5 urad, a controller accepts either; a step above 2.5 urad is too much to stay there."""
    cycles = sine.cycles.copy()
    cycles["q_c"][0, 0] -= off
    report = check_sent(replace(sine, cycles=cycles), distance=None)
    assert report.ok
    assert any("absorbed this" in note for note in report.motion.notes) is is_absorbed
    cycles["faults"][np.flatnonzero(cycles["played"])[0] :] = 1
    assert check_sent(replace(sine, cycles=cycles), distance=None).ok is (off < 5e-6)


def test_a_pose_next_to_the_arm_that_the_controller_accepted_conforms() -> None:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.start_move(wire.CARTESIAN_POSITION, wire.CARTESIAN)
        count = 0

        def callback(state: wire.State) -> Output:
            nonlocal count, pose
            if not count:
                pose = kinematics.matrix(state.pos_m)
                pose[1, 3] += 1e-6  # [m]
            count += 1
            return Output(pose=tuple(pose.ravel().tolist()), psi=state.psi_m[0], finished=count == 100)

        pose = np.eye(4)
        robot.control(callback)
        run = as_run(collect(motions, 2)[1])
    assert not run.faults
    assert check_sent(run, distance=None).ok


def recorded_torques(torques: list[float], joint: int = 7) -> Run:
    """Commands torques of a joint, [N m], until the controller stops the arm."""
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.start_move(wire.TORQUE, wire.JOINT)
        left = iter(torques)
        with pytest.raises(ControlException):
            robot.control(lambda state: Output(tau=(0.0,) * (joint - 1) + (next(left),) + (0.0,) * (7 - joint)))
        return as_run(collect(motions, 2)[1])


def test_torques_are_checked_up_to_the_state_for_which_the_controller_stopped_the_arm() -> None:
    run = recorded_torques([min(0.002 * step, 0.4) for step in range(600)])
    assert [fault.name for fault in run.faults] == ["ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION"]
    (violation,) = check_sent(run, distance=None).violations
    assert (violation.condition.id, violation.joint) == ("measured.joint.velocity", 7)


def test_torques_after_the_stop_are_not_checked() -> None:
    run = recorded_torques([min(0.002 * step, 0.4) for step in range(600)])
    cycles = run.cycles.copy()
    after = np.flatnonzero(cycles["faults"])[0] + 3
    cycles["command_tau"][after], cycles["sent_ns"][after] = 50.0, 1
    (violation,) = check_sent(replace(run, cycles=cycles), distance=None).violations
    assert violation.condition.id == "measured.joint.velocity"


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e308])
def test_torques_that_are_not_numbers_do_not_conform(value: float) -> None:
    report = check_sent(recorded_torques([0.0] * 50 + [value] * 100), distance=None)
    broken = {"torque.rate", "torque.range"} if np.isfinite(value) else {"torque.range"}
    assert {violation.condition.id for violation in report.violations} == broken
    assert report.violations[0].time == pytest.approx(50 * CYCLE_TIME)


def test_a_stop_for_a_torque_after_a_lost_one_is_explained() -> None:
    run = recorded_torques([0.0] * 50 + [4.0] * 100, joint=1)  # The client's filter makes 1.54 N m of it.
    assert [fault.name for fault in run.faults] == ["COMMAND_TORQUE_DISCONTINUITY"]
    assert not check_sent(run, distance=None).ok
    cycles = run.cycles.copy()
    lost = np.flatnonzero(cycles["played"])[49]
    row = lost - int(cycles["age"][lost])
    cycles["command_tau"][row], cycles["sent_ns"][row] = np.nan, 0
    cycles["played"][lost], cycles["missed"][lost] = 0, 1
    report = check_sent(replace(run, cycles=cycles), distance=None)
    assert report.ok
    missing, *_, stopped = report.motion.notes
    assert missing.startswith("1 command is missing in the record")
    assert stopped.startswith("the controller stopped it for kCommandTorqueDiscontinuity")
    assert "had counted 1 cycle without a command" in stopped


def counting(run: Run) -> tuple[Run, np.ndarray]:
    """The same commands of a client that counts on its own; returns the rows of its commands, too."""
    cycles = run.cycles.copy()
    rows = np.flatnonzero(cycles["sent_ns"])
    cycles["command_number"][rows] = 10**7 + rows
    return replace(run, cycles=cycles), rows


def test_a_lost_command_between_neighbouring_rows_is_interpolated(sine: Run) -> None:
    """An earlier command was recorded one row on, and so all up to the lost one."""
    run, rows = counting(sine)
    cycles, lost = run.cycles, 400
    at = np.flatnonzero(cycles["played"])
    source = at - cycles["age"][at].astype(int)
    for name in ("command", "command_number"):
        cycles[name][rows[100] + 1 : rows[lost] + 1] = cycles[name][rows[100] : rows[lost]].copy()
    cycles["sent_ns"][rows[100]], cycles["command"][rows[100]] = 0, np.nan
    cycles["age"][at[(source >= rows[100]) & (source < rows[lost])]] -= 1
    (hole,) = at[source == rows[lost]]
    cycles["played"][hole], cycles["missed"][hole] = 0, 1
    motion = sent_motion(run)
    assert motion.notes == ("1 command is missing in the record and interpolated: it never came, or came too late",)
    np.testing.assert_allclose(motion.q, sent_motion(sine).q, atol=1e-7)


def test_late_commands_in_rows_of_each_other_are_in_the_order_of_the_client(sine: Run) -> None:
    run, rows = counting(sine)
    cycles, first, second = run.cycles, rows[400], rows[406]
    at = np.flatnonzero(cycles["played"])
    holes = at[np.isin(at - cycles["age"][at].astype(int), (first, second))]
    cycles["played"][holes], cycles["missed"][holes] = 0, 1
    for name in ("command", "command_number"):
        cycles[name][[first, second]] = cycles[name][[second, first]]
    np.testing.assert_array_equal(sent_motion(run).q, sent_motion(sine).q)


def test_a_file_of_an_earlier_version_is_checked_alike(sine: Run, tmp_path: Path) -> None:
    names = [name for name in sine.cycles.dtype.names or () if name not in ("command_number", *RATE_FIELDS)]
    replace(sine, cycles=repack_fields(sine.cycles[names])).save(tmp_path / "a.rcirun")
    np.testing.assert_array_equal(sent_motion(load_run(tmp_path / "a.rcirun")).q, sent_motion(sine).q)


def test_the_soft_limits_in_force_are_checked(sine: Run) -> None:
    upper = MODEL.limits.joint.upper.copy()
    upper[1] = sent_motion(sine).q[:, 1].max() - 0.01
    settings = {**sine.setup.settings, "joint_upper": upper.tolist()}
    report = check_sent(replace(sine, setup=replace(sine.setup, settings=settings)), distance=None)
    (violation,) = report.violations
    assert (violation.condition.id, violation.joint) == ("joint.position", 2)
    assert check_sent(sine, distance=None).ok


def test_a_compliant_start_that_the_controller_refused_does_not_conform() -> None:
    run = recorded_poses([(0.0, 0.1, 0.0)] * 100, wire.CARTESIAN_IMPEDANCE)
    assert run.setup.mode == "cartesian_impedance"
    report = check_sent(run)
    assert "cartesian.velocity.translation" in {violation.condition.id for violation in report.violations}
    (start,) = (row for row in report.rows if row.id == "start.cartesian.position")
    assert start.value == pytest.approx(0.1)


def test_a_stop_of_poses_takes_as_long_as_its_speed_needs() -> None:
    path = MODEL.home + 1e-6 * np.arange(200)[:, np.newaxis] * np.ones(7)
    slow = with_stop(Motion.from_cycles(path), MODEL, "cartesian_position")
    fast = with_stop(Motion.from_cycles(path[0] + 400.0 * (path - path[0])), MODEL, "cartesian_position")
    assert 0.199 < slow.duration < 0.22
    assert 0.3 < fast.duration < 0.7


def test_a_run_without_its_beginning_is_checked_in_mid_motion(sine: Run) -> None:
    whole = check_sent(sine, distance=None)
    cycles = sine.cycles[350:].copy()
    cycles["t"] -= cycles["t"][0]
    cut = check_sent(replace(sine, cycles=cycles, truncated=True), distance=None)
    assert cut.ok
    for name in ("joint.acceleration", "joint.jerk"):
        (before,) = (row for row in whole.rows if row.id == name)
        (after,) = (row for row in cut.rows if row.id == name)
        assert after.ratio <= before.ratio + 1e-6


def test_poses_without_their_beginning_are_checked_in_mid_motion() -> None:
    with watched() as (place, motions), place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        programs.line(robot, SECONDS, period=SECONDS)
        line = as_run(collect(motions, 2)[1])
    assert check_sent(line, distance=None).ok
    cycles = line.cycles[350:].copy()
    cycles["t"] -= cycles["t"][0]
    assert check_sent(replace(line, cycles=cycles, truncated=True), distance=None).ok
