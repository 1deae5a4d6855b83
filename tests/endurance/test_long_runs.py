"""Ten minutes of streaming, ten thousand motions, a million datagrams, and programs at the vendor's pace."""

from __future__ import annotations

import pytest

from tests.peers import endurance, programs
from tests.peers.arena import PLANTS
from tests.peers.test_start_of_motion import STARTS, begin_in_every_mode

pytestmark = pytest.mark.endurance

PROGRAMS = {  # [s]
    "joint_sine": 10.0,
    "line": 10.0,
    "circle": 10.0,
    "tool_rotation": 5.0,
    "nullspace": 10.0,
    "joint_impedance": 10.0,
    "cartesian_impedance": 10.0,
    "torque": 10.0,
}


@pytest.mark.parametrize("plant", PLANTS)
def test_ten_minutes_of_streaming_lose_nothing_and_leave_memory_flat(plant: str) -> None:
    endurance.stream(plant, 600.0, warm_up=30.0)


@pytest.mark.parametrize("plant", PLANTS)
def test_ten_thousand_motions_leave_no_trace(plant: str) -> None:
    endurance.run_motions(plant, 10_000, warm_up=500)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("where", STARTS)
def test_every_mode_begins_after_every_mode_again_and_again(where: str, plant: str) -> None:
    begin_in_every_mode(where, plant, 50)


@pytest.mark.parametrize("seed", range(10))
def test_ten_thousand_fuzzed_frames_ten_times(seed: int) -> None:
    endurance.fuzz_frames(10_000, 100 + seed)


def test_the_next_client_works_after_a_thousand_fuzzed_frames() -> None:
    endurance.fuzz_frames_then_work(1000, 200)


def test_a_million_fuzzed_datagrams_change_nothing() -> None:
    endurance.fuzz_datagrams(1_000_000, 300)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", programs.DRAGS)
def test_a_drag_at_the_vendors_pace(plant: str, name: str) -> None:
    endurance.run_drag(plant, name, *programs.DRAGS[name], 6.0)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_at_the_vendors_pace(plant: str, name: str) -> None:
    endurance.run_program(plant, name, PROGRAMS[name])
