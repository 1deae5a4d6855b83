"""Tool, load, safety box and force-control frame on their way to the virtual controller, and what it makes of them."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import rcilab
from rcilab.conformance.check import check
from rcilab.control_process import Supervisor
from rcilab.core.command import JointPosition
from rcilab.core.errors import CertificateError, ControlError, InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.configuration import ForceControlFrame, RobotConfiguration
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.wire import ForceFrame
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import SOON, wait_for

MODEL = load_model("xMatePro7")
TOOL = Pose((0.02, -0.01, 0.12), (0.9, 0.1, -0.2, 0.3))
LOAD = Payload(mass=1.5, center_of_mass=(0.0, 0.01, 0.06), inertia=np.diag((0.002, 0.003, 0.004)))
FORCE = ForceControlFrame(T_flange_force=Pose((0.0, 0.0, 0.2)), type=ForceFrame.TOOL)


def box_around(point, edge=0.3):
    return SafetyBox(size=(edge,) * 3, T_base_box=Pose(point))


@pytest.fixture(scope="module")
def supervisor():
    with Supervisor(MODEL) as found:
        found.power_on().wait(SOON)
        yield found


def test_a_configuration_passes_through_pickle():
    setup = RobotConfiguration(tool=TOOL, load=LOAD, box=box_around((0.4, 0.0, 0.5)), force=FORCE)
    back = pickle.loads(pickle.dumps(setup))
    assert back.parts == setup.parts == ("box", "tool", "load", "force")
    assert back.tool.is_close(TOOL, 0.0)
    assert (back.load.mass, back.load.inertia.tolist()) == (1.5, LOAD.inertia.tolist())
    assert back.box.size == setup.box.size
    assert back.force.type is ForceFrame.TOOL
    assert pickle.loads(pickle.dumps(RobotConfiguration())).parts == ()
    assert setup.only(("tool", "box")).parts == ("box", "tool")


def test_the_controller_reports_the_tool_it_was_told_and_again_after_a_new_connection(supervisor):
    supervisor.configure(RobotConfiguration(tool=TOOL, load=LOAD, force=FORCE)).wait(SOON)
    wait_for(lambda: (T := supervisor.status().T_flange_tool) is not None and T.is_close(TOOL, 1e-9))
    status = supervisor.status()
    assert status.setup.parts == ("tool", "load", "force")
    assert supervisor.model.load is LOAD
    supervisor.reconnect().wait(SOON)
    again = wait_for(lambda: s if (s := supervisor.status()).setup_times > status.setup_times else None)
    assert again.setup.parts == ("tool", "load", "force")


def test_a_motion_that_was_not_checked_with_the_box_of_now_is_refused(supervisor):
    supervisor.configure(RobotConfiguration(tool=TOOL)).wait(SOON)
    q = supervisor.status().q_c
    motion = plan_joint(MODEL, q, MODEL.home + 0.2, speed=0.5)
    certificate = check(motion, supervisor.model).certificate
    here = supervisor.model.forward(q).position
    supervisor.configure(RobotConfiguration(box=box_around(here, 0.05))).wait(SOON)
    with pytest.raises(CertificateError, match="safety box"):
        supervisor.execute(motion, certificate)
    assert not check(motion, supervisor.model, box=box_around(here, 0.05)).ok
    supervisor.configure(RobotConfiguration(box=SafetyBox(size=(1, 1, 1), T_base_box=Pose(), active=False))).wait(SOON)
    supervisor.execute(motion, certificate).wait(SOON)


def test_a_set_up_that_is_none_or_too_heavy_is_refused_before_it_is_sent(supervisor):
    with pytest.raises(InvalidValueError, match="RobotConfiguration"):
        supervisor.configure(TOOL)
    with pytest.raises(InvalidValueError, match="rated"):
        supervisor.configure(RobotConfiguration(load=Payload(mass=99.0)))


def test_what_the_controller_refuses_stands_in_the_way_of_a_motion(supervisor):
    home = plan_joint(MODEL, supervisor.status().q_c, MODEL.home, speed=0.5)
    far = RobotConfiguration(force=ForceControlFrame(T_flange_force=Pose((50.0, 0.0, 0.0))))
    ticket = supervisor.configure(far)
    with pytest.raises(rcilab.RcilabError, match=r"T_flange_force: .* m from the flange"):
        ticket.wait(SOON)
    with pytest.raises(UsageError, match=r"T_flange_force: .* m from the flange"):
        supervisor.execute(home, check(home, supervisor.model).certificate)
    supervisor.configure(RobotConfiguration(force=FORCE)).wait(SOON)
    supervisor.execute(home, check(home, supervisor.model).certificate).wait(SOON)


def test_a_motion_out_of_the_box_that_runs_all_the_same_is_stopped_by_the_virtual_controller():
    with rcilab.simulate(MODEL) as robot:
        robot.power_on()
        start = robot.state.q_c
        motion = plan_joint(MODEL, start, start + np.array((0.5, 0, 0, 0, 0, 0, 0)), speed=0.5)
        box = box_around(MODEL.forward(start).position, 0.1)
        assert not check(motion, MODEL, box=box).ok
        robot.rci.set_cartesian_limit(box)
        with pytest.raises(ControlError) as caught:
            robot.control(lambda state, t: JointPosition(q=motion.at(t).q), "joint_position")
        assert set(caught.value.faults) & {
            Fault.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION,
            Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION,
        }
