"""Making a connection, or not, against a scripted controller on real sockets."""

from __future__ import annotations

import math
import socket
import threading

import pytest

from rcilab.cli import _build_parser
from rcilab.core.errors import ConnectionLostError, DeadlineError, InvalidValueError, ModelError
from rcilab.execution.session import connect
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.driver.identify import require_same_arm
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
