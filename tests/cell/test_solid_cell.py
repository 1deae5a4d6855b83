"""A cell in the simulation and in the session: what is solid, and what a session checks before the arm moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Shape, Solid, Sphere
from rcilab.cell.tool import Part, Tool
from rcilab.cell.wire_rounding import without_rounding
from rcilab.control_process.launch import start_controller
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import CertificateError, ConformanceError, ControlError, InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.dynamics.payload import Payload
from rcilab.robots import ROBOT_NAMES
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Setpoint

MODEL = rcilab.load_model("xMatePro7")
TURN = np.array((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
TIP = MODEL.forward(MODEL.home + 0.5 * TURN).position
WALL = Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 0.3)), pose=Pose.from_rpy(TIP, (0.0, 0.0, 0.5)))
WALLED = Cell(model="xMatePro7", obstacles=(WALL,))
BAR = Solid(shape=Box(size=(0.03, 0.03, 0.2)), pose=Pose((0.0, 0.0, 0.1)))
TOOL = Tool(
    T_flange_tool=Pose((0.0, 0.0, 0.2)), payload=Payload(mass=0.5, center_of_mass=(0.0, 0.0, 0.1)), solids=(BAR,)
)
WEDGE = MeshShape(
    vertices=np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)], dtype=float) - 0.03,
    faces=np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]),
)


def turned(plant: MuJoCoPlant) -> float:
    """Returns the angle of joint 1 at which something holds it in a turn by 1 rad that nothing checks."""
    motion = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + TURN, speed=0.5)
    q = MODEL.home
    for row, before in zip(motion.q[1:], motion.q, strict=False):
        dq = tuple(((row - before) / CYCLE_TIME).tolist())
        q = plant.step(Setpoint(Drive.POSITION, tuple(row.tolist()), dq, (0.0,) * 7)).q
        if np.abs(q - row).max() > 0.05:
            break
    return float(q[0])


SHAPES: tuple[Shape, ...] = (
    Box(size=(0.1, 0.02, 0.3)),
    Cylinder(radius=0.03, length=0.4),
    Sphere(radius=0.05),
    WEDGE,
    Plane(),
)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_an_arm_stops_against_every_shape(shape: Shape) -> None:
    turn = (np.pi / 2, 0.0, 0.2) if isinstance(shape, Plane) else (0.0, 0.0, 0.5)  # Free on the side of the arm.
    cell = replace(WALLED, obstacles=(replace(WALL, shape=shape, pose=Pose.from_rpy(TIP, turn)),))
    assert 0.1 < turned(MuJoCoPlant(MODEL, cell=cell)) < 0.6


def test_tool_and_part_are_solid_and_may_touch_what_they_work_on() -> None:
    model = WALLED.applied_to(MODEL)
    post = replace(
        WALL, shape=Sphere(radius=0.03), pose=model.forward(MODEL.home + 0.5 * TURN) @ Pose((0.0, 0.0, 0.17))
    )
    alone = Cell(model="xMatePro7", obstacles=(post,))
    assert turned(MuJoCoPlant(MODEL, cell=alone)) == pytest.approx(1.0, abs=0.01)
    part = Part(name="bar", solids=(BAR,))
    for name, cell in (("tool", replace(alone, tool=TOOL)), ("part", replace(alone, parts=(part,), held="bar"))):
        assert turned(MuJoCoPlant(cell.applied_to(MODEL), cell=cell)) < 0.6
        passing = cell.placed(replace(post, may_touch=(name,)))
        assert turned(MuJoCoPlant(passing.applied_to(MODEL), cell=passing)) == pytest.approx(1.0, abs=0.01)


def test_no_arm_at_home_is_in_the_floor_of_a_new_cell() -> None:
    for name in ROBOT_NAMES:
        model = rcilab.load_model(name)
        assert MuJoCoPlant(model, cell=Cell(model=name)).find_overlap(model.home) is None


def test_a_controller_does_not_start_inside_an_obstacle_and_names_both() -> None:
    at_tool = Cell(model="xMatePro7", obstacles=(replace(WALL, pose=MODEL.forward(MODEL.home)),))
    with pytest.raises(InvalidValueError, match=r"link\d overlaps the obstacle 'wall' by \S+ mm; remove it"):
        build_virtual_controller(ControllerConfig(model="xMatePro7", port=0, plant="mujoco", cell=at_tool))


def test_tool_and_load_are_those_of_the_cell_or_given_apart_but_not_both() -> None:
    with pytest.raises(InvalidValueError, match="has the tool and the load of the arm: leave out other ones"):
        ControllerConfig(model="xMatePro7", cell=WALLED, load=Payload(mass=1.0))
    setup = ControllerConfig(model="xMatePro7", cell=replace(WALLED, tool=TOOL)).setup(MODEL)
    assert setup is not None
    assert setup.load is not None
    assert (setup.T_flange_tool, setup.load.mass) == (TOOL.T_flange_tool, 0.5)
    bare = ControllerConfig(model="xMatePro7", cell=WALLED).setup(MODEL)
    assert bare is not None
    assert bare.q == tuple(MODEL.home)  # Checked against the obstacles.


def test_what_an_interface_rounds_is_the_same_tool() -> None:
    cell = Cell(model="xMatePro7", tool=TOOL)
    exact = cell.applied_to(MODEL)
    motion = rcilab.plan_joint(exact, MODEL.home, MODEL.home + TURN)
    certificate = rcilab.check(motion, exact, cell=cell).certificate
    assert certificate is not None
    turned_by = Pose.from_rpy((5e-7, 0.0, 0.2), (5e-4, 0.0, -5e-4))
    reported = MODEL.with_tool(turned_by).with_load(Payload(mass=0.5004, center_of_mass=np.float32((0.0, 0.0, 0.1))))
    certificate.verify(motion, reported, motion.start, cell=cell)
    assert without_rounding(reported, cell).load.mass == 0.5
    for other, changed in (
        (reported.with_load(Payload(mass=0.502, center_of_mass=(0.0, 0.0, 0.1))), ["load"]),
        (reported.with_tool(Pose((0.0, 0.0, 0.201))), ["tool"]),
    ):
        with pytest.raises(CertificateError, match=r"robot\.set_cell\(cell, apply=True\)") as found:
            certificate.verify(motion, other, motion.start, cell=cell)
        assert set(changed) <= set(found.value.changed)


def test_a_session_refuses_a_motion_through_a_wall_and_without_the_check_the_wall_stops_the_arm() -> None:
    motion = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + TURN, speed=0.5)
    with rcilab.simulate(MODEL, plant="mujoco", cell=WALLED) as robot:
        robot.power_on()
        assert robot.cell is WALLED
        for move in (lambda: robot.execute(motion), lambda: robot.move_j(MODEL.home + TURN, speed=0.5)):
            with pytest.raises(
                ConformanceError, match=r"link \d and wall: distance from an obstacle .* t = \d"
            ) as found:
                move()
            assert found.value.violations[0].time > 0.1
        assert np.array_equal(robot.state.q_c, MODEL.home)
        away = rcilab.plan_joint(MODEL, MODEL.home, MODEL.home - 0.1 * TURN)
        checked = rcilab.check(away, MODEL, cell=WALLED).certificate
        robot.execute(away, checked)
        back = rcilab.plan_joint(MODEL, away.q[-1], MODEL.home)
        with pytest.raises(CertificateError, match=r"cell=robot\.cell"):
            robot.execute(back, rcilab.check(back, MODEL).certificate)
        robot.execute(back)
        tooled = replace(WALLED, tool=TOOL)
        robot.set_cell(tooled)
        with pytest.raises(CertificateError, match=r"send those of the cell: robot\.set_cell\(cell, apply=True\)"):
            robot.execute(away)
        robot.set_cell(tooled, apply=True)
        assert (robot.model.load.mass, robot.model.T_flange_tool) == (0.5, TOOL.T_flange_tool)
        robot.execute(away)
        robot.execute(back)
        robot.set_cell(Cell(model="xMatePro7", tool=Tool()), apply=True)
        robot.set_cell(None)
        with pytest.raises(ControlError) as stopped:
            robot.execute(motion)
        assert stopped.value.run is not None
        assert 0.1 < stopped.value.run.q[-1][0] < 0.6


def test_a_session_with_a_controller_of_a_cell_has_its_tool_and_load(tmp_path: Path) -> None:
    file = tmp_path / "cell.json"
    Cell(model="RM65", tool=TOOL, obstacles=(replace(WALL, pose=Pose((2.0, 0.0, 0.5))),)).save(file)
    cell = Cell.load(file)
    controller = start_controller("RM65", options=["--cell", str(file)])
    try:
        assert controller.address is not None
        with rcilab.connect(controller.address, cell=cell) as robot:
            assert robot.model.load.mass == 0.5
            assert robot.model.T_flange_tool.is_close(TOOL.T_flange_tool)
            q = robot.state.q_c
            motion = rcilab.plan_joint(robot.model, q, q + 0.1)
            robot.power_on()
            run = robot.execute(motion, rcilab.check(motion, robot.model, cell=cell).certificate)
            assert np.abs(run.q[-1] - motion.q[-1]).max() < 1e-3
        text = "the ideal plant has no contacts: the arm passes through the cell's obstacles"
        assert text in controller.stderr_tail
    finally:
        controller.end()
