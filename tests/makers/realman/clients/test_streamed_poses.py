"""The maker's client library streams poses to a running controller, which advances by the period of each of them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.peers.arena import arena

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")

MODEL, FRONT = "RM65", [0, -20, -70, 0, -90, 0]
SPEED, ACCELERATION, LENGTH = 0.25, 1.6, 0.1  # [m/s], [m/s^2] Of a new controller; [m].
PERIOD = 5  # [cycles]
DUAL = 1
FITTED = 1
PATIENCE = 10.0  # [s]


class Clock:
    """Lets a controller run freely, or a number of cycles at a time: no load of the machine disturbs a stream."""

    def __init__(self, controller: Any) -> None:
        self._controller, self._step = controller, controller.step
        self.left: int | None = None
        controller.step = self._advance

    def _advance(self, **options: Any) -> Any:
        if self.left is None:
            return self._step(**options)
        if not self.left:
            return self._controller.state
        state = self._step(**options)
        self.left -= 1
        return state

    def run(self, cycles: int) -> None:
        self.left = cycles
        wait(lambda: not self.left)


def wait(condition: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(2e-4)


def send(robot: Any, controller: Any, pose: list[float]) -> None:
    """Streams a pose, and waits until the controller has it, or has ignored it because of an error."""
    before, ignored = controller.drive.planner.streamed, controller.ignored
    assert robot.rm_movep_canfd(pose, True, FITTED, 0) == 0
    wait(lambda: controller.drive.planner.streamed is not before or controller.ignored > ignored)


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[Any, Any, Clock]]:
    from Robotic_Arm.rm_robot_interface import RoboticArm, rm_thread_mode_e

    with arena(model=MODEL, lockstep=False) as found:
        clock = Clock(found.cycle)
        robot = RoboticArm(rm_thread_mode_e(DUAL))
        assert robot.rm_create_robot_arm(found.host, found.port, 3).id > 0
        yield robot, found.cycle, clock
        clock.left = None
        robot.rm_delete_robot_arm()


@pytest.mark.parametrize(("speed", "acceleration", "error"), [(0.9, 0.9, 0), (1.3, 0.9, 0x1009), (0.9, 1.3, 0x100A)])
def test_a_line_inside_the_limits_of_the_tool_is_followed_and_one_beyond_them_is_an_error(
    served: tuple[Any, Any, Clock], speed: float, acceleration: float, error: int
):
    robot, controller, clock = served
    v, a = speed * SPEED, acceleration * ACCELERATION
    assert robot.rm_movej(FRONT, 50, 0, 0, 1) == 0
    pose, ramp = robot.rm_get_current_arm_state()[1]["pose"], v / a
    end = LENGTH / v + ramp
    clock.left = 0
    for number in range(round(1000.0 * end / PERIOD) + 1):
        t = min(1e-3 * PERIOD * number, end)
        way = 0.5 * a * (t * t - max(t - ramp, 0.0) ** 2 - max(t - end + ramp, 0.0) ** 2)
        send(robot, controller, [*pose[:2], pose[2] - way, *pose[3:]])
        clock.run(PERIOD)
    clock.run(300)
    clock.left = None
    state = robot.rm_get_current_arm_state()[1]
    assert [int(code) for code in state["err"]["err"]] == [error]
    if not error:
        assert state["pose"][2] == pytest.approx(pose[2] - LENGTH, abs=1e-5)
    assert robot.rm_clear_system_err() == 0
