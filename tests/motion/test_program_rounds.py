"""Programs from wherever the arm stands, in rounds, with progress; retyped waypoints."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.compute import close_program_of
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint, plan_joint, plan_program

MODEL = load_model("xMatePro7")
HOME = MODEL.forward(MODEL.home)


def beside(*step: float) -> Pose:
    return Pose(HOME.position + step, HOME.wxyz)


PROGRAM = Program(
    model=MODEL.name,
    start=MODEL.home,
    waypoints=(
        Waypoint.line(beside(0.0, 0.1, 0.0), speed=0.6, blend=0.02),
        Waypoint.line(beside(-0.05, 0.1, 0.0), speed=0.6, dwell=0.01),
        Waypoint.joint(MODEL.home + 0.05, speed=0.9),
    ),
)
ALONE = plan_program(MODEL, PROGRAM)


def test_an_arm_elsewhere_is_led_to_the_start_at_the_speed_of_the_first_waypoint():
    here = np.array(MODEL.home) + 0.1
    motion = plan_program(MODEL, PROGRAM, start=here)
    way = plan_joint(MODEL, here, MODEL.home, speed=0.6)
    assert np.array_equal(motion.start, here)
    rows = round(1000 * motion.segment_starts[1])
    assert rows == len(way) - 1
    assert np.allclose(motion.q[:rows], way.q[:rows], atol=1e-12)
    assert np.allclose(motion.q[rows:], ALONE.q, atol=1e-12)
    assert len(motion.segment_starts) == 4


def test_an_arm_at_the_start_is_not_led_there_and_one_a_hair_beside_it_begins_where_it_is():
    assert plan_program(MODEL, PROGRAM, start=MODEL.home).fingerprint == ALONE.fingerprint
    hair = np.array(MODEL.home) + 5e-7
    motion = plan_program(MODEL, PROGRAM, start=hair)
    assert np.array_equal(motion.start, hair)
    assert len(motion.segment_starts) == 3


def test_rounds_are_the_same_motion_again_with_the_way_back_between_them():
    motion = plan_program(MODEL, PROGRAM, rounds=3)
    starts = motion.segment_starts
    assert len(starts) == 3 * 3 + 2
    for segment in (0, 4, 8):
        first = round(1000 * starts[segment])
        assert np.allclose(motion.q[first : first + len(ALONE)], ALONE.q, atol=1e-12)
    assert np.allclose(motion.at(starts[4]).q, MODEL.home)


@pytest.mark.parametrize("rounds", [0, 1.5, 4000])
def test_rounds_are_whole_and_not_too_many(rounds):
    with pytest.raises(InvalidValueError, match="must be whole, 1 to 3333 for 3 waypoints"):
        plan_program(MODEL, PROGRAM, rounds=rounds)


def test_progress_rises_to_one_and_what_it_raises_ends_the_planning():
    told: list[float] = []
    plan_program(MODEL, PROGRAM, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)

    class Enough(Exception):
        pass

    def refuse(part: float) -> None:
        raise Enough

    with pytest.raises(Enough):
        plan_program(MODEL, PROGRAM, progress=refuse)


def test_an_error_has_the_number_of_its_waypoint_and_one_on_the_way_to_the_start_has_none():
    far = Program(model=MODEL.name, start=MODEL.home, waypoints=(*PROGRAM.waypoints, Waypoint.line(beside(3, 0, 0))))
    with pytest.raises(PlanningError, match=r"waypoint 4 \(line\)") as caught:
        plan_program(MODEL, far, start=np.array(MODEL.home) + 0.1)
    assert caught.value.waypoint == 4
    with pytest.raises(PlanningError, match="the move to the start") as caught:
        plan_program(MODEL, PROGRAM, start=MODEL.limits.joint.upper + 0.1)
    assert caught.value.waypoint is None


def test_a_retyped_waypoint_keeps_its_target_and_all_else():
    line = Waypoint.line(beside(0.0, 0.1, 0.0), psi=0.1, speed=0.6, blend=0.02, dwell=0.5)
    arc = line.retyped("arc", (0.1, 0.2, 0.3))
    assert (arc.type, arc.via) == ("arc", (0.1, 0.2, 0.3))
    assert arc.retyped("joint") == Waypoint.joint(beside(0.0, 0.1, 0.0), psi=0.1, speed=0.6, blend=0.02, dwell=0.5)
    assert arc.retyped("line") == line
    with pytest.raises(InvalidValueError, match="has no target"):
        Waypoint.nullspace(0.1).retyped("line")
    with pytest.raises(InvalidValueError, match="via"):
        line.retyped("arc")


@pytest.mark.parametrize("law", ["jerk_limited", "torque_rate_limited"])
def test_one_long_blended_run_tells_its_progress_and_can_be_ended_on_the_way(law):
    program, told = close_program_of(MODEL, 60), []
    plan_program(MODEL, program, law=law, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len({share for share in told if 0.5 < share < 1.0}) >= 5, "between its first round and its end"

    def give_up(share: float) -> None:
        if share > 0.6:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        plan_program(MODEL, program, law=law, progress=give_up)
