"""Programs written against the vendor's library, run by a peer that shares no code with the package."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.peers import programs, wire
from tests.peers.arena import PLANTS, Arena, arena
from tests.peers.endurance import require_led
from tests.peers.kinematics import Model
from tests.peers.robot import ControlException, Output, Robot
from tests.waiting import wait_for

SECONDS = 1.0  # [s] of simulated time, one swing; the long versions are in tests/endurance.
NEAR = tuple(angle + 0.02 for angle in programs.START[7])  # [rad] So that the move before a program takes 0.2 s.


@pytest.fixture(params=PLANTS)
def place(request: pytest.FixtureRequest) -> Iterator[Arena]:
    with arena(plant=request.param) as found:
        yield found


def ended_well(robot: Robot) -> wire.State:
    """The last state: idle modes, no error bit in any state since the beginning, every command in its turn."""
    last = robot.receive_fresh_state()
    assert (last.motion_mode, last.controller_mode, last.robot_mode) == (wire.IDLE, wire.OTHER, wire.ROBOT_IDLE)
    assert not any(state.errors for state in robot.states)
    assert min(state.success_rate[0] for state in robot.states) == 1.0
    return last


def moving(robot: Robot, mode: int) -> list[wire.State]:
    return [state for state in robot.states if state.controller_mode == mode and state.robot_mode == wire.ROBOT_MOVE]


@pytest.mark.parametrize("name", ["xMatePro7", "xMatePro3", "xMate7", "xMate3"])
def test_movej_arrives_on_every_arm(name: str) -> None:
    with arena(model=name) as place, place.connect() as robot:
        programs.prepare(robot)
        goal = programs.LEFT[robot.axes]
        assert np.allclose(ended_well(robot).q[: robot.axes], goal, atol=1e-4)  # The client's filter lags a little.


PROGRAMS: dict[str, tuple[int, Callable[..., Any]]] = {
    "joint sine": (wire.JOINT_POSITION, programs.joint_sine),
    "line": (wire.CARTESIAN_POSITION, programs.line),
    "circle": (wire.CARTESIAN_POSITION, programs.circle),
    "tool rotation": (wire.CARTESIAN_POSITION, programs.tool_rotation),
    "null space": (wire.CARTESIAN_POSITION, programs.nullspace),
    "joint impedance": (wire.JOINT_IMPEDANCE, programs.joint_impedance),
    "Cartesian impedance": (wire.CARTESIAN_IMPEDANCE, programs.cartesian_impedance),
    "torque": (wire.TORQUE, programs.torque),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_runs_to_its_end_and_moves_the_arm(place: Arena, name: str) -> None:
    mode, program = PROGRAMS[name]
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.states.clear()
        program(robot, SECONDS, period=SECONDS)
        ended_well(robot)
        states = moving(robot, mode)
        assert len(states) >= SECONDS / programs.CYCLE
        q = np.array([state.q for state in states])
        assert np.ptp(q, axis=0).max() > 5e-3
    wait_for(lambda: place.entries[-1].kind == "disconnected", 30.0, "the end of the connection")
    assert {entry.kind for entry in place.entries} == {
        "connected", "power_on", "motion_started", "motion_ended", "disconnected",
    }  # fmt: skip


def test_the_state_agrees_with_the_model_that_was_downloaded(place: Arena) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        model = Model(robot.load_robot_model())
        robot.states.clear()
        programs.nullspace(robot, SECONDS, period=SECONDS)
        for state in moving(robot, wire.CARTESIAN_POSITION)[::20]:
            assert np.allclose(state.pos_m, model.pose(state.q).ravel(), atol=1e-9)
            assert np.allclose(state.pos_c, model.pose(state.q_c).ravel(), atol=1e-9)
            assert state.psi_m[0] == pytest.approx(model.arm_angle(state.q), abs=1e-9)
            assert np.allclose(state.vel_c, model.jacobian(state.q_c) @ state.dq_c, atol=1e-3)


def test_in_the_null_space_the_tool_stands_still_and_the_elbow_swings(place: Arena) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.states.clear()
        programs.nullspace(robot, SECONDS, period=SECONDS)
        states = moving(robot, wire.CARTESIAN_POSITION)
        poses = np.array([state.pos_c for state in states])
        assert np.ptp(poses, axis=0).max() < 1e-5  # It begins where the arm is measured to be.
        assert np.ptp([state.psi_c for state in states]) > 0.01


def test_a_program_that_ends_in_motion_is_brought_to_rest(place: Arena) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.states.clear()
        programs.nullspace(robot, 0.75)
        ended_well(robot)


def test_movel_arrives_at_the_pose_with_the_arm_angle(place: Arena) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        start = robot.receive_fresh_state()
        goal = list(start.pos_m)
        goal[11] -= 0.02  # z
        programs.move_l(robot, 0.5, start, goal, start.psi_m[0] + 0.02)
        last = ended_well(robot)
        assert np.allclose(last.pos_c, goal, atol=2e-5)
        assert last.psi_c[0] == pytest.approx(start.psi_m[0] + 0.02, abs=1e-3)


def test_dragging_opens_and_closes(place: Arena) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        seen = programs.drag(robot, 20)
        assert all(state.robot_mode == wire.ROBOT_GUIDING for state in seen)
        assert np.ptp([state.q for state in seen], axis=0).max() < 1e-3  # Nobody pulls, and nothing sags.
        last = ended_well(robot)
        tool_height = last.pos_m[11] - Model(robot.load_robot_model()).pose(last.q)[2, 3]
        assert tool_height != 0.0  # The tool of the drag program is in the pose.


@pytest.mark.parametrize("name", programs.DRAGS)
def test_a_hand_leads_the_arm_where_the_drag_lets_it(place: Arena, name: str) -> None:
    with place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.states.clear()
        seen = programs.led_by_hand(
            robot, SECONDS, *programs.DRAGS[name], lambda w: place.between(lambda c: c.plant.push(w))
        )
        ended_well(robot)
        require_led(seen, name)


def test_without_a_state_in_time_the_last_one_is_answered_again() -> None:
    with arena() as place, place.connect(receive_timeout=1e-4) as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.receive_robot_state()  # In lock-step each repeated command brought a state; they are all still unread.
        robot.states.clear()
        programs.joint_sine(robot, SECONDS, period=SECONDS)
        assert robot.timeouts > 0
        assert not ended_well(robot).errors


def test_the_burst_of_old_states_after_startmove_is_survived() -> None:
    """Free-running, with the modes shown at once: the client's buffer fills with states, all answered at once."""
    with arena(lockstep=False, mode_delay=0.0, lost_limit=None) as place:
        with place.connect(start_sleep=0.5) as robot:
            robot.set_motor_power(1)
            start = robot.receive_robot_state().q
            programs.move_j(robot, 0.5, start, programs.LEFT[7])
            assert not robot.receive_fresh_state().errors
            assert np.allclose(robot.receive_fresh_state().q, programs.LEFT[7], atol=1e-4)


@pytest.mark.parametrize("name", ["xMate7", "xMate3"])
def test_rubbish_in_seventh_elements_of_six_axis_arms_is_not_looked_at(name: str) -> None:
    with arena(model=name) as place, place.connect() as robot:
        robot.set_collision_behavior((75, 75, 45, 30, 30, 20))
        robot.set_joint_limit((2.0, 2.0, 2.0, 2.0, 2.0, 6.0), (-2.0, -2.0, -2.0, -2.0, -2.0, -6.0))
        robot.set_joint_impedance((3000, 3000, 3000, 300, 300, 300))
        robot.enable_virtual_guide(True)
        programs.prepare(robot, factor=1.0)
        programs.joint_sine(robot, SECONDS, period=SECONDS)
        ended_well(robot)


def test_a_second_start_on_a_poisoned_object_still_moves_the_arm() -> None:
    """After a fault the library's object is spoiled, the controller is not: it moves, then the old error comes."""
    with arena() as place, place.connect() as robot:
        programs.prepare(robot, NEAR, factor=1.0)
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
        with pytest.raises(ControlException, match="kCommandJointVelocityLimitsViolation"):
            robot.control(lambda state: Output(q=tuple(q + 0.5 for q in state.q)))
        robot.automatic_error_recovery()
        robot.states.clear()
        with pytest.raises(ControlException, match="kCommandJointVelocityLimitsViolation"):
            programs.joint_sine(robot, SECONDS, period=SECONDS)
        assert not robot.receive_fresh_state().errors
        assert np.ptp([state.q for state in robot.states], axis=0).min() > 0.1
