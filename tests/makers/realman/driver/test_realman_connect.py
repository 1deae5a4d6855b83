"""Connecting to a RealMan controller: its arm, its limits, its library, and what is wrong with an address."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.control_process.launch import VirtualController, start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import ConnectionLostError, InvalidValueError, ModelError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.core.spatial import Pose
from rcilab.execution.connect import connect
from rcilab.makers.address import ControllerAddress
from rcilab.makers.realman.driver.address import parse_address
from rcilab.makers.realman.driver.handshake import find_arm
from rcilab.model.robot_model import load_model

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")


@pytest.fixture(scope="module")
def controller() -> Iterator[VirtualController]:
    started = start_controller("RM75")
    yield started
    started.end()


def test_an_address_has_the_port_of_the_makers_clients_unless_another_is_given():
    assert parse_address("realman://192.168.1.18") == ControllerAddress(
        scheme="realman", host="192.168.1.18", port=8080
    )
    assert str(parse_address("192.168.1.18:9090?world_port=9")) == "realman://192.168.1.18:9090?world_port=9"
    assert parse_address("realman://127.0.0.2:1?udp_port=5").is_here
    with pytest.raises(InvalidValueError, match="unknown option hand_port"):
        parse_address("realman://127.0.0.2?hand_port=3")


def test_the_controller_reports_which_arm_it_has(controller):
    with connect(controller.address) as robot:
        assert robot.model.name == "RM75"
        assert robot.state.q == pytest.approx(load_model("RM75").home, abs=1e-5)
    with pytest.raises(ModelError, match=r"has an arm RM75, you gave RM65; leave model out, or load_model") as caught:
        connect(controller.address, load_model("RM65"))
    assert caught.value.code == "other_arm"


def test_the_next_session_has_the_tool_and_the_limits_that_are_set_there(controller):
    own = load_model("RM75").limits.joint
    tool = Pose([0.0, 0.01, 0.2])
    with connect(controller.address) as robot:
        robot.power_on()
        robot.set_tool(tool)
        robot.realman.set_joint_ranges(0.5 * own.lower, 0.5 * own.upper)
        robot.realman.set_joint_velocities(0.5 * own.velocity)
    with connect(controller.address) as robot:
        joint = robot.model.limits.joint
        assert robot.model.T_flange_tool.is_close(tool, 1e-6)
        np.testing.assert_allclose(joint.upper, 0.5 * own.upper, atol=1e-5)
        np.testing.assert_allclose(joint.velocity, 0.5 * own.velocity, rtol=1e-4)
        assert np.array_equal(joint.acceleration, own.acceleration)
        robot.realman.set_joint_ranges(own.lower, own.upper)
        robot.realman.set_joint_velocities(own.velocity)


def test_the_process_prints_nothing(controller, capfd):
    with connect(controller.address) as robot:
        assert robot.state.q is not None
    assert capfd.readouterr() == ("", "")


def test_a_controller_that_ends_is_reported_and_the_session_can_be_closed():
    controller = start_controller("RM65")
    assert controller.address is not None
    robot = connect(controller.address)
    robot.power_on()

    def hold(state, t):
        if t > 0.05:
            os.kill(controller.pid or 0, signal.SIGKILL)
        return JointPosition(state.q_c)

    with pytest.raises(ConnectionLostError, match=r"the connection is lost|no state for 1 s"):
        robot.control(hold)
    with pytest.raises(ConnectionLostError, match="the connection is lost"):
        robot.recover()
    robot.close()
    controller.end()


def test_no_robot_at_an_address_names_what_to_check():
    with pytest.raises(
        ConnectionLostError, match=r"no robot at realman://127\.9\.9\.9:8080 \(Connection refused.*teach"
    ):
        connect("realman://127.9.9.9", load_model("RM65"))


@pytest.mark.parametrize(
    ("answer", "error", "text"),
    [
        (b"", ConnectionLostError, "is not a controller of a RealMan arm.*it closed the connection"),
        (b"HTTP/1.1 400\r\n", ConnectionLostError, "is not a controller of a RealMan arm.*JSON"),
        (
            b'{"Product_version":"RX75-B"}\r\n',
            ModelError,
            r"an arm that rcilab does not know \('RX75-B'\); it drives RM65",
        ),
    ],
)
def test_what_answers_there_and_is_no_known_arm_is_named(answer, error, text):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = ControllerAddress(scheme="realman", host="127.0.0.1", port=listener.getsockname()[1])

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(64)
                peer.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(error, match=text):
            find_arm(address, 2.0)
        thread.join()


def test_a_missing_library_is_one_sentence(monkeypatch):
    for module in [module for module in sys.modules if module.split(".")[0] == "Robotic_Arm"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "Robotic_Arm", None)
    with pytest.raises(
        MissingExtraError, match=r"driving a RealMan arm needs Robotic_Arm, which is not installed: pip"
    ):
        connect("realman://127.9.9.9", load_model("RM65"))


def test_a_session_whose_states_another_one_takes_names_the_reason(controller):
    with connect(controller.address) as first, connect(controller.address) as second:
        with pytest.raises(ConnectionLostError, match=r"states go to another client.* connect again"):
            first.receive_state()
        first.close()
        assert second.receive_state().q.shape == (7,)
