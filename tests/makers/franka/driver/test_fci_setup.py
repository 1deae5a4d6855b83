"""What a session sets at a Franka controller, and what this interface cannot do."""

from __future__ import annotations

import os
import re
import signal

import numpy as np
import pytest

from rcilab.app.setup.configuration_state import describe_held
from rcilab.app.text import Text
from rcilab.control_process import Supervisor
from rcilab.control_process.launch import start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import CommandRejectedError, ControlError, InvalidValueError, ModelError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.execution.connect import connect
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration
from rcilab.makers.franka.driver.settings import body_of
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.known_setup import with_reported_load
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import default_parameters
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from tests.makers.franka.driver.conftest import ARMS, NO_LIBRARY
from tests.waiting import SOON, wait_for

LOAD = Payload(mass=1.0, center_of_mass=np.array([0.0, 0.0, 0.05]))
TOOL = Pose(position=[0.01, 0.0, 0.12], wxyz=[0.92387953, 0.0, 0.0, -0.38268343])


def test_the_tool_is_that_of_the_state_and_of_the_model(robot):
    robot.set_tool(TOOL)
    assert robot.model.T_flange_tool.is_close(TOOL, 1e-12)
    assert robot.fci.tool.is_close(TOOL, 1e-6)
    reported, computed = robot.state.T_base_tool, robot.model.forward(robot.state.q)
    assert np.abs(reported.matrix - computed.matrix).max() <= 1e-6


def test_the_stiffness_frame_and_the_end_effector_are_set_by_their_own_requests(robot):
    robot.fci.set_ee(TOOL)
    assert robot.model.T_flange_tool.is_close(TOOL, 1e-6)
    robot.fci.set_k(Pose(position=[0.0, 0.0, 0.05]))
    with pytest.raises(InvalidValueError, match=r"EE_T_K: 3.0 m from the flange is farther than 2 m"):
        robot.fci.set_k(Pose(position=[0.0, 0.0, 3.0]))
    robot.fci.set_k(Pose())


def test_the_load_is_that_of_the_state_and_of_the_model(robot):
    robot.set_load(1.5, [0.0, 0.01, 0.06], 1e-3 * np.eye(3))
    assert robot.model.load.mass == 1.5
    assert robot.fci.load.mass == pytest.approx(1.5)
    assert robot.fci.load.center_of_mass == pytest.approx([0.0, 0.01, 0.06])
    expected = robot.model.torque(robot.state.q).gravity
    assert robot.state.tau == pytest.approx(expected, abs=0.01)
    with pytest.raises(InvalidValueError, match="mass"):
        robot.set_load(30.0, np.zeros(3))
    with pytest.raises(InvalidValueError, match=r"mass: 30\.0 kg is above 3 kg, the rated payload"):
        robot.set_load(30.0, np.zeros(3))
    robot.set_load(0.5, [0.0, 0.0, 0.05])
    assert not robot.fci.load.inertia.any()
    with pytest.raises(AttributeError, match=r"the requests of this robot's controller are in \.fci"):
        robot.rci  # noqa: B018


@NO_LIBRARY
def test_a_page_shows_the_load_that_the_controller_reports():
    def shown(supervisor: Supervisor) -> str:
        return Text("en").render(describe_held(supervisor.status(), "load"))

    with Supervisor(load_model("FR3")) as supervisor:
        supervisor.power_on().wait(SOON)
        assert supervisor.status().setup.load is None
        assert shown(supervisor) == "none"
        supervisor.configure(RobotConfiguration(load=LOAD)).wait(SOON)
        assert "1.00 kg" in shown(supervisor)
        assert supervisor.status().reported.load.center_of_mass == pytest.approx([0.0, 0.0, 0.05])


@NO_LIBRARY
def test_a_controller_that_ends_is_named_without_motor_power():
    with Supervisor(load_model("FR3")) as supervisor:
        os.kill(supervisor.status().controller_pid, signal.SIGKILL)
        incident = wait_for(lambda: supervisor.status().incident)
    assert incident.message.endswith("The arm is then at its initial pose.")


def test_parameters_are_taken_and_bounds_named(robot):
    defaults = default_parameters(parameters_of(robot.model))
    soft = ControllerParameters(
        joint_stiffness=(600.0,) * 7,
        cartesian_stiffness=(500.0,) * 3 + (20.0,) * 3,
        collision_thresholds=(30.0,) * 13,
    )
    for control in (soft, defaults):
        robot.configure(RobotConfiguration(control=control))
    with pytest.raises(InvalidValueError, match=r"stiffness, joint 2: 20000.0 is outside 0 to 14250 \[N m/rad\]"):
        robot.fci.set_joint_impedance([600.0, 20000.0, 600.0, 600.0, 600.0, 600.0, 600.0])
    with pytest.raises(InvalidValueError, match=r"stiffness, x: 5.0 is outside 10 to 3000"):
        robot.fci.set_cartesian_impedance([5.0, 500.0, 500.0, 20.0, 20.0, 20.0])
    with pytest.raises(InvalidValueError, match=r"upper_torques, joint 1 must not be below 20 \[N m\], got 10.0"):
        robot.fci.set_collision_behavior([20.0] * 7, [10.0] * 7, [20.0] * 6, [20.0] * 6)
    for wrong in (["1"] * 7, [True] * 7):
        with pytest.raises(InvalidValueError, match=r"stiffness: \[.*\] is not 7 numbers \[N m/rad\]"):
            robot.fci.set_joint_impedance(wrong)
    for wrong in ("2", True):
        with pytest.raises(InvalidValueError, match=r"mass must be a number \[kg\], got"):
            robot.fci.set_load(wrong, np.zeros(3))
    with pytest.raises(InvalidValueError, match="known: joint_stiffness"):
        robot.configure(RobotConfiguration(control=ControllerParameters(filters=(100.0,))))


def test_soft_springs_let_a_push_move_the_arm(robot):
    q0 = robot.state.q_c

    def hold(state, t):
        if 0.1 <= t < 0.1005:
            robot.simulation.push([0.0, 10.0, 0.0, 0.0, 0.0, 0.0], duration=0.2)
        return JointPosition(q0, finished=t >= 0.4)

    moved = []
    for stiffness in (default_parameters(parameters_of(robot.model))["joint_stiffness"], (600.0,) * 7):
        robot.configure(RobotConfiguration(control=ControllerParameters(joint_stiffness=stiffness)))
        run = robot.control(hold, "joint_impedance")
        moved.append(float(np.abs(run.cycles["q"] - q0).max()))
        robot.move_j(robot.model.home)
    robot.configure(RobotConfiguration(control=default_parameters(parameters_of(robot.model))))
    assert moved[0] <= 1e-5
    assert moved[1] > 1e-3


def _hold_and_push(robot, force):
    q0 = robot.state.q_c

    def hold(state, t):
        if 0.05 <= t < 0.0505:
            robot.simulation.push([0.0, 0.0, force, 0.0, 0.0, 0.0], duration=0.2)
        return JointPosition(q0, finished=t >= 0.5)

    with pytest.raises(ControlError) as caught:
        robot.control(hold)
    robot.simulation.release()
    robot.recover()
    return caught.value


def test_a_reflex_names_joint_or_axis_with_value_and_threshold(robot):
    thresholds = (5.0,) * 7 + (30.0,) * 6
    robot.configure(RobotConfiguration(control=ControllerParameters(collision_thresholds=thresholds)))
    error = _hold_and_push(robot, -25.0)
    assert error.faults == (FrankaError.JOINT_REFLEX,)
    found = error.finding.parts[0]
    assert (found.code, found.facts["bound"]) == ("collision", 5.0)
    assert 5.0 < found.facts["value"] < 10.0
    assert f"joint {found.facts['joint']}: external torque {found.facts['value']:.4g} N m is above" in str(error)

    robot.fci.set_collision_behavior([30.0] * 7, [30.0] * 7, [15.0] * 6, [15.0] * 6)
    error = _hold_and_push(robot, -25.0)
    assert error.faults == (FrankaError.CARTESIAN_REFLEX,)
    found = r"force along z of K: \d\d\S* N is above its threshold 15 N \(K_F_ext_hat_K\[2\] is -\d\d\S*\)"
    assert re.search(found, str(error))
    robot.configure(RobotConfiguration(control=default_parameters(parameters_of(robot.model))))


def test_what_the_interface_cannot_do_is_refused_with_its_reason(robot):
    for refused, problem in (
        (lambda: robot.set_safety_box(SafetyBox(size=[1.0, 1.0, 1.0], T_base_box=Pose())), "no safety box"),
        (lambda: robot.set_output(0, True), "no digital signals"),
        (robot.reboot, "no restart on request"),
    ):
        with pytest.raises(ModelError, match=f"the controller of {robot.model.name} has {problem}"):
            refused()
    with pytest.raises(CommandRejectedError, match="cannot switch motor power; press the user stop, or lock"):
        robot.power_off()
    assert robot.is_powered()


def test_requests_are_refused_while_a_motion_runs(robot):
    q0 = robot.state.q_c
    caught = []

    def hold(state, t):
        if t == 0.05:
            for refused in (robot.recover, lambda: robot.fci.set_joint_impedance([600.0] * 7)):
                with pytest.raises(UsageError, match="is not possible while a motion is running") as error:
                    refused()
                caught.append(error.value.code)
        return JointPosition(q0, finished=t >= 0.1)

    robot.control(hold)
    assert caught == ["moving", "moving"]


@pytest.mark.parametrize("name", ARMS)
def test_a_session_that_sends_nothing_has_tool_and_load_of_the_controller(name):
    model = load_model(name)
    controller = start_controller(name)
    try:
        with connect(controller.address, model.with_tool(TOOL).with_load(LOAD), apply=True) as robot:
            assert robot.fci.tool.is_close(TOOL, 1e-6)
        with connect(controller.address) as robot:
            assert robot.model.name == name
            assert robot.model.T_flange_tool.is_close(TOOL, 1e-6)
            assert robot.model.load.mass == pytest.approx(LOAD.mass)
        other = model.with_tool(Pose(position=[0.0, 0.0, 0.3])).with_load(Payload(mass=2.0))
        with (
            pytest.warns(UserWarning, match="of the model|from the model's") as warned,
            connect(controller.address, other) as robot,
        ):
            assert robot.model.T_flange_tool.is_close(TOOL, 1e-6)
    finally:
        controller.end()
    said = [str(warning.message) for warning in warned]
    assert any("the tool of" in text and "180.3 mm" in text for text in said), said
    assert any("the load of" in text and "is 1 kg, that of the model 2 kg" in text for text in said), said


PLATE = Payload(mass=1.0, center_of_mass=np.array([0.0, 0.0, 0.05]), inertia=np.diag([0.0766, 0.0446, 0.1212]))


def test_a_flat_load_is_read_back_from_a_state_that_rounds_it(robot):
    robot.set_load(PLATE.mass, PLATE.center_of_mass, PLATE.inertia)
    assert robot.fci.load.mass == PLATE.mass
    assert robot.fci.load.inertia == pytest.approx(PLATE.inertia, abs=1e-7)


@pytest.mark.parametrize("mass", [0.1, 0.73, 2.27, 3.0])
def test_a_body_of_a_state_is_the_nearest_possible_one(mass):
    rng = np.random.default_rng(4)
    for _ in range(200):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        for moments in (rng.uniform(0.0, 0.1, 2) @ [[1, 0, 1], [0, 1, 1]], (0.02, 0.02, 0.0)):  # Plates and lines.
            tensor = axes * moments @ axes.T
            body = body_of(float(np.float32(mass)), [0.0, 0.0, 0.05], np.float32(tensor).astype(float).ravel().tolist())
            assert body.mass == mass
            assert body.inertia == pytest.approx(tensor, abs=2e-8)


def test_a_session_goes_on_with_the_rated_part_of_a_load_that_is_too_heavy():
    heavy = Payload(mass=6.0, center_of_mass=np.array([0.0, 0.0, 0.05]), inertia=np.diag([0.02, 0.02, 0.01]))
    with pytest.warns(UserWarning, match="the load of here is 6 kg, above the 3 kg that Panda is rated for"):
        load = with_reported_load(load_model("Panda"), heavy, "here").load
    assert (load.mass, load.center_of_mass[2]) == (3.0, 0.05)
    assert load.inertia == pytest.approx(heavy.inertia / 2.0)
