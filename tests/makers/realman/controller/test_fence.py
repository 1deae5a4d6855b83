"""The electronic fence: a box or a plane that no moving link may leave, or enter."""

from __future__ import annotations

import pytest

from rcilab.makers.realman.errors import RealManError
from tests.makers.realman.controller.bench import Bench

BOX = {"x": (-800, 800), "y": (-300, 800), "z": (-800, 1200)}
"""[mm] The RM65 at home is in it."""
WALL = {"x1": 0, "y1": -300, "z1": 0, "x2": 1000, "y2": -300, "z2": 0, "x3": 0, "y3": -300, "z3": 1000}


def box(**ends: tuple[int, int]) -> dict[str, int]:
    return {
        f"{axis}_{name}_limit": value
        for axis, pair in {**BOX, **ends}.items()
        for name, value in zip(("min", "max"), pair, strict=True)
    }


def fenced(form: int, fields: dict[str, int], side: int = 0) -> Bench:
    bench = Bench()
    assert bench.ask("set_electronic_fence_config", form=form, **fields)["set_config"] is True
    on = bench.ask("set_electronic_fence_enable", set_enable=True, in_out_side=side, effective_region=0)
    assert on == {"command": "set_electronic_fence_enable", "set_state": True}
    return bench


def turn(bench: Bench, angle: int) -> bool:
    """Turns joint 1 to an angle, [0.001 deg]; returns whether it arrives."""
    assert bench.ask("movej", joint=[angle, *bench.q[1:]], v=50)["receive_state"] is True
    return bench.run_until_event()["trajectory_state"]


@pytest.mark.parametrize(("form", "fields"), [(1, box()), (2, WALL)], ids=["box", "plane"])
def test_a_link_that_goes_beyond_stops_the_arm_which_may_move_back(form, fields):
    bench = fenced(form, fields)
    start = bench.q[0]
    assert turn(bench, -90000) is False
    assert bench.err == [RealManError.FENCE.code]
    assert "beyond the electronic fence" in bench.controller.reason
    edge = bench.controller.model.forward(bench.controller.q).position[1]
    assert -0.3 < edge < -0.25, "the housing of the last link is thicker than the flange's centre"
    bench.run(1000)
    assert bench.ask("movej", joint=[start, *bench.q[1:]], v=50)["receive_state"] is False
    assert bench.ask("clear_system_err")["clear_state"] is True
    assert turn(bench, start) is True
    assert turn(bench, -90000) is False


def test_an_elbow_counts_and_the_arm_can_have_to_stay_outside():
    low = fenced(1, box(z=(-800, 450)))
    assert low.ask("movej", joint=low.q[:1] + [0] * 5, v=50)["receive_state"] is True
    assert low.run_until_event()["trajectory_state"] is False, "the arm would be upright"
    outside = fenced(1, box(x=(-50, 50), y=(-400, -200), z=(0, 800)), side=1)
    assert turn(outside, 60000) is True
    assert turn(outside, -90000) is False
    assert outside.err == [RealManError.FENCE.code]


def test_a_fence_is_read_back_and_one_that_is_off_stops_nothing():
    bench = fenced(1, box())
    assert bench.ask("get_electronic_fence_config") == {"command": "get_electronic_fence_config", "form": 1, **box()}
    state = {"command": "get_electronic_fence_enable", "enable_state": True, "in_out_side": 0, "effective_region": 0}
    assert bench.ask("get_electronic_fence_enable") == state
    bench.ask("set_electronic_fence_enable", set_enable=False, in_out_side=0, effective_region=0)
    assert turn(bench, -90000) is True
    assert bench.err == [0]


@pytest.mark.parametrize(
    ("form", "fields"),
    [(3, {"x": 0, "y": 0, "z": 0, "radius": 500}), (1, box(x=(100, 100))), (2, dict.fromkeys(WALL, 5)), (1, {})],
    ids=["sphere", "no volume", "no direction", "no ends"],
)
def test_what_is_no_fence_is_refused(form, fields):
    bench = Bench()
    assert bench.ask("set_electronic_fence_config", form=form, **fields)["set_config"] is False
    assert bench.ask("get_electronic_fence_config")["form"] == 0
    on = bench.ask("set_electronic_fence_enable", set_enable=True, in_out_side=0, effective_region=0)
    assert on["set_state"] is False
