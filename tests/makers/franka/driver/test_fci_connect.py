"""Connecting to a Franka controller: its version, its library, other clients, and what is wrong with an address."""

from __future__ import annotations

import os
import secrets
import signal
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from rcilab.control_process.launch import VirtualController, start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import ConnectionLostError, InvalidValueError, ModelError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.execution.connect import connect
from rcilab.makers.address import ControllerAddress
from rcilab.makers.franka.driver import address as fci_address
from rcilab.makers.franka.driver import client, libraries
from rcilab.makers.franka.driver.address import parse_address
from rcilab.makers.franka.driver.handshake import find_version
from rcilab.model.robot_model import load_model
from tests.makers.franka.driver.conftest import ARMS, NO_LIBRARY


@pytest.fixture(params=ARMS)
def controller(request) -> Iterator[VirtualController]:
    started = start_controller(request.param)
    yield started
    started.end()


@pytest.fixture
def served(controller, request) -> tuple[str, str]:
    """Name of an arm, and the address of its controller."""
    return request.node.callspec.params["controller"], controller.address


def test_an_address_is_a_host():
    assert parse_address("fci://172.16.0.2") == ControllerAddress(scheme="fci", host="172.16.0.2", port=1337)
    assert str(parse_address("172.16.0.2:1337?world_port=9")) == "fci://172.16.0.2:1337?world_port=9"
    assert parse_address("fci://127.0.0.2?hand_port=1338&udp_port=5").is_here
    with pytest.raises(InvalidValueError, match="has port 1338: clients of this interface connect to 1337 only"):
        parse_address("fci://172.16.0.2:1338")
    with pytest.raises(InvalidValueError, match="unknown option client_port; known: world_port"):
        parse_address("fci://172.16.0.2?client_port=1")


def test_the_arm_is_known_by_the_version_of_its_controller(served):
    name, address = served
    policy = os.sched_getscheduler(0), os.sched_getparam(0)
    with connect(address) as robot:
        assert robot.model.name == name
        assert robot.state.q_c == pytest.approx(load_model(name).home, abs=1e-6)
        assert (os.sched_getscheduler(0), os.sched_getparam(0)) == policy  # libfranka asks for the highest priority.
    other = "FR3" if name == "Panda" else "Panda"
    with pytest.raises(ModelError, match=rf"which is that of the {name}, you gave {other}; leave model out") as caught:
        connect(address, load_model(other))
    assert caught.value.code == "other_arm"


def test_a_second_client_is_told_so_and_the_first_one_goes_on(served):
    name, address = served
    with connect(address) as robot:
        with pytest.raises(ConnectionLostError, match="probably because another client is connected"):
            connect(address)
        robot.move_j(robot.model.home + 0.05)
    with connect(address) as robot:
        assert robot.state.q_c == pytest.approx(load_model(name).home + 0.05, abs=1e-6)


def test_a_controller_that_ends_is_reported_and_the_session_can_be_closed(controller):
    robot = connect(controller.address)

    def hold(state, t):
        if t > 0.05:
            os.kill(controller.pid, signal.SIGKILL)
        return JointPosition(state.q_c)

    with pytest.raises(ConnectionLostError, match=r"the connection is lost|no state for 1 s"):
        robot.control(hold)
    with pytest.raises(ConnectionLostError, match="the connection is lost"):
        robot.recover()
    robot.close()


def test_no_robot_at_an_address_says_what_to_check():
    with pytest.raises(ConnectionLostError, match=r"no robot at fci://127\.9\.9\.9:1337 \(Connection refused.*Desk"):
        connect("fci://127.9.9.9", load_model("Panda"))


def test_the_scheme_of_another_maker_with_the_same_port_is_suggested(controller):
    address = controller.address.partition("?")[0].replace("fci://", "rci://")
    with pytest.raises(
        ConnectionLostError, match="if it is an arm of Franka, its address begins with fci://"
    ) as caught:
        connect(address, timeout=0.5)
    assert caught.value.code == "other_scheme"


@pytest.mark.parametrize("answer", [b"", b"\x00" * 5])
def test_what_answers_there_and_is_no_controller_is_not_waited_for(answer):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = ControllerAddress(scheme="fci", host="127.0.0.1", port=listener.getsockname()[1])

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(64)
                peer.sendall(answer)
            again, _ = listener.accept()
            again.recv(1)
            again.close()

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ConnectionLostError, match=r"what is there ended the connection .* is a Franka") as caught:
            find_version(address, 10, 2.0)
        assert caught.value.code == "other_protocol"
        thread.join()


def test_the_controller_of_another_maker_is_named():
    controller = start_controller(
        "xMatePro7", options=("--port", "1337", "--host", f"127.{os.getpid() % 200 + 20}.7.7")
    )
    try:
        address = controller.address.partition("?")[0].replace("rci://", "fci://")
        with pytest.raises(ConnectionLostError, match="if it is an arm of ROKAE, its address begins with rci://"):
            connect(address)
    finally:
        controller.end()


def test_a_controller_that_answers_too_slowly_is_not_waited_for():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = ControllerAddress(scheme="fci", host="127.0.0.1", port=listener.getsockname()[1])

        def serve() -> None:
            peer, _ = listener.accept()
            with peer, suppress(OSError):  # The client has left.
                for byte in struct.pack("<IIIBH", 0, 0, 15, 0, 10):
                    time.sleep(0.1)
                    peer.send(bytes([byte]))

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ConnectionLostError, match=r"accepted the connection and did not answer within 0\.5 s"):
            find_version(address, 10, 0.5)
        thread.join()


@pytest.mark.parametrize(("name", "version"), [pytest.param("Panda", 5), pytest.param("FR3", 10, marks=NO_LIBRARY)])
def test_a_client_library_without_an_answer_is_not_waited_for(monkeypatch, name, version):
    monkeypatch.setattr(client, "ANSWER_TIMEOUT", 1.0)
    host = ".".join(["127", *(str(secrets.randbelow(254) + 1) for _ in range(3))])
    with socket.create_server((host, 1337)) as listener:

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(64)
                peer.sendall(struct.pack("<IIIBH", 0, 0, 15, 0, version))

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ConnectionLostError, match="the client library got no answer within 1 s"):
            connect(f"fci://{host}", load_model(name))
        thread.join()


@pytest.mark.parametrize("name", ARMS)
def test_states_that_do_not_arrive_are_a_matter_of_the_firewall(name):
    controller = start_controller(name, options=("--loss", "1", "--faults-on", "states"))
    try:
        with pytest.raises(ConnectionLostError, match=r"fci://.* cannot connect \(UDP.*Timeout\); .*no firewall"):
            connect(controller.address)
    finally:
        controller.end()


@pytest.mark.parametrize(
    ("version", "sentence"),
    [
        (7, r"version 7 of Franka's interface; rcilab drives version 5 \(Panda\) and"),
        (0x6142, r"what answers at fci://127.0.0.1:\d+ is not Franka's interface"),
    ],
)
def test_an_unknown_version_is_named(monkeypatch, version, sentence):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        monkeypatch.setattr(fci_address, "CLIENT_PORT", listener.getsockname()[1])

        def serve() -> None:
            peer, _ = listener.accept()
            with peer:
                peer.recv(64)
                peer.sendall(struct.pack("<IIIBH", 0, 0, 15, 1, version))

        thread = threading.Thread(target=serve)
        thread.start()
        with pytest.raises(ModelError, match=sentence):
            connect("fci://127.0.0.1")
        thread.join()


@pytest.mark.parametrize(
    ("name", "library", "package"),
    [("Panda", "panda_py", "panda-python"), ("FR3", "pylibfranka", "pylibfranka")],
)
def test_a_missing_library_is_one_sentence(monkeypatch, name, library, package):
    for module in [module for module in sys.modules if module.split(".")[0] == library]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"driving the {name}.* needs {package}, which is not installed: pip"):
        connect("fci://127.9.9.9", load_model(name))


@NO_LIBRARY
def test_a_library_that_is_missing_for_this_python_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylibfranka", None)
    monkeypatch.setattr(libraries, "_NO_WHEEL", sys.version_info[:2])
    with pytest.raises(MissingExtraError, match=r"with Python 3\.12 or older"):
        libraries.load_client_library(10)
