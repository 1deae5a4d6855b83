"""The control process drives an xArm7: motion, pause, stop, jog, hand guiding, signals, emergency stop, error."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.setup.configuration_state import describe_held
from rcilab.app.text import Text
from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.control_process.launch import start_controller
from rcilab.core.errors import ConnectionLostError, ControlError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for


@pytest.fixture(scope="module")
def shared() -> Iterator[Supervisor]:
    with Supervisor(load_model("xArm7")) as supervisor:
        yield supervisor


@pytest.fixture
def supervisor(shared: Supervisor) -> Supervisor:
    wait_for(lambda: shared.status().phase in ("idle", "fault"))
    if shared.status().faults:
        shared.recover().wait(SOON)
    shared.power_on().wait(SOON)
    shared.drain()
    return shared


@pytest.fixture
def world(supervisor: Supervisor) -> Iterator[SimulationControl]:
    host, _, port = (supervisor.status().world_address or "").partition(":")
    with SimulationControl(host, int(port)) as control:
        yield control


def begin(supervisor, off, speed):
    model, q = supervisor.model, supervisor.status().q_c
    motion = plan_joint(model, q, model.home + off, speed=speed)
    return motion, supervisor.execute(motion, check(motion, model, start=q).certificate)


def await_motion(supervisor):
    wait_for(lambda: (now := supervisor.status()).phase == "moving" and (now.motion_time or 0.0) > 0.1)


def test_a_motion_arrives_and_its_rows_are_those_of_the_reports(supervisor):
    motion, request = begin(supervisor, 0.2, speed=0.3)
    request.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.arrived", ())
    assert np.abs(status.q_c - motion.q[-1]).max() <= 3e-7
    rows = supervisor.drain()
    sent = rows[rows["sent_ns"] > 0]
    index = np.minimum(np.rint(sent["t"] * 1000).astype(int), len(motion.q) - 1)
    assert np.array_equal(sent["command"], motion.q[index])
    assert not (np.diff(sent["message_id"]) % 5).any()


def test_the_boundary_is_shown_in_the_whole_millimetres_that_the_controller_keeps(supervisor):
    box = SafetyBox(size=(1.4004, 1.4, 1.4), T_base_box=Pose([0.0, 0.0, 0.5]))
    supervisor.configure(RobotConfiguration(box=box)).wait(SOON)
    held = supervisor.status().reported.box
    assert held is not None
    assert held.active
    np.testing.assert_allclose(held.size, (1.4, 1.4, 1.4), atol=1e-9)
    np.testing.assert_allclose(held.T_base_box.position, (0.0, 0.0, 0.5), atol=1e-9)
    assert Text("en").render(describe_held(supervisor.status(), "box")).startswith("on, 1400 × 1400 × 1400")
    supervisor.configure(RobotConfiguration(box=replace(box, active=False))).wait(SOON)
    assert not supervisor.status().reported.box.active


def test_a_motion_is_paused_on_its_path_and_stopped(supervisor):
    _, request = begin(supervisor, -0.2, speed=0.1)
    await_motion(supervisor)
    supervisor.pause().wait(SOON)
    wait_for(lambda: not np.abs(supervisor.status().dq).max())
    supervisor.resume().wait(SOON)
    supervisor.stop().wait(SOON)
    with pytest.raises(ControlError, match="stopped on request"):
        request.wait(SOON)
    assert supervisor.status().code == "idle.stopped"
    begin(supervisor, 0.1, speed=0.3)[1].wait(SOON)


def test_a_jog_moves_a_joint_while_it_is_held(supervisor):
    start = supervisor.status().q_c.copy()
    request = None
    while supervisor.status().q_c[0] < start[0] + 0.05:
        request = supervisor.jog("joint", [0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        time.sleep(0.05)
    supervisor.release_jog()
    assert request is not None
    request.wait(SOON)
    assert supervisor.status().code == "idle.jogged"


def test_the_arm_is_guided_by_hand_until_it_is_ended(supervisor):
    supervisor.start_guiding().wait(SOON)
    wait_for(lambda: supervisor.status().code == "moving.guided")
    supervisor.stop_guiding().wait(SOON)
    assert supervisor.status().code == "idle.guided"
    begin(supervisor, 0.15, speed=0.3)[1].wait(SOON)


def test_signals_are_set_and_read(supervisor, world):
    world.set_input(2, True)
    supervisor.set_output(3, True).wait(SOON)
    assert supervisor.status().inputs[2]
    world.set_input(2, False)


def test_an_emergency_stop_is_shown_and_recovered_from_after_its_release(supervisor, world):
    _, request = begin(supervisor, -0.2, speed=0.1)
    await_motion(supervisor)
    world.press("estop")
    with pytest.raises(ControlError, match="the emergency stop is pressed"):
        request.wait(SOON)
    wait_for(lambda: supervisor.status().code == "fault.pressed")
    wait_for(lambda: supervisor.status().powered is False)
    world.press("none")
    supervisor.recover().wait(SOON)
    wait_for(lambda: supervisor.status().phase == "idle")
    assert supervisor.status().powered


def test_an_error_while_nothing_moves_is_shown_by_its_name(supervisor, world):
    world.press("gstop")
    wait_for(lambda: supervisor.status().faults == (UfactoryError.EMERGENCY_STOP_INPUT,))
    world.press("none")
    supervisor.recover().wait(SOON)
    assert supervisor.status().faults == ()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_controller_that_ends_or_freezes_in_a_motion_is_a_lost_connection(end):
    controller = start_controller("xArm7")
    with Supervisor(load_model("xArm7"), controller.address or "") as supervisor:
        supervisor.power_on().wait(SOON)
        _, request = begin(supervisor, 0.5, speed=0.05)
        await_motion(supervisor)
        os.kill(controller.pid or 0, end)
        with pytest.raises(ConnectionLostError, match=r"the connection is lost|no state for"):
            request.wait(SOON)
        assert supervisor.status().code == "lost.closed"
    controller.end()
