"""Signals of a program through the control process: what the page sees of them."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.errors import DeadlineError, UsageError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint, plan_program
from tests.waiting import SOON, wait_for

MODEL = load_model("xMatePro7")


@pytest.fixture(scope="module")
def shared():
    with Supervisor(MODEL) as supervisor:
        supervisor.power_on().wait(SOON)
        host, _, port = supervisor.status().world_address.partition(":")
        with SimulationControl(host, int(port)) as world:
            yield supervisor, world


def execute(supervisor, *steps, speed_override=1.0):
    q = supervisor.status().q_c
    motion = plan_program(MODEL, Program(model=MODEL.name, start=tuple(q), waypoints=steps))
    certificate = check(motion, MODEL).require().certificate
    return motion, supervisor.execute(motion, certificate, speed_override=speed_override)


def test_outputs_and_the_awaited_input_are_in_the_status_and_the_wait_in_the_motion(shared):
    supervisor, world = shared
    world.set_input(3, False)
    to, back = (Waypoint.joint(np.array(MODEL.home) + step, speed=0.3) for step in (0.05, 0.0))
    steps = (to, Waypoint.set_output(1), Waypoint.await_input(3, timeout=60.0), back, Waypoint.set_output(1, False))
    motion, request = execute(supervisor, *steps)
    wait_for(lambda: supervisor.status().awaited == 3)
    status = supervisor.status()
    assert status.code == "moving"
    assert status.outputs[1] is True
    assert status.motion_plan_time == pytest.approx(motion.events[1].time, abs=0.03)
    assert supervisor.set_speed_override(0.5).wait(SOON) is None
    world.set_input(3, True)
    request.wait(SOON)
    status, scaled = supervisor.status(), supervisor.scaled_motion
    assert status.awaited is None
    assert status.outputs[1] is False
    assert scaled is not None
    assert scaled.duration > motion.duration
    held = np.diff(scaled.plan_time) == 0.0
    assert held.sum() > 5
    assert np.allclose(scaled.q[:-1][held], scaled.q[np.flatnonzero(held)[0]])
    assert np.allclose(status.q_c, motion.goal, atol=1e-9)


def test_a_late_input_and_a_missing_signal_are_errors_of_the_request(shared):
    supervisor, world = shared
    world.set_input(0, False)
    step = Waypoint.joint(supervisor.status().q_c + 0.02, speed=0.3)
    _, request = execute(supervisor, step, Waypoint.await_input(0, timeout=0.1))
    with pytest.raises(DeadlineError, match=r"step 2: input DI0_0 was not on within 0\.1 s"):
        request.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.awaited) == ("idle", None)
    with pytest.raises(UsageError, match="output 6 of xMatePro7 does not exist"):
        execute(supervisor, Waypoint.set_output(6), Waypoint.wait(0.1))
