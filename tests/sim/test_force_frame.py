"""setFcCoor over real sockets: desired force, stiffness and damping act along its axes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.command import CartesianPosition
from rcilab.core.spatial import Pose, rotation_between
from rcilab.makers.rokae.controller.settings import Settings
from rcilab.model.robot_model import load_model
from rcilab.sim.arm_parameters import ForceAxesKind
from rcilab.sim.force_frame import ForceAxes

MODEL = load_model("xMatePro7")
TURNED = Pose.from_rpy([0.0, 0.0, 0.0], [0.0, math.pi / 2.0, 0.0])
"""The force-control frame in the flange: its x is the flange's -z, its z the flange's x."""
SOFT = [400.0] * 3 + [200.0] * 3


def hold(robot, seconds: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Holds a pose under Cartesian impedance; returns how far the tool went in base, and the turn of base to flange."""
    start = robot.state
    T = start.T_base_tool_c.matrix

    def callback(state, t):
        return CartesianPosition(T, start.psi_c, finished=t >= seconds)

    last = {}

    def watched(state, t):
        last["p"] = state.T_base_tool.position
        return callback(state, t)

    robot.control(watched, mode="cartesian_impedance")
    return last["p"] - T[:3, 3], T[:3, :3]


@pytest.fixture(params=["ideal", "mujoco"])
def robot(request):
    with simulate(MODEL, plant=request.param) as robot:
        robot.power_on()
        robot.rci.set_cartesian_impedance(SOFT)
        yield robot


def test_a_desired_force_presses_along_the_turned_frame_of_the_tool(robot):
    robot.rci.set_fc_coor(TURNED, "tool")
    robot.rci.set_cart_imp_desired_tau([10.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved, R = hold(robot)
    wanted = R @ TURNED.rotation @ [10.0 / SOFT[0], 0.0, 0.0]
    assert moved == pytest.approx(wanted, abs=2e-3)


def test_the_soft_direction_is_that_of_the_turned_frame(robot):
    robot.rci.set_fc_coor(TURNED, "tool")
    robot.rci.set_cartesian_impedance([200.0, 3000.0, 3000.0, 300.0, 300.0, 300.0])
    R = robot.state.T_base_tool_c.rotation
    soft = R @ TURNED.rotation @ [1.0, 0.0, 0.0]
    robot.world.push([*(6.0 * soft), 0.0, 0.0, 0.0], duration=10.0)
    moved, _ = hold(robot)
    assert moved @ soft == pytest.approx(6.0 / 200.0, rel=0.1)


def test_in_the_frame_of_the_world_both_act_in_base_axes(robot):
    robot.rci.set_fc_coor(TURNED, "world")
    robot.rci.set_cart_imp_desired_tau([0.0, 10.0, 0.0, 0.0, 0.0, 0.0])
    moved, _ = hold(robot)
    assert moved == pytest.approx([0.0, 10.0 / SOFT[1], 0.0], abs=2e-3)


@pytest.mark.parametrize("direction", [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ids=["across", "along the tool"])
def test_a_path_that_reverses_does_not_throw_the_arm_that_presses(robot, direction):
    """What it presses with goes round with the path's axes, within half a second and not within a cycle."""
    robot.rci.set_fc_coor(Pose(), "path")
    robot.rci.set_cartesian_impedance([1000.0] * 3 + [200.0] * 3)
    robot.rci.set_cart_imp_desired_tau([8.0, 0.0, 8.0, 0.0, 4.0, 0.0])
    start = robot.state.T_base_tool_c.matrix
    seen = []

    def to_and_fro(state, t):
        T = start.copy()
        T[:3, 3] += 0.02 * (1.0 - math.cos(3.0 * t)) * np.array(direction)
        seen.append(state.tau.copy())
        return CartesianPosition(T, finished=t >= 2.0 * math.pi / 3.0)

    run = robot.control(to_and_fro, mode="cartesian_impedance")
    assert run.faults == ()
    jerks = np.abs(np.diff(seen, axis=0)).max(axis=1)
    assert jerks.max() < 2.0  # [N m] in a cycle


@dataclass
class Tool:
    pose: Pose


def test_the_axes_of_a_path_turn_by_a_bounded_step_and_arrive():
    settings = replace(Settings.of(MODEL.description), force_axes=ForceAxesKind.PATH)
    axes = ForceAxes(MODEL, settings)
    tool = MODEL.forward(MODEL.home)
    axes.follow([0.0, 0.1, 0.0], Tool(tool))
    before = axes.rotation(tool)
    for cycle in range(600):
        axes.follow([0.0, -0.1, 1e-7], Tool(tool))
        now = axes.rotation(tool)
        assert math.hypot(*rotation_between(before, now)) < 0.007
        assert axes.is_settled or cycle < 510
        before = now
    assert np.array(before).reshape(3, 3)[:, 0] == pytest.approx([0.0, -1.0, 0.0], abs=1e-5)
