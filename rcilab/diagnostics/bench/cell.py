"""Cost of a cell: the check of a motion among obstacles, and motions around them, beside those of OMPL by itself."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rcilab.app.planning import build_plan_view
from rcilab.cell.cell import Cell
from rcilab.cell.clearance_query import DistanceQuery, build_query
from rcilab.cell.convex_parts import convex_parts, prepare_meshes
from rcilab.cell.entries import Obstacle
from rcilab.cell.plan_free import plan_free
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Solid
from rcilab.cell.tool import Tool
from rcilab.conformance.check import check
from rcilab.core.arrays import JointPath, JointVector
from rcilab.core.clearance import STANDARD_DISTANCE
from rcilab.core.errors import PlanningError
from rcilab.core.optional_deps import MissingExtraError, require_library
from rcilab.core.spatial import Pose
from rcilab.diagnostics.bench.compute import motion_of
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise, time_calls
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion.joint import plan_joint
from rcilab.motion.motion import Motion
from rcilab.motion.plan_program import plan_program
from rcilab.motion.program import Program
from rcilab.motion.waypoint import Waypoint
from rcilab.robots.mesh import revolve

_ROBOT = "xMatePro7"
_SEED = 20
_OBSTACLES, _SCENES = 20, 20
_BUDGET = 5.0  # [s] For each search.
_SPEED = 0.5


def bench_check_cell() -> Measurement:
    """The check of a 7-joint motion of 10 s by all conditions, with a tool of 5000 triangles among 20 obstacles."""
    tool = _mesh_tool()
    cell, model = _full_cell(tool)
    motions = [motion_of(model, 10.0) for _ in range(10)]
    times = time_calls(lambda motion: check(motion, model, cell=cell), motions, warm_up=2)
    row = next(row for row in check(motions[0], model, cell=cell).rows if row.id == "clearance.cell")
    shape = tool.solids[0].shape
    assert isinstance(shape, MeshShape)
    note = (
        f"{_ROBOT}, {len(shape.faces)} triangles in {len(convex_parts(shape))} convex parts; nearest: {row.location}, "
        f"{1e3 * row.value:.0f} mm"
    )
    return summarise("check_cell", times, "ms", 300.0, note)


def bench_cell_drag() -> Measurement:
    """The verdict on a motion of 2.5 s while one of 20 obstacles is dragged on the page, with that tool."""
    cell, model = _full_cell(_mesh_tool())
    motion = motion_of(model, 2.5)
    plan = build_plan_view(model, motion, check(motion, model, distance=None)).completed(cell=cell)
    first = cell.obstacles[0]
    steps = [Pose((0.0, 0.01 * number, 0.0)) @ first.pose for number in range(12)]
    cells = [cell.placed(replace(first, pose=pose)) for pose in steps]
    times = time_calls(lambda moved: plan.completed(cell=moved), cells, warm_up=2)
    note = f"{_ROBOT}, {len(cell.obstacles)} obstacles; {1.0 / np.median(times):.0f} verdicts a second"
    return summarise("cell_drag", times, "ms", 100.0, note)


def _full_cell(tool: Tool) -> tuple[Cell, RobotModel]:
    """Returns an arm with a tool among 20 obstacles."""
    obstacles = _random_obstacles(np.random.default_rng(_SEED), 0.9, 1.6)
    cell = Cell(model=_ROBOT, tool=tool, floor=-0.8, obstacles=obstacles)
    prepare_meshes(cell)
    return cell, cell.applied_to(load_model(_ROBOT))


def bench_plan_free() -> Measurement | Absent:
    """A motion around obstacles in random scenes whose straight motion collides; that of OMPL by itself in the note."""
    rng, own, plain = np.random.default_rng(_SEED), _Tally(), _Tally()
    try:
        for _ in range(_SCENES):
            scene = _random_scene(rng)
            own.add(scene, lambda scene: plan_free(scene.model, scene.start, scene.goal, scene.cell, budget=_BUDGET))
            plain.add(scene, _plan_plain)
    except MissingExtraError as error:
        return Absent(name="plan_free", note=str(error))
    note = (
        f"{_ROBOT}, {_SCENES} scenes of {_OBSTACLES} obstacles: {own}; RRT-Connect of OMPL with its own steps and "
        f"simplification, and a stop at each corner: {plain}"
    )
    return summarise("plan_free", own.times, "ms", None, note)


@dataclass(frozen=True, slots=True)
class _Scene:
    cell: Cell
    model: RobotModel
    start: JointVector
    goal: JointVector


class _Tally:
    """What a planner finds in some scenes."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self._durations: list[float] = []
        self._distances: list[float] = []

    def add(self, scene: _Scene, plan: Any) -> None:
        begin = time.perf_counter()
        try:
            motion: Motion = plan(scene)
        except PlanningError:
            return
        finally:
            self.times.append(time.perf_counter() - begin)
        report = check(motion, scene.model, cell=scene.cell)
        distances = [row.value for row in report.rows if row.id in ("clearance.cell", "clearance.links")]
        self._durations.append(motion.duration)
        self._distances.append(min(distances))

    def __str__(self) -> str:
        free = sum(distance > 0.0 for distance in self._distances)
        return (
            f"{len(self._durations)} found, {free} of them free of collisions, {1e3 * np.median(self.times):.0f} ms, "
            f"motions of {np.median(self._durations):.2f} s, nearest {1e3 * min(self._distances):.1f} mm"
        )


def _random_scene(rng: np.random.Generator) -> _Scene:
    """Returns a scene whose ends are free and whose straight motion is not."""
    plain = load_model(_ROBOT)
    lower, upper = plain.limits.joint.lower, plain.limits.joint.upper
    while True:
        cell = Cell(model=_ROBOT, floor=-0.8, obstacles=_random_obstacles(rng, 0.45, 1.0))
        model = cell.applied_to(plain)
        query, _ = build_query(model, STANDARD_DISTANCE, cell)
        ends = [q for q in rng.uniform(0.6 * lower, 0.6 * upper, (12, model.n)) if _is_free(query, q)][:2]
        if len(ends) == 2 and not check(plan_joint(model, *ends), model, cell=cell).ok:
            return _Scene(cell, model, *ends)


def _is_free(query: DistanceQuery, q: JointVector) -> bool:
    return min(query.cell(q)[0], query.links(q)[0]) > 0.01


def _plan_plain(scene: _Scene) -> Motion:
    """Returns the motion of OMPL's planner, with its defaults, stopping at each corner."""
    model = scene.model
    corners = _plain_path(scene)
    if corners is None:
        raise PlanningError("no path")
    waypoints = tuple(Waypoint.joint(q, speed=_SPEED) for q in corners[1:])
    program = Program(model=model.name, start=tuple(corners[0].tolist()), waypoints=waypoints)
    return plan_program(model, program)


def _plain_path(scene: _Scene) -> JointPath | None:
    base, geometric, util = (
        require_library(f"ompl.{part}", "planning around obstacles", "planning", "ompl")
        for part in ("base", "geometric", "util")
    )
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(_SEED)
    model, n = scene.model, scene.model.n
    query, _ = build_query(model, STANDARD_DISTANCE, scene.cell)
    states, bounds = base.RealVectorStateSpace(n), base.RealVectorBounds(n)
    for i, (low, high) in enumerate(zip(model.limits.joint.lower, model.limits.joint.upper, strict=True)):
        bounds.setLow(i, float(low))
        bounds.setHigh(i, float(high))
    states.setBounds(bounds)
    setup = geometric.SimpleSetup(states)

    def is_valid(state: Any) -> bool:
        q = np.array([state[i] for i in range(n)])
        return min(query.cell(q)[0], query.links(q)[0], query.floor(q)[0]) > 0.0

    setup.setStateValidityChecker(is_valid)
    ends = states.allocState(), states.allocState()
    for state, values in zip(ends, (scene.start, scene.goal), strict=True):
        for i, angle in enumerate(values.tolist()):
            state[i] = angle
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    setup.solve(_BUDGET)
    if not setup.haveExactSolutionPath():
        return None
    setup.simplifySolution()
    return np.array([[state[i] for i in range(n)] for state in setup.getSolutionPath().getStates()])


def _mesh_tool() -> Tool:
    """Returns a tool of 4992 triangles: a body with three waists, which is not convex."""
    heights = np.linspace(0.0, 0.15, 53)
    radii = 0.03 + 0.01 * np.cos(heights * (6.0 * np.pi / 0.15))
    radii[[0, -1]] = 0.0
    mesh = revolve(list(zip(radii.tolist(), heights.tolist(), strict=True)), segments=49, crease=180.0)
    shape = MeshShape(vertices=mesh.vertices, faces=mesh.faces)
    return Tool(T_flange_tool=Pose((0.0, 0.0, 0.15)), solids=(Solid(shape=shape),))


def _random_obstacles(rng: np.random.Generator, nearest: float, farthest: float) -> tuple[Obstacle, ...]:
    """Returns boxes and posts around the arm, so far away, [m]."""
    found: list[Obstacle] = []
    for number in range(_OBSTACLES):
        around, away, height = rng.uniform(-np.pi, np.pi), rng.uniform(nearest, farthest), rng.uniform(0.0, 1.2)
        size = rng.uniform(0.05, 0.25, 3)
        shape = Box(size=tuple(size)) if number % 2 else Cylinder(radius=size[0] / 2.0, length=2.0 * size[1])
        place = (away * np.cos(around), away * np.sin(around), height)
        pose = Pose.from_rpy(place, rng.uniform(-np.pi, np.pi, 3))
        found.append(Obstacle(name=f"obstacle {number + 1}", shape=shape, pose=pose))
    return tuple(found)
