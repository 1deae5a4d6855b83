"""The five modes, pauses and paces through the control process and the virtual controller."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.errors import CertificateError, CommandRejectedError, InvalidValueError, UsageError
from rcilab.core.state import ControllerMode
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for

MODEL = load_model("xMatePro7")
WAY = np.array([0.2, 0.1, -0.1, 0.1, 0.1, 0.1, 0.2])


@pytest.fixture(scope="module")
def shared():
    with Supervisor(MODEL) as supervisor:
        supervisor.power_on().wait(SOON)
        yield supervisor


@pytest.fixture
def supervisor(shared):
    wait_for(lambda: shared.status().phase == "idle")
    shared.drain()
    return shared


def planned(supervisor, mode="joint_position", speed=0.3, size=1.0):
    """Returns a motion to and fro, and its certificate."""
    q = supervisor.status().q_c
    goal = q + (size if q[0] < 0.1 else -size) * WAY
    motion = plan_joint(MODEL, q, goal, speed=speed)
    report = check(motion, MODEL, mode=mode)
    report.require()
    return motion, report.certificate


def wait_until_at(supervisor, place):
    wait_for(lambda: supervisor.status().phase == "moving" and (supervisor.status().motion_time or 0.0) > place)


def moved_rows(supervisor):
    rows = supervisor.drain()
    return rows[np.isfinite(rows["t"])]


@pytest.mark.parametrize(
    ("mode", "speed", "near"),
    [
        ("joint_impedance", 0.3, 0.02),
        ("cartesian_position", 0.2, 1e-6),
        ("cartesian_impedance", 0.2, 0.05),
        ("torque", 0.05, 0.05),
    ],
)
def test_the_same_way_in_every_mode(supervisor, mode, speed, near):
    motion, certificate = planned(supervisor, mode, speed)
    supervisor.execute(motion, certificate, mode).wait(SOON)
    status = supervisor.status()
    assert (status.code, status.mode, status.faults) == ("idle.arrived", mode, ())
    away = MODEL.forward(status.q).position - MODEL.forward(motion.goal).position  # The elbow may lag more.
    assert np.linalg.norm(away) < near
    assert set(moved_rows(supervisor)["controller_mode"]) == {int(ControllerMode[mode.upper()])}


def test_a_certificate_is_for_its_mode(supervisor):
    motion, certificate = planned(supervisor)
    with pytest.raises(CertificateError, match="mode"):
        supervisor.execute(motion, certificate, "cartesian_position")
    with pytest.raises(InvalidValueError, match="torque"):
        supervisor.execute(motion, certificate, "sideways")


@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position"])
def test_held_gone_on_with_slower_and_arrived(supervisor, mode):
    motion, certificate = planned(supervisor, mode, 0.1, 4.0)
    ticket = supervisor.execute(motion, certificate, mode)
    wait_until_at(supervisor, 0.3)
    supervisor.pause().wait(SOON)
    assert supervisor.status().code == "moving.held"
    assert supervisor.status().speed_override == 0.0
    wait_for(lambda: not supervisor.status().dq.any())
    place = supervisor.status().motion_plan_time
    time.sleep(0.05)
    assert supervisor.status().motion_plan_time == place < motion.duration
    supervisor.resume(0.6).wait(SOON)
    assert supervisor.status().code == "moving"
    wait_for(lambda: supervisor.status().motion_plan_time > place + 0.1)
    supervisor.set_speed_override(1.0).wait(SOON)
    ticket.wait(SOON)
    assert supervisor.status().faults == ()
    assert supervisor.status().q_c == pytest.approx(motion.goal, abs=1e-7)
    rows = moved_rows(supervisor)
    sent = supervisor.scaled_motion.q[
        np.rint(rows["t"] * 1e3).astype(int).clip(max=len(supervisor.scaled_motion.q) - 1)
    ]
    if mode == "joint_position":
        assert np.array_equal(rows["command"], sent)


def test_a_motion_that_is_to_run_slowly_does_so_from_its_first_row_on(supervisor):
    motion, certificate = planned(supervisor)
    with pytest.raises(InvalidValueError, match=r"speed.override"):
        supervisor.execute(motion, certificate, speed_override=0.01)
    ticket = supervisor.execute(motion, certificate, speed_override=0.3)
    wait_until_at(supervisor, 0.2)
    assert supervisor.status().speed_override == 0.3
    assert supervisor.status().motion_plan_time == pytest.approx(0.3 * supervisor.status().motion_time, abs=0.05)
    ticket.wait(SOON)
    assert supervisor.status().q_c == pytest.approx(motion.goal, abs=1e-7)
    rows = moved_rows(supervisor)
    assert len(rows) > len(motion) / 0.31
    sent = rows["command"][np.diff(rows["message_id"], prepend=0) == 1]
    fastest = np.abs(np.diff(sent, axis=0)).max(axis=0) / 1e-3
    assert (fastest < 0.31 * np.abs(motion.dq).max(axis=0)).all()


def test_a_held_motion_is_stopped_as_any_other(supervisor):
    motion, certificate = planned(supervisor, speed=0.1, size=4.0)
    ticket = supervisor.execute(motion, certificate)
    wait_until_at(supervisor, 0.2)
    supervisor.pause().wait(SOON)
    supervisor.stop().wait(SOON)
    assert ticket.done
    assert ticket.error is not None
    assert supervisor.status().code == "idle.stopped"
    with pytest.raises(UsageError, match=r"speed.override"):
        supervisor.resume()


def test_a_motion_in_torques_is_brought_to_rest_along_a_way(supervisor):
    motion, certificate = planned(supervisor, "torque", 0.05, 3.0)
    ticket = supervisor.execute(motion, certificate, "torque")
    wait_until_at(supervisor, 0.5)
    supervisor.stop().wait(SOON)
    assert ticket.error is not None
    status = supervisor.status()
    assert (status.code, status.faults) == ("idle.stopped", ())
    assert np.abs(status.q - motion.goal).max() > 0.05
    rows = moved_rows(supervisor)
    first = int(rows["braking"].argmax())
    assert 500 < first < len(rows) - 1
    assert (rows["braking"][first:] == 1).all()
    assert not supervisor.drain()["braking"].any()  # It stands.


def test_parameters_are_acknowledged_and_told_again(supervisor):
    control = ControllerParameters(joint_stiffness=(250.0,) * 7, filters=(50.0, 40.0, 30.0), desired_wrench=(0.0,) * 6)
    supervisor.configure(RobotConfiguration(control=control)).wait(SOON)
    wait_for(lambda: supervisor.status().setup.control is not None)
    assert supervisor.status().setup.control == control
    times = supervisor.status().setup_times
    supervisor.reconnect().wait(SOON)
    wait_for(lambda: supervisor.status().setup_times > times)
    assert supervisor.status().setup.control == control
    beyond = ControllerParameters(joint_stiffness=(3e4,) * 7)
    ticket = supervisor.configure(RobotConfiguration(control=beyond))
    with pytest.raises((InvalidValueError, CommandRejectedError), match="joint 1"):
        ticket.wait(SOON)
    with pytest.raises(InvalidValueError, match=r"sideways.*known: joint_stiffness"):
        supervisor.configure(RobotConfiguration(control=ControllerParameters(sideways=(1.0,)))).wait(SOON)
    supervisor.configure(RobotConfiguration(control=ControllerParameters(filters=(1000.0,) * 3))).wait(SOON)
