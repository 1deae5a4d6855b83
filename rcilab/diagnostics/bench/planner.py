"""Cost of a cycle of motions that a controller plans by itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.measure import Measurement, summarise, time_calls
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.planner import Blend, JointSpeed, JointTarget, LineTarget, Planner, ToolSpeed

_ROBOTS = ("xMate7", "FR3")  # Six and seven axes.
_TARGET = 100.0  # [us] Of the 1000 of a cycle.


def bench_planner() -> Measurement:
    """One cycle of a queue of lines with rounded corners; joints, on-line commands and adding targets in the note."""
    times = np.concatenate([_lines(load_model(name)) for name in _ROBOTS])
    model = load_model(_ROBOTS[1])
    goal = (model.home + 0.3).tolist()
    joints = _steps(
        model, lambda planner: planner.add(JointTarget(id=1, q=tuple(goal), speed=JointSpeed(velocity=0.3)))
    )
    tool = _steps(model, lambda planner: planner.move_tool(_corners(model)[1], ToolSpeed(velocity=0.1)))
    twist = _steps(model, lambda planner: planner.set_twist((0.02, 0.0, 0.0, 0.0, 0.0, 0.1)))
    servo = _steps(model, lambda planner: planner.servo_joints(goal))
    commands = _commands(model)
    note = (
        f"{', '.join(_ROBOTS)}, lines at 0.2 m/s with blends of 20 mm, the next ones prepared meanwhile, slowest cycle "
        f"{1e6 * times.max():.0f} us; joint target {joints:.0f}, pose on-line {tool:.0f}, twist {twist:.0f}, "
        f"servo {servo:.0f} us; a new pose on-line {commands:.0f} us"
    )
    return summarise("planner", times, "us", _TARGET, note)


def _corners(model: RobotModel) -> list[Pose]:
    start = model.forward(model.home)
    rotation, (x, y, z) = start.parts
    return [
        Pose.from_parts(rotation, (x - dx, y + dy, z)) for dx, dy in ((0.0, 0.1), (0.1, 0.1), (0.1, 0.0), (0.0, 0.0))
    ]


def _lines(model: RobotModel) -> np.ndarray:
    """Returns the least time of each cycle over several runs, [s]: other processes only lengthen it."""
    runs: list[list[float]] = []
    for _ in range(5):
        planner = Planner(model, model.limits, model.home.tolist())
        for number, pose in enumerate(_corners(model) * 2):
            planner.add(LineTarget(id=number, pose=pose, speed=ToolSpeed(velocity=0.2), blend=Blend(radius=0.02)))
        runs.append(time_calls(lambda _, planner=planner: planner.step(), range(2000), warm_up=0))
    return np.min(runs, axis=0)


def _steps(model: RobotModel, begin: Callable[[Planner], object]) -> float:
    planner = Planner(model, model.limits, model.home.tolist())
    begin(planner)
    return 1e6 * float(np.median(time_calls(lambda _: planner.step(), range(600))))


def _commands(model: RobotModel) -> float:
    planner = Planner(model, model.limits, model.home.tolist())
    poses = _corners(model)

    def command(number: int) -> None:
        planner.move_tool(poses[number % 2], ToolSpeed(velocity=0.1))

    times: list[float] = []
    for number in range(60):
        times += time_calls(command, [number], warm_up=0)
        for _ in range(8):
            planner.step()
    return 1e6 * float(np.median(times))
