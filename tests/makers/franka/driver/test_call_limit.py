"""A controller that stops answering: the call of the client library, which has no time limit of its own, is ended."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from rcilab.control_process.launch import start_controller
from rcilab.core.command import JointPosition
from rcilab.core.errors import ConnectionLostError
from rcilab.execution.connect import connect
from rcilab.execution.session import RobotSession
from rcilab.makers.franka.driver.call_limit import CallLimit
from tests.makers.franka.driver.conftest import ARMS


@pytest.fixture
def short_limit(monkeypatch):
    """Gives each call 2 s: the controllers here are stopped for good."""
    start = CallLimit.start
    monkeypatch.setattr(CallLimit, "start", lambda limit, seconds: start(limit, min(seconds, 2.0)))


def _set_load(robot: RobotSession, pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    robot.fci.set_load(0.0, np.zeros(3))


def _begin(robot: RobotSession, pid: int) -> None:
    os.kill(pid, signal.SIGSTOP)
    robot.control(lambda state, t: JointPosition(state.q_c))


def _move(robot: RobotSession, pid: int) -> None:
    def hold(state, t):
        if t >= 0.05:
            os.kill(pid, signal.SIGSTOP)
        return JointPosition(state.q_c)

    robot.control(hold)


@pytest.mark.usefixtures("short_limit")
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("use", [_set_load, _begin, _move])
def test_a_controller_that_stops_answering_is_a_lost_connection(name, use):
    controller = start_controller(name)
    try:
        with connect(controller.address) as robot:
            with pytest.raises(ConnectionLostError, match=r"it did not answer within 2 s|no state for 1 s"):
                use(robot, controller.pid)
            with pytest.raises(ConnectionLostError, match="the connection is lost"):
                robot.recover()
        os.kill(controller.pid, signal.SIGCONT)
        with connect(controller.address) as robot:
            assert robot.state.faults == ()
    finally:
        controller.end()
