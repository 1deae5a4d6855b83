"""Hand guiding through the control process: the arm goes where it is pushed, and the phase says so all the while."""

from __future__ import annotations

import time

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.errors import CommandRejectedError, ControlError, InvalidValueError, UsageError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for

MODEL = load_model("xMatePro7")


@pytest.fixture(scope="module")
def shared():
    with Supervisor(MODEL, plant="mujoco") as supervisor:
        supervisor.power_on().wait(SOON)
        yield supervisor


@pytest.fixture
def supervisor(shared):
    wait_for(lambda: shared.status().phase == "idle" and shared.status().powered)
    return shared


@pytest.fixture
def world(supervisor):
    host, _, port = supervisor.status().world_address.partition(":")
    with SimulationControl(host, int(port)) as world:
        yield world


def test_a_guided_arm_goes_where_it_is_pushed_and_stays_where_it_is_let_go(supervisor, world):
    start = supervisor.status().q
    supervisor.start_guiding().wait(SOON)
    assert (supervisor.status().phase, supervisor.status().code) == ("moving", "moving.guided")
    world.push([0.0, 20.0, 0.0, 0.0, 0.0, 0.0], duration=0.5)
    wait_for(lambda: abs(supervisor.status().q[0] - start[0]) > 0.05)
    supervisor.stop_guiding().wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.guided", ())
    q = supervisor.status().q_c
    time.sleep(0.1)
    assert np.abs(supervisor.status().q - q).max() < 1e-2


def test_a_push_is_felt_while_the_arm_stands(supervisor, world):
    world.push([0.0, 0.0, -15.0, 0.0, 0.0, 0.0], duration=5.0)
    wait_for(lambda: supervisor.status().tau_ext[2] < -5.0)
    world.release()
    wait_for(lambda: abs(supervisor.status().tau_ext[2]) < 5.0)
    assert supervisor.status().phase == "idle"


def test_stop_ends_guiding(supervisor):
    supervisor.start_guiding("cartesian", "translation").wait(SOON)
    with pytest.raises(UsageError, match="moving"):
        supervisor.jog("joint", np.zeros(7))
    with pytest.raises(UsageError, match="moving"):
        supervisor.start_guiding()
    supervisor.stop().wait(SOON)
    assert supervisor.status().code == "idle.stopped"
    assert supervisor.status().robot_mode.name == "IDLE"


def test_an_emergency_stop_ends_guiding_and_the_phase_follows(supervisor, world):
    supervisor.start_guiding().wait(SOON)
    world.press("estop")
    wait_for(lambda: supervisor.status().phase != "moving")
    world.press("none")
    supervisor.power_on().wait(SOON)
    wait_for(lambda: supervisor.status().phase == "idle")


def test_an_emergency_stop_in_mid_motion_is_what_status_and_error_name(supervisor, world):
    q = supervisor.status().q_c
    motion = plan_joint(MODEL, q, q + 0.3, speed=0.2)
    supervisor.drain()
    ticket = supervisor.execute(motion, check(motion, MODEL).certificate)
    wait_for(lambda: supervisor.status().phase == "moving" and np.abs(supervisor.status().q_c - q).max() > 0.01)
    world.press("estop")
    with pytest.raises(ControlError, match="an emergency stop is pressed") as caught:
        ticket.wait(SOON)
    assert (caught.value.code, caught.value.facts["status"]) == ("safety_stop", "estop")
    assert supervisor.status().code == "fault.pressed"
    rows = supervisor.drain()
    rows = rows[np.isfinite(rows["t"])]
    assert (np.diff(rows["message_id"].astype(int)) == 1).all(), "a cycle of the controller's stop has no record"
    with pytest.raises(CommandRejectedError, match="an emergency stop is pressed: release it first"):
        supervisor.power_on().wait(SOON)
    world.press("none")
    wait_for(lambda: supervisor.status().code == "fault.released")
    supervisor.recover().wait(SOON)
    supervisor.power_on().wait(SOON)
    wait_for(lambda: supervisor.status().phase == "idle")


@pytest.mark.parametrize(("space", "kind"), [("tool", "free"), ("cartesian", "turn")])
def test_an_unknown_way_to_guide_lists_those_there_are(supervisor, space, kind):
    with pytest.raises(InvalidValueError, match="known: "):
        supervisor.start_guiding(space, kind)


def test_guiding_ends_when_nobody_is_at_the_controls(supervisor):
    supervisor.set_operator_present(True)
    supervisor.start_guiding().wait(SOON)
    wait_for(lambda: supervisor.status().code == "idle.operator")
