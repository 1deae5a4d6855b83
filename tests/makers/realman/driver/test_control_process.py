"""The control process drives an RM65: motion, stop, limits that are set in the controller, emergency stop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.app.setup.configuration_state import describe_held
from rcilab.app.text import Text
from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.errors import ControlError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration, SoftJointLimits
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")


@pytest.fixture(scope="module")
def shared() -> Iterator[Supervisor]:
    with Supervisor(load_model("RM65")) as supervisor:
        yield supervisor


@pytest.fixture
def supervisor(shared: Supervisor) -> Supervisor:
    wait_for(lambda: shared.status().phase in ("idle", "fault"))
    shared.recover().wait(SOON)
    shared.power_on().wait(SOON)
    shared.drain()
    return shared


def begin(supervisor, off, speed):
    model, q = supervisor.model, supervisor.status().q_c
    motion = plan_joint(model, q, model.home + off, speed=speed)
    return motion, supervisor.execute(motion, check(motion, model, start=q).certificate)


def await_motion(supervisor):
    wait_for(lambda: (now := supervisor.status()).phase == "moving" and (now.motion_time or 0.0) > 0.1)


def test_a_motion_arrives_and_one_is_stopped(supervisor):
    motion, request = begin(supervisor, 0.2, speed=0.3)
    request.wait(SOON)
    status = supervisor.status()
    assert (status.phase, status.code, status.faults) == ("idle", "idle.arrived", ())
    assert np.abs(status.q_c - motion.q[-1]).max() <= 1e-5
    _, request = begin(supervisor, -0.2, speed=0.1)
    await_motion(supervisor)
    supervisor.stop().wait(SOON)
    with pytest.raises(ControlError, match="stopped on request"):
        request.wait(SOON)
    assert supervisor.status().code == "idle.stopped"


def test_limits_that_are_set_are_those_of_its_arm(supervisor):
    own = supervisor.model.limits.joint.velocity
    slower = tuple((0.5 * own).tolist())
    supervisor.configure(RobotConfiguration(control=ControllerParameters(joint_velocity=slower))).wait(SOON)
    assert np.array_equal(supervisor.model.limits.joint.velocity, slower)
    begin(supervisor, 0.1, speed=0.3)[1].wait(SOON)


def test_the_ranges_and_limits_that_the_controller_reports_are_shown(supervisor):
    def held(part):
        return Text("en").render(describe_held(supervisor.status(), part))

    assert held("joints").startswith("-178")
    own = supervisor.model.limits.joint
    upper = (1.0, *own.upper[1:].tolist())
    supervisor.configure(RobotConfiguration(joints=SoftJointLimits(lower=tuple(own.lower), upper=upper))).wait(SOON)
    assert held("joints").startswith("-178…57,")
    control = supervisor.status().reported.control
    assert control["tool_limits"] == pytest.approx((0.25, 1.6, 0.6, 4.0))
    assert control["joint_acceleration"] == pytest.approx(own.acceleration.tolist(), rel=1e-3)


def test_an_emergency_stop_is_shown_until_its_release(supervisor):
    host, _, port = (supervisor.status().world_address or "").partition(":")
    with SimulationControl(host, int(port)) as world:
        _, request = begin(supervisor, -0.2, speed=0.1)
        await_motion(supervisor)
        world.press("estop")
        with pytest.raises(ControlError, match="the emergency stop is pressed"):
            request.wait(SOON)
        wait_for(lambda: supervisor.status().is_pressed)
        world.press("none")
    supervisor.power_on().wait(SOON)
    begin(supervisor, 0.0, speed=0.2)[1].wait(SOON)
