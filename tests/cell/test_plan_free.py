from __future__ import annotations

import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box, Solid
from rcilab.cell.tool import Tool
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose

pytest.importorskip("ompl")

MODEL = rcilab.load_model("xMatePro7")
START = MODEL.home
GOAL = START + np.array((1.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
WALL = Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 1.0)), pose=Pose((0.5, 0.25, 0.5)))
ROOF = Obstacle(name="roof", shape=Box(size=(0.6, 0.6, 0.05)), pose=Pose((0.5, 0.3, 1.1)))
CELL = Cell(model="xMatePro7", obstacles=(WALL, ROOF))


@pytest.mark.parametrize("least", [0.0, 0.03])
def test_the_motion_goes_around_what_the_straight_one_hits(least: float) -> None:
    distance = ClearanceLimit(links=least, floor=least, cell=least)
    assert not rcilab.check(rcilab.plan_joint(MODEL, START, GOAL), MODEL, cell=CELL).ok
    motion = rcilab.plan_free(MODEL, START, GOAL, CELL, distance=distance)
    np.testing.assert_allclose(motion.start, START, atol=1e-12)
    np.testing.assert_allclose(motion.goal, GOAL, atol=1e-9)
    assert rcilab.check(motion, MODEL, cell=CELL, distance=distance).ok


def test_the_tool_is_carried_around_as_well() -> None:
    tool = Tool(
        T_flange_tool=Pose((0.0, 0.0, 0.15)),
        solids=(Solid(shape=Box(size=(0.1, 0.1, 0.15)), pose=Pose((0, 0, 0.075))),),
    )
    cell = Cell(model="xMatePro7", tool=tool, obstacles=(WALL,))
    motion = rcilab.plan_free(MODEL, START, GOAL, cell)
    assert rcilab.check(motion, MODEL, cell=cell).ok


def test_a_seed_gives_the_same_motion_again() -> None:
    first, again, other = (rcilab.plan_free(MODEL, START, GOAL, CELL, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.q, again.q)
    assert first.fingerprint != other.fingerprint


def test_a_free_straight_line_is_the_joint_motion() -> None:
    free = Cell(model="xMatePro7", obstacles=(ROOF,))
    goal = START + 0.1
    np.testing.assert_array_equal(rcilab.plan_free(MODEL, START, goal, free).q, rcilab.plan_joint(MODEL, START, goal).q)


def test_an_end_that_touches_is_named() -> None:
    at_goal = Obstacle(name="box", shape=Box(size=(0.1, 0.1, 0.1)), pose=MODEL.forward(GOAL))
    with pytest.raises(PlanningError, match=r"the goal is not free: link 7 and box overlap by .* mm"):
        rcilab.plan_free(MODEL, START, GOAL, CELL.placed(at_goal))


def test_a_search_without_time_ends_with_one_sentence() -> None:
    with pytest.raises(PlanningError, match=r"no path around the obstacles was found in 1e-06 s: give the search more"):
        rcilab.plan_free(MODEL, START, GOAL, CELL, budget=1e-6)


def test_the_progress_cancels_the_search() -> None:
    seen: list[float] = []

    def cancel(share: float) -> None:
        seen.append(share)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rcilab.plan_free(MODEL, START, GOAL, CELL, progress=cancel)
    assert len(seen) >= 1
    assert 0.0 <= seen[0] <= 1.0


@pytest.mark.parametrize(
    ("values", "said"), [({"budget": 0.0}, "budget"), ({"seed": -1}, "seed"), ({"speed": 2.0}, "speed")]
)
def test_bad_values_are_named(values, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        rcilab.plan_free(MODEL, START, GOAL, CELL, **values)


def test_the_library_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    rcilab.plan_free(MODEL, START, GOAL, CELL, seed=1)
    rcilab.plan_free(MODEL, START, GOAL, CELL, seed=2)
    assert capfd.readouterr() == ("", "")


def test_a_search_can_be_cancelled_while_it_shortens_the_path() -> None:
    def cancel(share: float) -> None:
        if share == 1.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rcilab.plan_free(MODEL, START, GOAL, CELL, progress=cancel, budget=60.0)
