"""The control process drives Franka's arms by their client libraries: motion, stop, user stop, error, jog."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.errors import CommandRejectedError, ControlError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.makers.franka.driver.conftest import ARMS
from tests.waiting import SOON, wait_for


@pytest.fixture(scope="module", params=ARMS)
def shared(request):
    with Supervisor(load_model(request.param)) as supervisor:
        yield supervisor


@pytest.fixture
def supervisor(shared):
    wait_for(lambda: shared.status().phase in ("idle", "fault"))
    if shared.status().faults:
        shared.recover().wait(SOON)
    shared.power_on().wait(SOON)
    shared.drain()
    return shared


def begin(supervisor, off, speed):
    model, q = supervisor.model, supervisor.status().q_c
    motion = plan_joint(model, q, model.home + off, speed=speed)
    return motion, supervisor.execute(motion, check(motion, model, start=q).certificate)


@pytest.fixture
def world(supervisor):
    host, _, port = supervisor.status().world_address.partition(":")
    control = SimulationControl(host, int(port))
    yield control
    control.close()


def test_a_motion_arrives_and_idle_states_are_not_lost_ones(supervisor):
    motion, request = begin(supervisor, 0.2, speed=0.7)
    request.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.arrived", ())
    assert np.abs(status.q_c - motion.q[-1]).max() <= 3e-7
    rows = supervisor.drain()
    sent = rows[rows["sent_ns"] > 0]
    index = np.minimum(np.rint(sent["t"] * 1000).astype(int), len(motion.q) - 1)
    assert np.array_equal(sent["command"], motion.q[index])
    lost = supervisor.status().lost_cycles
    time.sleep(0.3)
    assert supervisor.status().lost_cycles == lost


def test_a_stop_ends_a_motion_and_the_next_one_can_begin(supervisor):
    _, request = begin(supervisor, -0.2, speed=0.1)
    wait_for(lambda: (now := supervisor.status()).phase == "moving" and (now.motion_time or 0.0) > 0.2)
    supervisor.stop().wait(SOON)
    with pytest.raises(ControlError, match="stopped on request"):
        request.wait(SOON)
    assert supervisor.status().code == "idle.stopped"
    begin(supervisor, 0.1, speed=0.7)[1].wait(SOON)
    assert supervisor.status().code == "idle.arrived"


def test_a_jog_moves_a_joint_while_it_is_held(supervisor):
    start = supervisor.status().q_c.copy()
    while supervisor.status().q_c[0] < start[0] + 0.05:
        request = supervisor.jog("joint", [0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        time.sleep(0.05)
    supervisor.release_jog()
    request.wait(SOON)
    assert supervisor.status().code == "idle.jogged"
    assert np.abs((supervisor.status().q_c - start)[1:]).max() <= 1e-6


def test_the_user_stop_shows_and_power_cannot_be_switched_off(supervisor, world):
    world.press("estop")
    wait_for(lambda: supervisor.status().powered is False)
    with pytest.raises(CommandRejectedError, match="the user stop is pressed"):
        supervisor.power_on().wait(SOON)
    world.press("none")
    supervisor.power_on().wait(SOON)
    with pytest.raises(CommandRejectedError, match="cannot switch motor power"):
        supervisor.power_off().wait(SOON)
    assert supervisor.status().powered is True


def test_a_reflex_is_a_fault_until_the_recovery(supervisor, world):
    _, request = begin(supervisor, -0.3, speed=0.05)
    wait_for(lambda: (now := supervisor.status()).phase == "moving" and (now.motion_time or 0.0) > 0.1)
    world.push([0.0, 0.0, -60.0, 0.0, 0.0, 0.0], rise_time=0.0)
    with pytest.raises(ControlError, match="cartesian_reflex"):
        request.wait(SOON)
    assert [fault.manual_name for fault in supervisor.status().faults][-1] == "cartesian_reflex"
    assert supervisor.status().phase == "fault"
    world.release()
    supervisor.recover().wait(SOON)
    assert (supervisor.status().phase, supervisor.status().faults) == ("idle", ())
