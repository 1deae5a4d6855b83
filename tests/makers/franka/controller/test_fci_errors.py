"""The errors of commands: each raised by its name and bit, in the right cycle, and recovered from."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rcilab.app.text import Text
from rcilab.conformance.check import check, check_commands
from rcilab.conformance.signals import Record
from rcilab.i18n.error_messages import describe_note
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion
from tests.peers.franka import programs, wire
from tests.peers.franka.arena import MODELS, FciArena, fci_arena
from tests.peers.franka.faults import CASES, END, TORQUE, near_end
from tests.peers.franka.robot import Output, Robot
from tests.peers.franka.wire import ERROR_NAMES


@pytest.mark.parametrize("name", CASES)
def test_a_wrong_command_raises_its_error_and_is_not_followed(robot: Robot, place: FciArena, name: str) -> None:
    case, version = CASES[name], robot.version
    if case.q is not None:
        q = near_end(version) if case.q == END else case.q
        answer = place.simulate("place_arm", q=q)
        assert answer["ok"], answer
        robot.skip(3)
    generator = case.generator
    if generator == TORQUE:
        generator = wire.NONE if version == 10 else wire.JOINT_VELOCITY
    start = robot.move(case.controller, generator)
    wrong = case.build(start)
    ending = robot.play(start, wrong.outputs)
    errors = case.errors if isinstance(case.errors, str) else case.errors[version]
    expected = {ERROR_NAMES[int(number)] for number in errors.split() if number != "..."}
    found = set(ending.state.errors)
    assert (found >= expected) if "..." in errors else (found == expected), found
    assert ending.status == "reflex"
    assert ending.state.reflex_reason == ending.state.errors
    assert (ending.state.robot_mode, ending.state.generator, ending.state.controller) == (wire.ROBOT_REFLEX, 0, 3)
    if wrong.rows is not None and generator in (wire.JOINT_POSITION, wire.CARTESIAN_POSE):
        is_cartesian = generator == wire.CARTESIAN_POSE
        first, faults = judged_before(robot, wrong.rows, is_cartesian=is_cartesian)
        assert first == wrong.at
        assert found == faults
    if wrong.at >= 0:
        assert ending.sent - 1 in (wrong.at, wrong.at + 1)  # One more may be on its way.
    require_chinese(place)
    recover(robot, ending.state.errors)


def require_chinese(place: FciArena) -> None:
    """Requires that the reason for an error exists in both languages."""
    note = describe_note(place.controller.reason)
    assert "remark." not in Text("en").render(note)
    assert re.search("[一-鿿]", Text("zh").render(note))


def judged_before(robot: Robot, rows: np.ndarray, *, is_cartesian: bool) -> tuple[int, set[str]]:
    """Returns the first cycle in which the check finds a motion wrong, and the errors of that cycle.

    These poses are sent with the elbow; `check` itself leaves that of an FR3 free, as pylibfranka does.
    """
    motion, model = Motion.from_cycles(rows), load_model(MODELS[robot.version])
    if is_cartesian:
        report = check_commands(motion, model, Record(is_to_come=True), distance=None, mode="cartesian_position")
    else:
        report = check(motion, model, distance=None)
    necessary = [violation for violation in report.violations if violation.fault is not None]
    first = min(round(violation.time / 0.001) for violation in necessary)
    return first, {v.fault.manual_name for v in necessary if round(v.time / 0.001) == first and v.fault is not None}


@pytest.mark.parametrize(("version", "bound"), [(5, "2.175"), (10, "2.62")])
def test_an_error_is_one_line_with_the_value_and_its_bound(version: int, bound: str) -> None:
    with fci_arena(version) as place, place.connect() as robot:
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        robot.play(start, CASES["a joint too fast"].build(start).outputs)
        place.between(lambda: None)
        (line,) = place.log("fault")
        assert not place.log("refused"), "the end of a motion is no refused request"
    assert line.startswith("joint_motion_generator_velocity_limits_violation: joint 1: commanded velocity 2.")
    assert line.endswith(f"passes {bound} rad/s; the arm stops")


def recover(robot: Robot, errors: tuple[str, ...]) -> None:
    """Recovers after errors and moves."""
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION) == "not possible"
    assert robot.ask("automatic_error_recovery").status == "success"
    state = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
    assert state.errors == ()
    assert state.reflex_reason == errors
    assert any(state.robot_mode == wire.ROBOT_RECOVERING for state in robot.states)
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    assert start.reflex_reason == errors  # Until an error ends another motion.
    ending = robot.play(start, programs.motion(start, wire.JOINT_POSITION, height=-0.002), cycles=201)
    assert (ending.status, ending.state.errors) == ("success", ())


def test_the_last_good_command_is_where_the_arm_stops_from(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION, cycles=800, height=0.1)
    good = [program(start, k) for k in range(300)]
    ending = robot.play(start, [*good, Output(q=programs.with_offset(start.q_d, 0, 1.0))])
    assert ending.state.errors
    stopped = robot.state_when(lambda state: state.dq_d == programs.ZERO)
    last = good[-1].q
    assert last is not None
    assert 0.0 < abs(stopped.q_d[3] - last[3]) < 0.02
    assert stopped.q_d[0] == pytest.approx(start.q_d[0], abs=1e-6)
    rows = np.array([state.q_d for state in robot.states[-200:]])
    assert (np.abs(np.diff(rows, 2, axis=0)) < 1.3e-5).all()
