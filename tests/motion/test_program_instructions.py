"""Steps of programs besides waypoints: signals, waits, blocks, approaches, and the motion that they become."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

import rcilab
from rcilab import Cell, Motion, Pose, Program, Waypoint
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_program
from rcilab.motion.motion_event import MotionEvent, cycle_events
from rcilab.motion.program_expansion import expand
from rcilab.motion.speed_scaling import as_planned, start_with_override

MODEL = load_model("xMatePro7")
HOME = MODEL.forward(MODEL.home)
ASIDE = tuple(np.array(MODEL.home) + [0.2, 0, 0, 0, 0, 0, 0])
PICK = Pose(HOME.position - (0.0, 0.0, 0.05), HOME.wxyz)


def program(*steps: Waypoint, model: str = "xMatePro7") -> Program:
    return Program(model=model, start=tuple(MODEL.home), waypoints=steps)


def plan(*steps: Waypoint, **options) -> Motion:
    return plan_program(MODEL, program(*steps), **options)


def test_every_instruction_survives_file_script_and_motion_file(tmp_path):
    steps = (
        Waypoint.comment("to the tray"),
        Waypoint.repeat(3, until="part in tray", level=False, text="pick"),
        Waypoint.line(PICK, approach=0.04, speed=0.3),
        Waypoint.use_tool("close"),
        Waypoint.retreat(0.04, speed=0.3),
        Waypoint.set_output("close gripper", False),
        Waypoint.await_input("gripper closed", timeout=2.0),
        Waypoint.wait(0.2),
        Waypoint.joint(ASIDE),
        Waypoint.end(),
        Waypoint.group("home"),
        Waypoint.joint(MODEL.home),
        Waypoint.end(),
    )
    written = program(*steps)
    assert Program.from_json(written.to_json()) == written
    assert written.needs_cell
    scope: dict[str, object] = {}
    script = written.to_python()
    exec(script[: script.index("model = program")], scope)
    assert scope["program"] == written
    resolved = Cell.example("pick_place").resolve(written)
    assert [step.signal for step in resolved.waypoints if step.signal is not None] == [0, 0, 0, 1]
    motion = plan_program(MODEL, resolved)
    motion.save(tmp_path / "a.npz")
    again = Motion.load(tmp_path / "a.npz")
    assert again.events == motion.events
    assert again.fingerprint == motion.fingerprint
    assert len(motion.events) == 3 * 3 + 3


def test_an_output_is_set_on_the_way_and_a_wait_stands_still():
    way = (Waypoint.line(PICK, blend=0.02, speed=0.5), Waypoint.joint(ASIDE, speed=0.5))
    without, with_output = plan(*way), plan(way[0], Waypoint.set_output(2), way[1])
    assert np.array_equal(without.q, with_output.q)
    (event,) = with_output.events
    assert (event.kind, event.signal, event.level, event.row) == ("output", 2, True, 2)
    assert event.time == without.segment_starts[1]
    assert with_output.fingerprint != without.fingerprint
    waiting = plan(way[0], Waypoint.await_input(1), way[1])
    (event,) = waiting.events
    row = cycle_events(as_planned(waiting))[0].cycle
    assert np.array_equal(waiting.q[row], waiting.q[row - 3])
    assert np.array_equal(waiting.q[row], waiting.q[row + 3])


def test_blocks_repeat_their_steps_and_nest():
    step, back = Waypoint.joint(ASIDE, speed=0.8), Waypoint.joint(MODEL.home, speed=0.8)
    nested = (Waypoint.repeat(2), step, Waypoint.repeat(3), back, step, Waypoint.end(), back, Waypoint.end())
    found = expand(nested)
    assert found.rows == (2, *(4, 5) * 3, 7) * 2
    plain = plan(*(step, *(back, step) * 3, back) * 2)
    assert np.array_equal(plan(*nested).q, plain.q)


def test_a_block_may_be_left_as_soon_as_an_input_comes():
    steps = (Waypoint.repeat(3, until=4), Waypoint.joint(ASIDE), Waypoint.joint(MODEL.home), Waypoint.end())
    motion = plan(*steps, Waypoint.joint(ASIDE))
    assert [event.kind for event in motion.events] == ["leave", "leave", "input"]
    rows = cycle_events(as_planned(motion))
    for row in rows[:2]:
        assert np.array_equal(motion.q[row.cycle], motion.q[row.until])
        assert row.until > rows[2].cycle - 1
    slow = start_with_override(motion, 0.5)
    for event, row in zip(motion.events, cycle_events(slow), strict=True):
        assert slow.plan_time[row.cycle] >= event.time - 1e-9


def test_rounds_and_an_approach_to_the_start_have_their_own_events():
    steps = (Waypoint.joint(ASIDE), Waypoint.set_output(0), Waypoint.joint(MODEL.home), Waypoint.set_output(0, False))
    motion = plan(*steps, rounds=2, start=ASIDE)
    times = [event.time for event in motion.events]
    assert [event.level for event in motion.events] == [True, False, True, False]
    assert times == sorted(times)
    assert np.allclose(motion.at(times[0]).q, ASIDE, atol=1e-9)
    assert np.allclose(motion.at(times[1]).q, MODEL.home, atol=1e-9)
    assert motion.slowed(2.0).events[1].time == pytest.approx(2.0 * times[1])


@pytest.mark.parametrize("kind", ["line", "joint"])
@pytest.mark.parametrize("target", [PICK, MODEL.inverse(PICK, MODEL.arm_angle(MODEL.home)).nearest(MODEL.home)])
def test_the_tool_approaches_and_retreats_along_its_axis(kind, target):
    motion = plan(getattr(Waypoint, kind)(target, approach=0.04), Waypoint.retreat(0.03))
    first, second = (MODEL.forward(motion.at(float(t)).q) for t in motion.segment_starts[1:])
    assert np.allclose(first.position, (PICK @ Pose((0, 0, -0.04))).position, atol=1e-6)
    assert second.is_close(PICK, 1e-6)
    assert np.allclose(MODEL.forward(motion.goal).position, (PICK @ Pose((0, 0, -0.03))).position, atol=1e-6)
    between = MODEL.position_path(motion.q[motion.segment == 1]) - PICK.position
    axis = PICK.rotation[:, 2]
    assert np.abs(between - np.outer(between @ axis, axis)).max() < 1e-6


def test_a_step_leads_around_the_obstacles_of_a_cell():
    pytest.importorskip("ompl")
    model = load_model("xMatePro7")
    cell = Cell(
        model="xMatePro7",
        floor=None,
        obstacles=(Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 1.0)), pose=Pose((0.5, 0.25, 0.5))),),
    )
    goal = np.array(model.home) + [0.9, 0, 0, 0, 0, 0, 0]
    steps = program(Waypoint.free(goal, speed=0.4), Waypoint.set_output(0))
    with pytest.raises(InvalidValueError, match=r"waypoint 1 \(free\), type needs the cell"):
        plan_program(model, steps)
    motion = plan_program(model, steps, free=partial(rcilab.plan_free, cell=cell))
    assert rcilab.check(motion, model, cell=cell).ok
    assert np.allclose(motion.goal, goal)
    assert not rcilab.check(plan_program(model, program(Waypoint.joint(goal, speed=0.4))), model, cell=cell).ok


@pytest.mark.parametrize(
    ("act", "expected"),
    [
        (lambda: plan(Waypoint.repeat(2), Waypoint.joint(ASIDE)), r"waypoint 1 \(repeat\), end is missing"),
        (lambda: plan(Waypoint.joint(ASIDE), Waypoint.end()), r"waypoint 2 \(end\), end is missing a block"),
        (lambda: plan(Waypoint.comment("only")), "have no motion"),
        (lambda: plan(Waypoint.joint(ASIDE), Waypoint.set_output("lamp")), "'lamp' is a name: plan cell.resolve"),
        (lambda: plan(Waypoint.joint(ASIDE), Waypoint.use_tool("open")), r"waypoint 2 \(tool\), jaws needs a cell"),
        (lambda: plan(*(Waypoint.repeat(1000),) * 2, Waypoint.joint(ASIDE), *(Waypoint.end(),) * 2),
         "with repetitions must be 1 to 10000"),
        (lambda: Waypoint.repeat(0), "count must be whole, 1 to 1000"),
        (lambda: Waypoint.set_output(-1), "signal must be whole, 0 to 1023, or a name"),
        (lambda: Waypoint.set_output(0, 2), "level must be True or False"),
        (lambda: Waypoint.await_input(0, timeout=-1.0), r"timeout must be from 0 to 3600 \[s\]"),
        (lambda: Waypoint.retreat(0.0), r"distance must be from more than 0 to 1 \[m\]"),
        (lambda: Waypoint(type="output", signal=1, speed=0.5), "speed: 0.5 has no meaning here; output takes"),
        (lambda: Waypoint.comment("a\nb"), "text must be text in one line"),
        (lambda: Waypoint.free(ASIDE).retyped("circle"), "has no target"),
        (lambda: Cell.example("pick_place").resolve(program(Waypoint.set_output("lamp"))), "'lamp' is no output of"),
        (lambda: Cell(model="xMatePro7").resolve(program(Waypoint.use_tool("open"))), "the cell's tool has no jaws"),
        (lambda: MotionEvent("output", -1.0, 0, True), "must be finite and not below 0"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_step_is_said(act, expected):
    with pytest.raises(InvalidValueError, match=expected):
        act()


def test_the_jaws_have_their_own_output_unless_the_step_names_one():
    cell = Cell.example("machine_tending")
    steps = (Waypoint.use_tool("close"), Waypoint(type="tool", signal="close chuck"), Waypoint(type="tool", signal=5))
    assert [step.signal for step in cell.resolve(program(*steps)).waypoints] == [2, 1, 5]


def test_a_block_that_may_be_left_ends_at_one_place():
    with pytest.raises(PlanningError, match=r"waypoint 1 \(repeat\): its repetitions end at different positions"):
        plan(Waypoint.repeat(2, until=0), Waypoint.retreat(0.02), Waypoint.end())
