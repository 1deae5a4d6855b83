"""The world of a simulated robot, through the session, in lock-step: what happens comes out the same every time."""

from __future__ import annotations

import socket
import threading

import numpy as np
import pytest

from rcilab.control_process.launch import start_controller
from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition, JointPosition
from rcilab.core.errors import CommandRejectedError, ConnectionLostError, ControlError, InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.execution.connect import connect
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.rokae.wire import SafetyStop
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.sim.api import NetworkFaults

MODEL = load_model("xMatePro7")


@pytest.fixture(scope="module")
def shared():
    with simulate(MODEL) as robot:
        robot.power_on()
        yield robot


@pytest.fixture
def robot(shared):
    """The shared robot, left alone by its world."""
    yield shared
    shared.world.release()
    shared.world.set_network()
    shared.world.mount(None)


def hold(robot, happen, cycles=100):
    """Holds the arm where it is for some cycles; `happen(k)` before the k-th command. Returns the joint torques."""
    start, torques = np.array(robot.state.q_c), []

    def callback(state, t):
        torques.append(np.array(state.tau))
        happen(len(torques) - 1)
        return JointPosition(start, finished=len(torques) >= cycles)

    robot.control(callback)
    return np.array(torques)


def test_a_push_of_a_given_time_lasts_exactly_so_many_cycles(robot):
    tau = hold(robot, lambda k: robot.world.push([0, 0, -20, 0, 0, 0], link=4, duration=0.03) if k == 10 else None)
    differs = np.flatnonzero((tau != tau[0]).any(axis=1))
    assert differs.tolist() == list(range(11, 41))  # Asked for while cycle 10 is answered: it shows in the next one.


def test_a_push_on_the_tool_shows_in_the_torques_as_its_jacobian_says_until_it_is_released(robot):
    wrench = np.array([3.0, -2.0, 5.0, 0.1, 0.2, -0.3])
    q = np.array(robot.state.q)

    def happen(k):
        if k == 5:
            robot.world.push(wrench, rise_time=0.0)
        if k == 50:
            robot.world.release()

    tau = hold(robot, happen)
    assert np.allclose(tau[20] - tau[0], -MODEL.jacobian(q).T @ wrench, atol=1e-9)
    assert np.array_equal(tau[60], tau[0])
    assert not robot.world.status().pushed


def test_a_load_that_nobody_told_the_controller_of_is_carried(robot):
    load = Payload(mass=1.0, center_of_mass=np.array([0.0, 0.0, 0.1]), inertia=np.eye(3) * 1e-3)
    tau = hold(robot, lambda k: robot.world.mount(load) if k == 5 else None)
    q, still = np.array(robot.state.q), np.zeros(7)
    with_load = MODEL.with_load(load).torque(q, still, still).full
    assert np.allclose(tau[50], with_load, atol=1e-9)


def test_the_arm_is_placed_and_a_motion_starts_there(robot):
    home = np.array(robot.state.q)
    robot.world.place_arm(home + 0.2)
    robot.world.set_soft_limits(MODEL.limits.joint.lower, MODEL.limits.joint.upper)
    hold(robot, lambda k: None)
    assert np.array_equal(robot.state.q_c, home + 0.2)
    with pytest.raises(UsageError, match="in phase moving"):
        hold(robot, lambda k: robot.world.place_arm(home) if k == 20 else None)
    robot.world.place_arm(home)


def test_what_the_arm_does_without_commands_is_chosen_by_name(robot):
    robot.world.set_on_loss("bridge")
    with pytest.raises(UsageError, match="known: hold, bridge"):
        robot.world.set_on_loss("panic")
    robot.world.set_on_loss("hold")


def test_the_status_counts_and_names(robot):
    status = robot.world.status()
    assert (status.model, status.plant, status.button) == ("xMatePro7", "ideal", "none")
    assert status.q == tuple(robot.state.q.tolist())
    robot.world.set_network(NetworkFaults(delay=0.001, seed=3), direction="states")
    assert robot.world.status().states == NetworkFaults(delay=0.001, seed=3)
    assert robot.world.status().commands == NetworkFaults()


def test_inputs_are_set_from_outside_and_by_loop_back(robot):
    robot.world.set_input(3, True)
    assert [robot.rci.get_di(k) for k in range(6)] == [False, False, False, True, False, False]
    robot.world.set_input(3, False)
    robot.world.set_loop_back()
    robot.rci.set_do(5, True)
    assert robot.rci.get_di(5)
    robot.rci.set_do(5, False)
    robot.world.set_loop_back(False)
    assert not any(robot.rci.get_di(k) for k in range(6))


@pytest.mark.parametrize(("button", "kind"), [("estop", SafetyStop.ESTOP), ("gstop", SafetyStop.GSTOP)])
def test_a_safety_stop_in_mid_motion_ends_it_and_holds_until_it_is_put_right(robot, button, kind):
    with pytest.raises(ControlError):
        hold(robot, lambda k: robot.world.press(button) if k == 20 else None)
    assert robot.rci.safety_stop() is kind
    assert robot.world.status().button == button
    with pytest.raises(CommandRejectedError):
        robot.recover()
    robot.world.press("none")
    robot.recover()
    robot.power_on()
    hold(robot, lambda k: None)


def test_what_the_vendors_sdk_allows_breaks_the_manuals_limit_until_the_table_is_changed(robot):
    start = MODEL.forward(robot.state.q_c)

    def turn(state, t):
        s = min(t / 0.2, 1.0)
        angle = 0.11 * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)  # At most 15.9 rad/s^2; the manual's limit is 10.
        return CartesianPosition((start @ Pose.from_rpy([0, 0, 0], [0, 0, angle])).matrix, finished=t >= 0.25)

    try:
        with pytest.raises(ControlError, match=r"rotational acceleration .* passes 10 rad"):
            robot.control(turn, "cartesian_position")
        robot.recover()
        robot.power_on()
        start = MODEL.forward(robot.state.q_c)
        robot.world.set_limits("sdk")
        robot.control(turn, "cartesian_position")
        assert robot.state.faults == ()
    finally:
        robot.world.set_limits("manual")


@pytest.mark.parametrize("is_free", [False, True], ids=["lock-step", "free"])
def test_a_motion_whose_commands_are_all_lost_says_that_it_did_not_arrive(is_free):
    with simulate(MODEL, lockstep=not is_free) as robot:
        robot.power_on()
        robot.world.set_network(NetworkFaults(loss=1.0), direction="commands")
        with pytest.raises(ControlError, match=r"joint 2 is 5\.73 deg away; .* executed none of the commands"):
            robot.move_j(MODEL.home + np.eye(MODEL.n)[1] * 0.1, speed=1.0)


@pytest.mark.parametrize("frequency", [1.0, 10.0])
def test_a_motion_that_a_filter_delays_is_waited_for(frequency):
    with simulate(MODEL) as robot:
        robot.power_on()
        robot.rci.set_filters(frequency, frequency, frequency)
        motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
        run = robot.execute(motion)
        assert np.abs(robot.state.q_c - motion.goal).max() <= 1e-6
        assert run.stopped is None


def test_auto_limit_leads_a_command_to_rest_inside_the_soft_limit(robot):
    start = np.array(robot.state.q_c)
    upper = np.array(MODEL.limits.joint.upper)
    upper[0] = start[0] + 0.05
    goal = start + [0.1, 0, 0, 0, 0, 0, 0]
    motion = plan_joint(MODEL, start, goal, speed=0.2)

    def follow(state, t):
        k = min(round(t * 1000), len(motion.q) - 1)
        return JointPosition(motion.q[k], finished=k == len(motion.q) - 1)

    robot.rci.set_joint_limit(MODEL.limits.joint.lower, upper)
    robot.world.set_auto_limit()
    try:
        with pytest.raises(ControlError, match=r"did not reach its end: joint 1 is \d\.\d+ deg away; .* soft limits"):
            robot.control(follow)
        reached = np.array(robot.state.q_c)
        assert start[0] + 0.03 < reached[0] < upper[0]
    finally:
        robot.world.set_auto_limit(False)
        robot.rci.set_joint_limit(MODEL.limits.joint.lower, MODEL.limits.joint.upper)
        robot.execute(plan_joint(MODEL, robot.state.q_c, start))


def test_it_answers_every_thread_also_while_a_motion_runs(robot):
    answers, ready = [], threading.Event()

    def ask():
        ready.wait(10.0)
        answers.extend(robot.world.status().phase for _ in range(20))

    thread = threading.Thread(target=ask)
    thread.start()

    def happen(k):
        ready.set()
        if k == 50:
            thread.join(10.0)

    hold(robot, happen)
    assert answers == ["moving"] * 20


def test_wrong_values_are_refused_here_and_impossible_ones_there(robot):
    with pytest.raises(InvalidValueError, match="wrench"):
        robot.world.push([1, 2, 3])
    with pytest.raises(InvalidValueError, match="button: 'stop' is unknown; known: none, estop, gstop, switch"):
        robot.world.press("stop")
    with pytest.raises(UsageError, match="plant='mujoco'"):
        robot.world.place_box("table", [1, 1, 0.1], Pose((0.5, 0.0, 0.2)))
    with pytest.raises(UsageError, match="plant='mujoco'"):
        robot.world.set_floor()
    assert robot.world.status().model == "xMatePro7"


def test_a_link_that_a_six_axis_arm_has_not_is_refused_by_name():
    with simulate(load_model("xMate3")) as robot, pytest.raises(UsageError, match=r"link needs .*1 to 6, got 7"):
        robot.world.push([1, 0, 0, 0, 0, 0], link=7)


def test_a_mujoco_world_has_boxes_and_a_floor():
    with simulate(MODEL, plant="mujoco") as robot:
        robot.world.set_floor()
        robot.world.place_box("table", [0.2, 0.2, 0.1], Pose((0.8, 0.0, 0.05)))
        robot.world.remove_box("table")
        with pytest.raises(UsageError, match="chair"):
            robot.world.remove_box("chair")
        robot.world.place_box("table", [0.1, 0.1, 0.1], IDENTITY @ Pose((0.9, 0.0, 0.05)))


def test_the_walls_of_a_safety_box_hold_an_arm_that_is_led_against_them():
    with simulate(MODEL, plant="mujoco") as robot:
        robot.power_on()
        tool = robot.state.T_base_tool.position
        robot.rci.set_cartesian_limit(SafetyBox(size=(0.3, 0.3, 0.3), T_base_box=Pose(tool)))

        def pull(newtons):
            robot.rci.start_drag("cartesian", "free")
            robot.world.push([0.0, newtons, 0.0, 0.0, 0.0, 0.0])
            for _ in range(1500):
                robot.receive_state()
            robot.world.release()
            robot.rci.stop_drag()
            return abs(robot.state.T_base_tool.matrix[1, 3] - tool[1])

        robot.world.set_walls()
        assert pull(20.0) < 0.16
        robot.world.set_walls(False)
        assert pull(20.0) > 0.2


def test_connect_is_told_where_the_world_is():
    controller = start_controller(MODEL.name, lockstep=True)
    try:
        assert controller.world_address is not None
        port = controller.world_address.partition(":")[2]
        with connect(controller.address, MODEL) as robot, pytest.raises(UsageError, match=r"\?world_port=PORT"):
            _ = robot.world
        with connect(f"{controller.address}?world_port={port}", MODEL) as robot:
            assert robot.world.status().phase == "off"
    finally:
        controller.end()


def test_a_controller_without_a_world_says_so_in_words():
    controller = start_controller(MODEL.name, lockstep=True, options=["--no-world"])
    try:
        assert controller.world_address is None
    finally:
        controller.end()
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        world = SimulationControl(*free.getsockname())
        with pytest.raises(ConnectionLostError, match="does not respond to status"):
            world.status()


def test_something_else_at_that_port_is_no_world():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()

        def answer():
            guest, _ = listener.accept()
            with guest:
                guest.recv(100)
                guest.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        thread = threading.Thread(target=answer)
        thread.start()
        with (
            SimulationControl(*listener.getsockname()) as world,
            pytest.raises(ConnectionLostError, match="not valid JSON"),
        ):
            world.status()
        thread.join()


def test_what_a_bad_network_loses_in_lockstep_is_lost_at_once_and_the_same_every_time(robot):
    lost = []
    for _ in range(2):
        robot.world.set_network(NetworkFaults(loss=0.2, seed=3), direction="commands")
        hold(robot, lambda k: None, cycles=100)
        robot.world.set_network()
        lost.append(robot.world.status().lost)
    assert lost[0] == lost[1] > 10


def test_the_status_names_faults_as_the_manual_does():
    with simulate(MODEL) as own:
        own.power_on()
        with pytest.raises(ControlError, match="kCommandJoint"):
            own.control(lambda state, t: JointPosition(state.q_c + 0.1 * (t > 0.01)))
        names = own.world.status().faults
        assert names == tuple(fault.manual_name for fault in own.state.faults)
        assert names
        assert all(name.startswith("kCommandJoint") for name in names)
