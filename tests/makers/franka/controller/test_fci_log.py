"""The log of the virtual Franka controller: kinds and facts as docs/controller.md has them, and plain lines."""

from __future__ import annotations

import pytest

from rcilab.recording.client_motions import ClientMotions
from rcilab.recording.client_report import report_on_client
from rcilab.recording.run import build_run
from tests.peers.franka import hand, programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Output, Robot
from tests.waiting import wait_for


def kinds(place: FciArena) -> list[str]:
    return [entry.kind for entry in place.arena.entries]


def facts(place: FciArena, kind: str) -> dict[str, object]:
    """The facts of the newest entry of a kind."""
    return dict([entry for entry in place.arena.entries if entry.kind == kind][-1].facts)


def jump(robot: Robot) -> None:
    """Ends a motion by an error."""
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    outputs = [Output(q=start.q_d)] * 20 + [Output(q=programs.with_offset(start.q_d, 0, 0.1))] * 5
    assert robot.play(start, outputs).status == "reflex"


def test_a_program_can_be_followed_by_its_log() -> None:
    with fci_arena(10) as place:
        with place.connect() as robot:
            start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
            assert robot.play(start, programs.motion(start, wire.JOINT_POSITION), cycles=201).status == "success"
            ended = facts(place, "motion_ended")
            jump(robot)
            assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION) == "not possible"
            assert robot.ask("automatic_error_recovery").status == "success"
            place.simulate("press", button="estop")
            assert robot.ask("stop_move").status == "emergency"
            place.simulate("press", button="none")
            place.simulate("guide", on=True)
            place.simulate("guide", on=False)
            robot.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
        wait_for(lambda: "disconnected" in kinds(place), 30.0, "the end of the connection")
        assert kinds(place) == [
            "connected", "motion_started", "motion_ended", "motion_started", "fault", "motion_ended", "refused",
            "recovered", "safety_stop", "refused", "safety_release", "guiding_started", "guiding_ended",
            "disconnected",
        ]  # fmt: skip
        assert facts(place, "motion_started") == {"mode": "joint_position"}
        assert ended == {
            "duration": 0.201, "cycles": 202, "without_command": 0, "late": 0, "repeated": 0, "is_fault": False,
        }  # fmt: skip
        assert facts(place, "motion_ended")["is_fault"] is True
        assert place.log("motion_ended")[1].startswith("motion stopped after 0.0")
        assert place.log("refused") == [
            "Move was answered: not possible in this mode; an error stopped the arm: recover first",
            "StopMove was answered: the user stop aborted the motion; the user stop is pressed: release it",
        ]
        assert facts(place, "refused") == {
            "request": "StopMove", "status": "EMERGENCY_ABORTED", "phase": "user_stopped",
        }  # fmt: skip
        assert place.log("recovered")[0].startswith("faults cleared: joint_motion_generator_")
        assert facts(place, "recovered") == {"phase": "idle"}


def test_a_motion_to_goals_lasts_until_the_arm_has_stopped() -> None:
    with fci_arena(10) as place, place.connect() as robot:
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION, goal_velocity=(0.4,) * 7)
        goal = programs.with_offset(start.q_d, 0, 0.2)
        first = robot.state()
        robot.answer(first, Output(q=goal))
        state = robot.state_when(lambda state: abs(state.q_d[0] - goal[0]) < 1e-6 and state.dq_d == programs.ZERO)
        assert robot.play(state, [Output(q=goal)]).status == "success"
        ended = facts(place, "motion_ended")
        assert ended["duration"] == pytest.approx(1e-3 * (state.message_id - first.message_id), abs=0.05)
        assert ended["duration"] > 0.5
        assert place.log("motion_started") == ["motion started: joint goals under joint impedance"]


@pytest.mark.parametrize(("version", "text"), [(5, "torque along with joint velocity"), (10, "torque")])
def test_torques_are_named_so(version: int, text: str) -> None:
    with fci_arena(version) as place, place.connect() as robot:
        start = robot.move(wire.EXTERNAL, wire.NONE if version == 10 else wire.JOINT_VELOCITY)
        robot.play(start, [Output(dq=programs.ZERO, tau=programs.ZERO)])
        assert place.log("motion_started") == [f"motion started: {text}"]
        assert facts(place, "motion_started") == {"mode": "torque"}


def test_commands_that_repeat_the_last_torque_count_neither_in_log_nor_record() -> None:
    with fci_arena(10, is_recorded=True) as place, place.connect() as robot:
        ring = place.arena.server.ring
        assert ring is not None
        motions = ClientMotions(ring)
        start = robot.move(wire.EXTERNAL, wire.NONE)
        robot.play(start, programs.motion(start, wire.NONE, cycles=100), cycles=101)
        robot.skip(20)
        cycles = facts(place, "motion_ended")["cycles"]
        part = motions.poll(is_last=True)[-1]
        assert part.end is not None
        assert part.end.received == cycles == 102
        run = build_run(part.cycles, plan=None, model=part.motion.model, setup=part.motion.setup, realtime=False)
        assert "the controller played them" not in report_on_client(run, part.end).text


def test_a_client_of_the_hand_and_what_its_fingers_do_are_named() -> None:
    with fci_arena(10) as place, place.connect_hand() as client:
        assert client.ask(hand.MOVE, 0.05, 0.2) == "success"
        assert client.ask(hand.MOVE, 0.09, 0.1) == "fail"
        assert client.ask(hand.GRASP, 0.03, 0.005, 0.005, 0.2, 40.0) == "success"
        client.state()
        assert place.log() == [
            "client 127.0.0.1 (hand) connected",
            "the hand: a move to 50 mm at 200 mm/s ended: done, 50.0 mm open",
            "the hand refused a move to 90 mm at 100 mm/s: it takes widths of 0 to 80 mm, speeds above 0 up to "
            "200 mm/s and forces above 0 up to 140 N",
            "the hand: a grasp of 30 mm at 200 mm/s with 40 N ended: done, 30.0 mm open",
        ]
        assert facts(place, "hand") == {"request": "Grasp", "status": "SUCCESS", "width": 0.03}
