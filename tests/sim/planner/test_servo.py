"""Streamed targets of a planner: the newest one counts."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from rcilab.core.arrays import JointVector
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.planner import Planner, RefusalReason
from rcilab.sim.planner.stream_filter import StreamFilter, StreamMode
from tests.sim.planner.driving import drive, largest_shares, shifted

PERIOD = 4  # [cycles] 250 Hz.


@pytest.fixture(params=["xArm6", "RM75"], scope="module")
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param)


def planner_of(model: RobotModel) -> Planner:
    return Planner(model, model.limits, model.home.tolist())


def sine(model: RobotModel, cycle: int) -> JointVector:
    return model.home + 0.1 * (1.0 - np.cos(2.0 * pi * 1e-3 * cycle))


def test_the_newest_target_is_approached_at_the_highest_speed(model: RobotModel) -> None:
    goal = model.home + 0.5
    rows, _ = drive(planner_of(model), {0: lambda planner: planner.servo_joints(goal.tolist(), velocity=1.0)})
    rates = np.abs(np.diff(rows, axis=0)).max(axis=0) / 1e-3
    np.testing.assert_allclose(rates, 1.0, rtol=1e-6)
    np.testing.assert_allclose(rows[-1], goal, atol=1e-8)
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


@pytest.mark.parametrize(("mode", "smoothing"), [("direct", 0.0), ("fit", 0.0), ("fit", 0.5), ("filter", 0.5)])
def test_a_stream_is_followed_inside_the_limits(model: RobotModel, mode: StreamMode, smoothing: float) -> None:
    def send(planner: Planner, cycle: int) -> None:
        assert planner.follow_joints(sine(model, cycle).tolist(), mode=mode, smoothing=smoothing) is None

    actions = {cycle: lambda planner, cycle=cycle: send(planner, cycle) for cycle in range(0, 2001, PERIOD)}
    rows, _ = drive(planner_of(model), actions)
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]
    np.testing.assert_allclose(rows[-1], sine(model, 2000), atol=1e-7)
    lag = np.abs(rows[1001] - sine(model, 1000)).max()
    assert lag < 0.06


def test_smoothing_reduces_the_acceleration(model: RobotModel) -> None:
    def run(mode: StreamMode, smoothing: float) -> float:
        actions = {
            cycle: lambda planner, cycle=cycle: planner.follow_joints(
                sine(model, cycle).tolist(), mode=mode, smoothing=smoothing
            )
            for cycle in range(0, 1001, PERIOD)
        }
        rows, _ = drive(planner_of(model), actions)
        return float(np.abs(np.diff(rows[100:900], 2, axis=0)).max())

    direct = run("direct", 0.0)
    assert run("filter", 0.5) < 0.8 * direct
    assert run("fit", 0.5) < 0.8 * direct


def test_a_pose_is_followed_and_a_long_step_refused(model: RobotModel) -> None:
    start = model.forward(model.home)
    planner = planner_of(model)
    refusal = planner.servo_tool(shifted(start, 0.0, 0.02, 0.0), max_step=0.01)
    assert refusal is not None
    assert refusal.reason is RefusalReason.STEP
    assert refusal.value == pytest.approx(0.02)
    rows, _ = drive(
        planner,
        {
            PERIOD * step: lambda planner, step=step: planner.servo_tool(
                shifted(start, 0.0, 1e-3 * step, 0.0), max_step=0.01
            )
            for step in range(50)
        },
    )
    assert model.forward(rows[-1]).is_close(shifted(start, 0.0, 0.049, 0.0), 1e-7)
    assert largest_shares(rows, model.limits.joint) < [1.0, 1.0, 1.0]


def test_angles_outside_the_range_are_refused(model: RobotModel) -> None:
    refusal = planner_of(model).servo_joints([9.0] * model.n)
    assert refusal is not None
    assert refusal.reason is RefusalReason.JOINT_RANGE


def test_a_curve_through_streamed_angles_does_not_show_when_each_of_them_came(model: RobotModel) -> None:
    """They come up to 3 ms late."""
    late = np.random.default_rng(1).integers(0, 4, size=400)
    actions = {
        PERIOD * step + int(late[step]): lambda planner, step=step: planner.follow_joints(
            sine(model, PERIOD * step).tolist(), mode="fit"
        )
        for step in range(400)
    }
    rows, _ = drive(planner_of(model), actions)
    wanted = np.array([sine(model, cycle) for cycle in range(400, 1500)])
    assert min(np.abs(rows[500:1500] - wanted[100 - delay :][:1000]).max() for delay in range(50)) < 1e-3


@pytest.mark.parametrize(("is_kept", "fastest"), [(True, 1.7e-3), (False, 1.4e-3)])
def test_targets_that_come_late_and_together_are_not_jumped_to(is_kept, fastest):
    smoothing, period, late = StreamFilter([0.0], "linear", 0.0), 5, 8
    arrivals: dict[int, list[float]] = {}
    last = 0
    for k in range(80):
        last = max(last, period * k + (late if k % 40 == 20 else 0))
        arrivals.setdefault(last, []).append(1e-3 * period * k)
    q = []
    for cycle in range(period * 80):
        for target in arrivals.get(cycle, [])[0 if is_kept else -1 :]:
            smoothing.take([target])
        q.append(smoothing.step()[0])
    assert np.diff(q)[50:].max() < fastest  # [rad] In a cycle; the targets move 1e-3 rad.


@pytest.mark.parametrize("mode", ["fit", "filter"])
@pytest.mark.parametrize(("first", "last", "overshoot"), [(160.0, 177.9, 0.1), (0.0, 30.0, 4.0)])
def test_a_stream_that_ends_abruptly_does_not_leave_the_range_and_is_hardly_passed(
    mode: StreamMode, first: float, last: float, overshoot: float
):
    """Its angles move at once with 50 or 100 deg/s; the range ends at 178 deg."""
    model = load_model("RM75")
    stream = np.arange(first, last, 0.25 if first else 0.5).tolist()
    q = model.home.copy()
    q[0] = np.radians(first)
    planner = Planner(model, model.limits, q.tolist())

    def send(planner: Planner, angle: float) -> None:
        assert planner.follow_joints([float(np.radians(angle)), *q[1:].tolist()], mode=mode) is None

    actions = {5 * k: lambda planner, x=x: send(planner, x) for k, x in enumerate([*stream, last])}
    rows, _ = drive(planner, actions)
    assert np.degrees(rows[:, 0].max()) < last + overshoot + 1e-3
    assert np.degrees(rows[-1, 0]) == pytest.approx(last, abs=1e-4)
