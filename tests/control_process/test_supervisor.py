"""The supervisor with its control process and the real virtual controller, free-running."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.speed_scaling_check import plan_start_with_override
from rcilab.control_process import Supervisor
from rcilab.control_process.launch import start_controller
from rcilab.core.errors import (
    CertificateError,
    ConnectionLostError,
    ControlError,
    InvalidValueError,
    ModelError,
    UsageError,
)
from rcilab.core.state import RobotMode
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for

MODEL = load_model("xMatePro7")
GOAL = np.array([0.3, 0.4, 0.2, 1.2, 0.1, 0.8, 0.5])


def wait_for_phase(supervisor, *phases):
    return wait_for(lambda: status if (status := supervisor.status()).phase in phases else None)


def begin(supervisor, goal=GOAL, speed=0.1):
    motion = plan_joint(MODEL, supervisor.status().q_c, goal, speed=speed)
    ticket = supervisor.execute(motion, check(motion, MODEL).certificate)
    return motion, ticket


def go_home(supervisor):
    if supervisor.status().faults:
        supervisor.recover().wait(SOON)
    supervisor.power_on().wait(SOON)
    begin(supervisor, MODEL.home, speed=1.0)[1].wait(SOON)


@pytest.fixture(scope="module")
def shared():
    with Supervisor(MODEL) as supervisor:
        yield supervisor


@pytest.fixture
def supervisor(shared):
    go_home(shared)
    shared.drain()
    return shared


def test_a_motion_arrives_and_every_cycle_of_it_is_in_the_drain(supervisor):
    assert supervisor.status().phase == "idle"
    motion, ticket = begin(supervisor, speed=0.7)
    ticket.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code) == ("idle", "idle.arrived")
    assert np.abs(status.q - GOAL).max() <= 1e-12
    assert status.motion_duration == motion.duration
    rows = supervisor.drain()
    moving = rows[np.isfinite(rows["t"])]
    # Controller cycles that this machine lost are left out of the rows and counted in `lost`, never repeated.
    steps = np.diff(moving["message_id"].astype(int))
    assert (steps >= 1).all()
    assert steps.sum() == moving["lost"][1:].sum() + len(moving) - 1
    assert moving["t"][0] == 0.0
    sent = moving[moving["sent_ns"] > 0]
    index = np.minimum(np.rint(sent["t"] * 1000).astype(int), len(motion.q) - 1)
    assert np.array_equal(sent["command"], motion.q[index])


def test_status_says_what_runs_and_how_punctual_it_is(supervisor):
    status = wait_for(lambda: s if (s := supervisor.status()).rate_hz > 0 else None)
    assert status.controller_pid
    assert status.worker_pid
    assert status.scheduling in ("SCHED_FIFO", "normal")
    assert status.address.startswith("rci://127.0.0.2:")
    assert status.powered is True
    assert status.robot_mode is RobotMode.IDLE
    assert status.lateness.p50 <= status.lateness.p99 <= status.lateness.p999 <= status.lateness.max
    assert status.lateness.histogram.sum() == status.lateness.cycles > 0


def test_of_a_resting_arm_every_state_is_recorded_and_one_in_five_is_waited_for(supervisor):
    supervisor.drain()
    number = supervisor.status().message_id
    wait_for(lambda: supervisor.status().message_id > number + 300)
    rows = supervisor.drain()
    assert np.isnan(rows["t"]).all()
    assert (np.diff(rows["message_id"].astype(int)) == 1 + rows["lost"][1:]).all()
    assert 0.02 < np.isfinite(rows["lateness"]).mean() < 0.5


def test_libraries_are_loaded_before_the_first_state_and_not_by_the_first_motion():
    with Supervisor(MODEL) as fresh:
        loaded = Path(f"/proc/{fresh.status().worker_pid}/maps").read_text(encoding="utf-8")
        for library in ("pinocchio", "ruckig"):
            assert library in loaded


def test_stop_ends_in_one_controlled_stop_and_the_next_motion_can_begin(supervisor):
    _, ticket = begin(supervisor)
    # One snapshot: the time of one and the phase of the next belong to two motions.
    wait_for(lambda: (now := supervisor.status()).phase == "moving" and (now.motion_time or 0.0) > 0.3)
    supervisor.stop().wait(SOON)
    with pytest.raises(ControlError, match="stopped on request"):
        ticket.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.stopped", ())
    assert np.abs(status.q_c - GOAL).max() > 0.01
    assert_in_limits(supervisor.drain())
    go_home(supervisor)
    assert np.array_equal(supervisor.status().q_c, MODEL.home)


def test_a_stop_without_a_motion_is_done_and_stops_nothing_later(supervisor):
    supervisor.stop().wait(SOON)
    begin(supervisor, speed=1.0)[1].wait(SOON)
    assert np.abs(supervisor.status().q - GOAL).max() <= 1e-12


def test_a_stop_while_a_motion_is_judged_for_the_last_time_keeps_the_arm_where_it_is(supervisor, monkeypatch):
    def stopped_meanwhile(*args):
        supervisor.stop().wait(SOON)
        return plan_start_with_override(*args)

    monkeypatch.setattr("rcilab.control_process.supervisor.plan_start_with_override", stopped_meanwhile)
    with pytest.raises(UsageError, match="a stop was requested before the arm had started to move"):
        begin(supervisor)
    monkeypatch.undo()
    assert supervisor.status().phase == "idle"
    assert np.array_equal(supervisor.status().q_c, MODEL.home)
    begin(supervisor, speed=1.0)[1].wait(SOON)
    assert np.abs(supervisor.status().q - GOAL).max() <= 1e-12


def test_what_was_wanted_before_a_stop_moves_nothing(supervisor):
    wanted = supervisor.stops
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    supervisor.stop().wait(SOON)
    for ask in (
        lambda: supervisor.execute(motion, check(motion, MODEL).certificate, stops=wanted),
        lambda: supervisor.jog("joint", [0.1, 0, 0, 0, 0, 0, 0], stops=wanted),
        lambda: supervisor.start_guiding(stops=wanted),
    ):
        with pytest.raises(UsageError, match="a stop was requested before") as caught:
            ask()
        assert caught.value.code == "stopped_before"
    assert supervisor.status().phase == "idle"


def test_requests_in_mid_motion_are_refused_and_disturb_nothing(supervisor):
    _, ticket = begin(supervisor, speed=0.5)
    wait_for_phase(supervisor, "moving")
    with pytest.raises(UsageError, match="the arm is moving"):
        supervisor.power_off().wait(SOON)
    motion = plan_joint(MODEL, supervisor.status().q_c, GOAL)
    with pytest.raises(UsageError, match="the arm is moving"):
        supervisor.execute(motion, check(motion, MODEL).certificate)
    ticket.wait(SOON)
    assert np.abs(supervisor.status().q - GOAL).max() <= 1e-12


def test_a_missing_or_stale_certificate_is_refused_at_once(supervisor):
    q = supervisor.status().q_c
    motion, other = plan_joint(MODEL, q, GOAL), plan_joint(MODEL, q, GOAL, speed=0.2)
    with pytest.raises(CertificateError, match="has not been checked"):
        supervisor.execute(motion, None)
    with pytest.raises(CertificateError) as caught:
        supervisor.execute(motion, check(other, MODEL).certificate)
    assert "motion" in caught.value.changed
    gentle = plan_joint(MODEL, q, GOAL, speed=0.1)
    with pytest.raises(CertificateError, match="checked for the mode cartesian_position"):
        supervisor.execute(gentle, check(gentle, MODEL, mode="cartesian_position").require().certificate)
    away = plan_joint(MODEL, GOAL, MODEL.home)
    with pytest.raises(CertificateError, match=r"and is at .* plan the motion from robot\.state\.q_c") as caught:
        supervisor.execute(away, check(away, MODEL).certificate)
    assert caught.value.changed == ("start state",)


def test_nobody_at_the_controls_ends_a_motion_after_two_seconds():
    with Supervisor(MODEL) as supervisor:
        supervisor.power_on().wait(SOON)
        supervisor.set_operator_present(True)
        _, ticket = begin(supervisor, speed=0.03)
        with pytest.raises(ControlError, match="no operator was present"):
            ticket.wait(SOON)
        status = supervisor.status()
        assert (status.phase, status.code, status.faults) == ("idle", "idle.operator", ())
        assert status.motion_time > 1.0
        with pytest.raises(UsageError, match="the operator's page does not respond"):
            begin(supervisor)
        supervisor.set_operator_present(True)
        begin(supervisor, MODEL.home, speed=1.0)
    assert supervisor.status().phase == "closed"
    supervisor.close()


def test_an_unreachable_robot_is_a_phase_with_a_reason_and_not_an_error():
    with Supervisor(MODEL, "rci://127.0.0.2:9") as supervisor:
        status = supervisor.status()
        assert (status.phase, status.code) == ("lost", "lost.unreachable")
        assert "no robot at rci://127.0.0.2:9" in status.message
        with pytest.raises(UsageError, match="no motion is possible now"):
            begin_nowhere(supervisor)
        with pytest.raises(UsageError, match="no controller is connected"):
            supervisor.power_on().wait(SOON)
        with pytest.raises(ConnectionLostError, match="no robot at"):
            supervisor.reconnect().wait(SOON)


def test_wrong_use_is_named():
    with pytest.raises(InvalidValueError, match="needs rci://"):
        Supervisor(MODEL, "tcp://127.0.0.2")
    supervisor = Supervisor(MODEL)
    assert supervisor.status().phase == "closed"
    for call in (supervisor.power_on, supervisor.stop, supervisor.drain, supervisor.restart):
        with pytest.raises(UsageError, match=r"start\(\) it first"):
            call()
    with pytest.raises(UsageError, match=r"no motion is possible now: The supervisor is closed"):
        begin_nowhere(supervisor)
    with pytest.raises(InvalidValueError, match=r"known: ideal, mujoco"):
        Supervisor(MODEL, plant="rubber")
    with pytest.raises(InvalidValueError, match="use load_model"):
        Supervisor("xMatePro7")


def test_another_arm_than_the_controller_s_is_refused_and_both_are_named():
    controller = start_controller("xMatePro7")
    try:
        with Supervisor(load_model("xMate3"), controller.address) as supervisor:
            status = supervisor.status()
            assert (status.phase, status.code) == ("lost", "lost.other_arm")
            assert "is an xMatePro7 (7 axes), you gave xMate3 (6)" in status.message
            with pytest.raises(ModelError, match="xMatePro7"):
                supervisor.reconnect().wait(SOON)
    finally:
        controller.end()


def begin_nowhere(supervisor):
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    return supervisor.execute(motion, check(motion, MODEL).certificate)


def assert_in_limits(rows):
    """What was commanded keeps velocity, acceleration and jerk limits wherever cycles follow each other."""
    sent = rows[(rows["sent_ns"] > 0) & np.isfinite(rows["command"]).all(axis=1)]
    whole = np.diff(sent["message_id"].astype(int)) == 1
    assert whole.sum() > 50
    limits = MODEL.limits.joint
    for order, bound in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
        differences = np.abs(np.diff(sent["command"], order, axis=0)) / 1e-3**order
        runs = np.array([whole[k : k + order].all() for k in range(len(differences))])
        assert (differences[runs] < bound).all()
