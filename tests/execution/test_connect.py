"""Making a connection, or not, against a scripted controller on real sockets."""

from __future__ import annotations

import math
import socket
import threading
import warnings
from collections.abc import Iterator

import pytest

from rcilab.cli import _build_parser
from rcilab.control_process.launch import start_controller
from rcilab.core.command import CartesianPosition
from rcilab.core.errors import ConnectionLostError, DeadlineError, InvalidValueError, ModelError
from rcilab.core.spatial import Pose
from rcilab.execution.connect import connect
from rcilab.execution.load_comparison import describe_other_load
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.driver.identify import require_same_arm
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from tests.execution.peer import HOST, MODEL, Peer, Script, wave


def test_without_a_model_the_controller_is_asked_which_arm_it_is():
    with Peer() as peer, connect(peer.url) as robot:
        assert robot.model.name == "xMatePro7"
        assert robot.state.q.shape == (7,)


@pytest.mark.parametrize("name", ["xMate3", "xMate7", "xMatePro3"])
def test_another_arm_than_the_controller_s_is_refused_and_both_are_named(name):
    model = load_model(name)
    with Peer() as peer:
        with pytest.raises(ModelError, match=rf"is an xMatePro7 \(7 axes\), you gave {name} \({model.n}\)") as caught:
            connect(peer.url, model)
        assert "load_model('xMatePro7')" in str(caught.value)
        assert peer.requests == [rci.LoadRobotModel()]


def test_an_unknown_arm_must_have_the_given_lengths_up_to_a_calibration():
    lengths = [(0.0, d) for d in (0.404, 0.0, 0.4375, 0.0, 0.4125, 0.0, 0.2755)]
    served = [number for _, d in lengths for number in (0.0, 0.0, 1000.0 * d + 0.8, 0.0)]
    require_same_arm(served, "xMatePro7", lengths, "rci://x")
    require_same_arm([0.0] * 28, "xMatePro7", lengths, "rci://x")
    served[2] += 20.0
    with pytest.raises(ModelError, match=r"7 axes with the DH lengths d 424\.8, .* you gave xMatePro7 \(7 axes, 404,"):
        require_same_arm(served, "xMatePro7", lengths, "rci://x")


@pytest.mark.parametrize("timeout", [-1, 0, math.nan, math.inf, "a", None, True])
def test_a_timeout_that_is_no_time_is_named(timeout):
    with pytest.raises(InvalidValueError, match=r"timeout must be .*above 0 \[s\]"):
        connect("rci://127.0.0.2:9", timeout=timeout)


def test_the_name_of_a_model_is_no_model():
    with pytest.raises(InvalidValueError, match=r"use load_model\('xMatePro7'\)"):
        connect("rci://127.0.0.2:9", "xMatePro7")


def test_a_client_that_is_turned_away_hears_of_the_other_one():
    with socket.create_server((HOST, 0)) as server:
        turn_away = threading.Thread(target=lambda: server.accept()[0].close())
        turn_away.start()
        with pytest.raises(ConnectionLostError, match="probably because another client is connected: it takes one"):
            connect(f"rci://{HOST}:{server.getsockname()[1]}", MODEL, timeout=2.0)
        turn_away.join()


def test_nobody_there_names_address_and_timeout_and_what_to_check():
    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(
        ConnectionLostError, match=rf"no robot at rci://{HOST}:{port} .*of 0\.5 s.*teach pendant"
    ) as caught:
        connect(f"rci://{HOST}:{port}", MODEL, timeout=0.5)
    advice = str(caught.value).rpartition("rcilab ")[2]
    assert _build_parser().parse_args(advice.split()).model == "xMatePro7"


def test_a_controller_that_sends_no_states_is_told_apart():
    with Peer(Script(silent_at=0)) as peer, pytest.raises(ConnectionLostError, match=r"sent no state to 127\.0\.0\.1"):
        connect(peer.url, MODEL, timeout=0.3)


def test_a_second_client_is_told_that_the_port_is_taken(make_robot):
    peer, _ = make_robot()
    with pytest.raises(ConnectionLostError, match="another client"):
        connect(peer.url, MODEL, timeout=0.5)


def test_garbage_for_an_answer_is_a_lost_connection():
    with socket.create_server((HOST, 0)) as server:
        port = server.getsockname()[1]
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with pytest.raises(DeadlineError, match="did not answer LoadRobotModel"):
            connect(f"rci://{HOST}:{port}", MODEL, timeout=0.2)
        udp.close()


def test_short_long_and_foreign_datagrams_are_ignored(make_robot):
    def litter(udp, to):
        for size in (0, 1, 1246, 1248, 2000):
            udp.sendto(bytes(size), to)
        udp.sendto(b"\xff" * 1247, to)

    _peer, robot = make_robot(Script(on_state=litter))
    run = robot.control(wave(150))
    assert len(run.t) > 150
    assert robot.state.message_id > 1000


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    controller = start_controller(MODEL.name, lockstep=True)
    assert controller.address is not None
    yield controller.address
    controller.end()


def test_tool_and_load_are_sent_only_on_request_and_otherwise_compared_in_one_sentence(address: str) -> None:
    loaded = MODEL.with_tool(Pose((0.0, 0.0, 0.12))).with_load(Payload(mass=2.0))
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        with connect(address, loaded) as robot:
            assert robot.state.tau[1] == pytest.approx(-45.14, abs=0.01)
    tool, load = map(str, (warning.message for warning in found))
    assert "the tool of rci://127.0.0.2" in tool
    assert "120.0 mm" in tool
    assert "at standstill joint 4 has -19.93 N m, the model -28.03 N m" in load
    assert "which has a load of 2 kg" in load
    assert all("apply=True" in sentence for sentence in (tool, load))
    with connect(address, loaded, apply=True) as robot:
        assert robot.state.tau[1] == pytest.approx(-57.52, abs=0.01)
        assert robot.state.T_base_tool.is_close(loaded.forward(robot.state.q), 1e-9)
    with connect(address, loaded):  # Now they are the same: no warning, which would be an error here.
        pass
    with pytest.warns(UserWarning, match="which has no load"), connect(address, MODEL):
        pass
    with connect(address, MODEL, apply=True) as robot:
        assert robot.state.tau[1] == pytest.approx(-45.14, abs=0.01)
        assert robot.state.T_base_tool.is_close(MODEL.forward(robot.state.q), 1e-9)


def test_apply_needs_a_model() -> None:
    with pytest.raises(InvalidValueError, match=r"apply.*needs a model"):
        connect("rci://127.0.0.2:9", apply=True)


def test_a_load_that_the_torques_do_not_show_is_reported_as_unknown(address: str) -> None:
    light = MODEL.with_load(Payload(mass=0.5))
    with connect(address) as robot:
        state = robot.state
    assert "is not known" in describe_other_load(light, state, "robot")
    assert describe_other_load(MODEL, state, "robot") == ""


def test_a_pose_computed_with_another_tool_is_refused_with_that_cause(address: str) -> None:
    with connect(address, MODEL.with_tool(Pose((0.0, 0.0, 0.12))), apply=True) as robot:
        robot.power_on()
        q = robot.state.q_c
        with pytest.raises(InvalidValueError) as raised:
            robot.control(lambda state, t: CartesianPosition(MODEL.forward(q).matrix), mode="cartesian_position")
        robot.set_tool(Pose())
    assert "with a tool at (0.0, 0.0, 0.0) mm in the flange, but the controller has one at (0.0, 0.0, 120.0) mm" in (
        str(raised.value)
    )
