"""Connecting to a UFACTORY controller: its arm, its library, and what is wrong with an address."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from rcilab.control_process.launch import VirtualController, start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import ConnectionLostError, InvalidValueError, ModelError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.execution.connect import connect
from rcilab.makers.address import ControllerAddress
from rcilab.makers.ufactory.driver import links
from rcilab.makers.ufactory.driver.address import parse_address
from rcilab.model.robot_model import load_model


@pytest.fixture(scope="module")
def controller() -> Iterator[VirtualController]:
    started = start_controller("xArm6")
    yield started
    started.end()


def test_an_address_is_a_host():
    assert parse_address("xarm://192.168.1.185") == ControllerAddress(scheme="xarm", host="192.168.1.185", port=502)
    assert str(parse_address("192.168.1.185:502?world_port=9")) == "xarm://192.168.1.185:502?world_port=9"
    assert parse_address("xarm://127.0.0.2").is_here
    with pytest.raises(InvalidValueError, match="has port 503: clients of this interface connect to 502 only"):
        parse_address("xarm://192.168.1.185:503")


def test_the_controller_reports_which_arm_it_has(controller):
    with connect(controller.address) as robot:
        assert robot.model.name == "xArm6"
        assert robot.state.q_c == pytest.approx(load_model("xArm6").home, abs=1e-6)
    with pytest.raises(ModelError, match=r"has an arm xArm6, you gave xArm7; leave model out, or load_model") as caught:
        connect(controller.address, load_model("xArm7"))
    assert caught.value.code == "other_arm"


def test_two_clients_at_once_see_the_same_arm(controller):
    with connect(controller.address) as robot, connect(controller.address) as other:
        robot.power_on()
        robot.xarm.move_j(robot.model.home + 0.05)
        assert other.state.q_c == pytest.approx(robot.model.home + 0.05, abs=1e-6)


def test_the_process_is_left_as_it_was(controller, tmp_path):
    """The library creates a folder in the user's home, prints, and changes the timeout of every new socket."""
    program = (
        "import socket, sys\n"
        "from rcilab.execution.connect import connect\n"
        f"with connect({controller.address!r}) as robot:\n"
        "    robot.state\n"
        "assert socket.getdefaulttimeout() is None\n"
        "assert 'xarm' in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        env={**os.environ, "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not (tmp_path / ".UFACTORY").exists()


def test_a_controller_that_ends_is_reported_and_the_session_can_be_closed():
    controller = start_controller("xArm6")
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
    with pytest.raises(ConnectionLostError, match=r"no robot at xarm://127\.9\.9\.9:502 \(Connection refused.*label"):
        connect("xarm://127.9.9.9", load_model("xArm7"))


@pytest.mark.parametrize(
    ("answer", "error", "text"),
    [
        (b"", ConnectionLostError, "is not a controller of a UFACTORY arm.*it closed the connection"),
        (b"HTTP/1.1 400", ConnectionLostError, "is not a controller of a UFACTORY arm.*protocol"),
        (
            b"\0\1\0\2\0\x1d\1\0" + b"7,3,XI1200,AC1200,v1.6.0\0\0\0\0",
            ModelError,
            r"an arm that rcilab does not know \('7,3,XI1200.*it drives .*xArm7",
        ),
    ],
)
def test_what_answers_there_and_is_no_known_arm_is_named(answer, error, text):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = ControllerAddress(scheme="xarm", host="127.0.0.1", port=listener.getsockname()[1])

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(64)
                peer.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(error, match=text):
            links.find_arm(address, 2.0)
        thread.join()


def test_a_missing_library_is_one_sentence(monkeypatch):
    for module in [module for module in sys.modules if module.split(".")[0] == "xarm"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "xarm", None)
    with pytest.raises(MissingExtraError, match=r"driving a UFACTORY arm needs xarm, which is not installed: pip"):
        connect("xarm://127.9.9.9", load_model("xArm7"))
