"""Speed and acceleration of the tool in streams of poses: within the limits there is no error, beyond them one each."""

from __future__ import annotations

import random

import pytest

from rcilab.makers.realman.errors import RealManError
from tests.makers.realman.controller.bench import Bench

CURVE, FILTER = 1, 2
DOWN, TURN = 2, 3  # Of a pose; the tool's own axes are turned there, so that all three angles are rounded.
SPEED = {DOWN: 0.25, TURN: 0.6}  # [m/s], [rad/s] Those of a new controller, as the accelerations.
ACCELERATION = {DOWN: 1.6, TURN: 4.0}
LENGTH = {DOWN: 0.12, TURN: 0.5}
WIRE = {DOWN: -1e6, TURN: 1e3}
NO_ERROR = [0]


def way(t: float, speed: float, acceleration: float, length: float) -> float:
    """Returns where a motion from standstill to standstill is."""
    ramp = speed / acceleration
    end = length / speed + ramp
    t = min(t, end)
    if t < ramp:
        return 0.5 * acceleration * t * t
    if t < end - ramp:
        return speed * (t - 0.5 * ramp)
    return length - 0.5 * acceleration * (end - t) ** 2


def stream(
    axis: int, *, speed: float = 0.9, acceleration: float = 0.9, mode: int = CURVE, period: int = 5, jitter: int = 3
) -> Bench:
    """Streams a motion of the tool at parts of its limits, by a client that is early and late by up to `jitter` ms."""
    bench, clock = Bench(), random.Random(1)
    start, now = bench.pose, 0
    v, a, length = speed * SPEED[axis], acceleration * ACCELERATION[axis], LENGTH[axis]
    for number in range(round(1000.0 * (length / v + v / a) / period) + 2):
        due = max(now, number * period + clock.randint(-jitter, jitter))
        bench.run(due - now)
        now = due
        pose = list(start)
        pose[axis] += int(WIRE[axis] * way(1e-3 * number * period, v, a, length))
        bench.send("movep_canfd", pose=pose, follow=True, trajectory_mode=mode)
    bench.run(300)
    return bench


@pytest.mark.parametrize(
    ("axis", "mode", "period"),
    [(DOWN, CURVE, 5), (DOWN, CURVE, 20), (DOWN, FILTER, 10), (TURN, CURVE, 5), (TURN, FILTER, 20)],
)
def test_a_stream_inside_the_limits_is_no_error_however_it_is_rounded_and_delayed(axis, mode, period):
    assert stream(axis, mode=mode, period=period).err == NO_ERROR


@pytest.mark.parametrize("axis", [DOWN, TURN])
@pytest.mark.parametrize("mode", [CURVE, FILTER])
def test_a_tool_that_a_stream_makes_too_fast_stops_with_its_error(axis, mode):
    bench = stream(axis, speed=1.3, mode=mode, jitter=0)
    assert bench.err == [RealManError.OVERSPEED.code]
    assert not bench.controller.is_moving
    reason = bench.controller.reason
    assert reason.facts["bound"] == pytest.approx(1.15 * SPEED[axis])
    assert bench.ask("clear_system_err")["clear_state"] is True
    assert bench.ask("set_pos_step", step_type="z_step", step=10000, v=50)["receive_state"] is True
    assert bench.run_until_event()["trajectory_state"] is True


def test_a_tool_that_a_stream_accelerates_too_much_stops_with_its_error():
    assert stream(DOWN, acceleration=1.3, jitter=0).err == [RealManError.OVERACCELERATION.code]


def test_angles_poses_without_a_curve_and_velocities_are_not_watched():
    bench = Bench()
    q, start = bench.q, bench.pose
    for step in range(60):
        bench.send("movej_canfd", joint=[q[0] + round(1.5 * step * step), *q[1:]], trajectory_mode=1)  # Up to 0.8 m/s.
        bench.run(5)
    bench.run(500)
    assert bench.err == NO_ERROR
    bench.send("movep_canfd", pose=[*start[:2], start[2] - 50000, *start[3:]], trajectory_mode=0)
    bench.run(800)
    for _ in range(40):
        bench.send("movev_canfd", cartesian_velocity=[0, 0, 900000, 0, 0, 0], follow=True)
        bench.run(5)
    bench.run(500)
    assert bench.err == NO_ERROR


@pytest.mark.parametrize("mode", [CURVE, FILTER])
@pytest.mark.parametrize("is_timed", [False, True], ids=["pose by pose", "by its clock"])
def test_a_client_that_is_held_up_inside_the_limits_is_no_error(mode, is_timed):
    """It goes on where it was, or where its clock is: pauses of up to 60 ms at 0.2 m/s, and an end at that speed."""
    bench, now, speed = Bench(), 0, 0.2
    start, ramp = bench.pose, 0.2 / (0.9 * ACCELERATION[DOWN])
    number, pause = 0, iter((20, 40, 60))
    while (t := (1e-3 * now if is_timed else 5e-3 * number)) < 0.8:
        way_down = speed * (t - 0.5 * ramp) if t > ramp else 0.5 * speed / ramp * t * t
        bench.send(
            "movep_canfd",
            pose=[*start[:2], start[2] - int(1e6 * way_down), *start[3:]],
            follow=True,
            trajectory_mode=mode,
        )
        wait = next(pause, 5) if number in (50, 80, 110) else 5
        bench.run(wait)
        now, number = now + wait, number + 1
    bench.run(500)
    assert bench.err == NO_ERROR
