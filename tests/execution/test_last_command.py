"""What becomes of a motion whose last command still moves, or whose last commands the controller finds wrong."""

from __future__ import annotations

import numpy as np
import pytest

import rcilab
from rcilab.core.command import CartesianPosition, JointPosition
from rcilab.core.errors import ControlError, InvalidValueError
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from tests.execution.peer import Script, wave


@pytest.mark.parametrize("mode", ["joint_position", "joint_impedance"])
def test_a_callback_that_ends_at_speed_is_brought_to_rest_and_told_so(mode):
    model = rcilab.load_model("xMatePro7")
    with rcilab.simulate(model) as robot:
        robot.power_on()
        start = robot.state.q_c

        def swing(state, t):
            q = start.copy()
            q[1] += 0.1 * (1.0 - np.cos(3.0 * t))
            return JointPosition(q, finished=t >= 0.5)

        with pytest.raises(
            InvalidValueError,
            match=r"last command at t = .* would be needed to stop there.*joint 2: .*acceleration",
        ):
            robot.control(swing, mode)
        state = robot.state
        assert state.faults == ()
        assert np.abs(state.dq).max() < 1e-6
        assert 0.0 < state.q_c[1] - start[1] - 0.1 * (1.0 - np.cos(1.5)) < 0.1


def test_a_pose_that_ends_at_speed_is_brought_to_rest_and_told_so():
    model = rcilab.load_model("xMatePro7")
    with rcilab.simulate(model) as robot:
        robot.power_on()
        start = robot.state.T_base_tool_c.matrix

        def swing(state, t):
            T = start.copy()
            T[2, 3] -= 0.02 * (1.0 - np.cos(3.0 * t))
            return CartesianPosition(T, finished=t >= 0.5)

        with pytest.raises(
            InvalidValueError,
            match=r"last command at t = .* would be needed to stop there.*acceleration",
        ):
            robot.control(swing, "cartesian_position")
        assert robot.state.faults == ()


def test_a_fault_in_what_is_played_after_the_last_command_is_an_error(make_robot):
    _, robot = make_robot(Script(fault_on_stop=True))
    with pytest.raises(ControlError, match="kCommandJointVelocityLimitsViolation") as caught:
        robot.control(wave(150))
    assert caught.value.faults == (Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,)
    assert caught.value.record["faults"][-1] != 0
    robot.recover()
    assert robot.control(wave(150)).faults == ()


def test_commands_beyond_every_bound_end_by_stop_move(make_robot):
    """There the planner of the way to rest gives up; what the callback raised comes out all the same."""
    peer, robot = make_robot()

    def callback(state, t):
        if t >= 0.02:
            raise LookupError("mine")
        return CartesianPosition(np.eye(4), psi=0.25 * t if t < 0.019 else 1e200)

    with pytest.raises(LookupError, match="mine"):
        robot.control(callback, mode="cartesian_position")
    assert isinstance(peer.requests[-1], rci.StopMove)
