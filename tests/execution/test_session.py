"""Who may ask what and when: threads, closing, states, against a scripted controller on real sockets."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from rcilab.core.command import JointPosition
from rcilab.core.errors import ConnectionLostError, UsageError
from rcilab.core.spatial import Pose
from rcilab.execution.connect import connect
from rcilab.makers.rokae import wire as rci
from rcilab.motion import plan_joint
from tests.execution.peer import MODEL, Peer, assert_controlled_stop, wave

REST = plan_joint(MODEL, MODEL.home, MODEL.home)


def test_whoever_calls_in_mid_motion_is_refused_and_the_motion_goes_on(make_robot):
    peer, robot = make_robot()
    refused = []

    def disturb():
        for call in (robot.receive_state, robot.recover, robot.power_on, lambda: robot.rci.set_coor(Pose()),
                     lambda: robot.rci.set_filters(100, 100, 100), lambda: robot.control(wave(10))):  # fmt: skip
            with pytest.raises(UsageError, match="is not possible while a motion is running") as caught:
                call()
            refused.append(caught.value)
        assert robot.state.message_id > 0

    other = threading.Thread(target=disturb)
    good = wave(400)

    def callback(state, t):
        if round(t * 1000) == 100:
            disturb()
            other.start()
        if round(t * 1000) == 350:
            other.join()
        return good(state, t)

    run = robot.control(callback)
    assert len(refused) == 12
    assert run.stopped is None
    assert run.timing.lost == 0
    assert [type(request) for request in peer.requests] == [rci.LoadRobotModel, rci.StartMove, rci.StopMove]


@pytest.mark.parametrize("from_callback", [True, False])
def test_closing_in_mid_motion_brings_the_arm_to_rest_first(make_robot, from_callback):
    peer, robot = make_robot()
    other = threading.Thread(target=robot.close)
    good = wave(400, size=0.2)

    def callback(state, t):
        if round(t * 1000) == 200:
            robot.close() if from_callback else other.start()
        return good(state, t)

    run = robot.control(callback)
    if not from_callback:
        other.join()
    assert run.stopped == "the session was closed while a motion ran"
    assert_controlled_stop(peer)
    with pytest.raises(UsageError, match="closed; connect again"):
        robot.power_on()


def test_a_stopped_run_is_not_compared_with_the_plan_it_left(make_robot):
    peer, robot = make_robot()
    motion = plan_joint(MODEL, peer.script.q, MODEL.home, speed=0.5)
    run = robot.execute(motion, progress=lambda t, duration: robot.stop() if t > 0.1 else None)
    assert run.stopped == "on request"
    assert "largest error 0 rad (0 deg)" in repr(run)
    assert "<td>0 deg" in run._repr_html_()


def test_two_threads_may_ask_in_turn(make_robot):
    _, robot = make_robot()
    states, errors = [], []

    def ask():
        try:
            states.extend(robot.receive_state() for _ in range(20))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert len(states) == 40


def test_a_closed_session_says_so(make_robot):
    _, robot = make_robot()
    robot.close()
    robot.close()
    for call in (robot.receive_state, robot.power_on, robot.rci.motor_state, robot.recover, lambda: robot.state,
                 lambda: robot.rci.set_do(0, 1), lambda: robot.control(wave(10)),
                 lambda: robot.execute(REST)):  # fmt: skip
        with pytest.raises(UsageError, match="closed; connect again"):
            call()


def test_a_state_is_never_older_than_asked_for(make_robot):
    peer, robot = make_robot()
    newest = robot.receive_state().message_id
    assert robot.receive_state().message_id > newest
    known = robot.receive_state(max_age=60.0)
    assert known.message_id >= newest
    peer.script.silent_at = 0  # From now on nothing comes.
    time.sleep(0.05)
    known = robot.receive_state(max_age=60.0)
    with pytest.raises(ConnectionLostError, match=r"no state within 0\.05 s"):
        robot.receive_state(timeout=0.05)
    assert robot.receive_state(max_age=60.0).message_id >= known.message_id
    time.sleep(0.02)
    with pytest.raises(ConnectionLostError):
        robot.receive_state(timeout=0.05, max_age=0.01)


def test_what_waited_in_the_socket_is_not_answered(make_robot):
    peer, robot = make_robot()
    time.sleep(0.3)  # The vendor's client would answer these first, a burst of old states.
    newest = peer._id
    first = []

    def callback(state, t):
        first.append(state.message_id)
        return JointPosition(state.q_c, finished=t >= 0.01)

    robot.control(callback)
    assert first[0] > newest
    assert np.diff(first).tolist() == [1] * (len(first) - 1)


def test_whoever_has_closed_may_connect_again():
    with Peer() as peer:
        for _ in range(3):
            with connect(peer.url, MODEL) as robot:
                assert robot.rci.motor_state() is True
