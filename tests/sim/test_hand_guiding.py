"""A hand leads the arm: what is free is free, what is held is held, and the box and the joints end somewhere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.hand_guiding import FREE, FREE_ROTATION, FREE_TRANSLATION, GuidedFreedom, guide_torque, wall_torque
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Measurement, Plant, Setpoint

Law = Callable[[Measurement], Array]
Maker = Callable[[RobotModel], Plant]
both = pytest.mark.parametrize("make", [IdealPlant, MuJoCoPlant], ids=["ideal", "mujoco"])


@pytest.fixture(params=["xMatePro7", "xMate3"])
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param, tool=Pose([0.0, 0.0, 0.1]))


def guide(model: RobotModel, freedom: GuidedFreedom = FREE) -> Law:
    T = model.forward(model.home)
    return lambda measured: guide_torque(model, measured, freedom, T)


def run(plant: Plant, law: Law, cycles: int, measured: Measurement | None = None) -> Measurement:
    measured = plant.step(idle(plant.reset(load_model("xMate3").home))) if measured is None else measured
    for _ in range(cycles):
        measured = plant.step(idle(measured, law(measured)))
    return measured


def idle(measured: Measurement, tau: Array | None = None) -> Setpoint:
    zeros = [0.0] * len(measured.q)
    return Setpoint(Drive.TORQUE, measured.q.tolist(), zeros, zeros, tau)


def turned(a: Pose, b: Pose) -> float:
    """Angle between two orientations, [rad]."""
    return float(np.arccos(np.clip((np.trace(a.rotation.T @ b.rotation) - 1.0) / 2.0, -1.0, 1.0)))


@both
def test_a_guided_arm_is_weightless_compliant_and_stops(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    rest, law = plant.reset(model.home), guide(model)
    assert run(plant, law, 500, rest).q == pytest.approx(model.home, abs=1e-8)
    plant.push([0.0, 8.0, 0.0, 0.0, 0.0, 0.0])
    led = run(plant, law, 400, rest)
    assert model.forward(led.q).position[1] > model.forward(model.home).position[1] + 0.05
    plant.push(np.zeros(6))
    assert np.abs(run(plant, law, 4000, led).dq).max() < 0.005


@pytest.mark.parametrize("name", ["xArm5", "xArm6", "xArm7", "Lite6", "850"])
def test_a_light_last_link_follows_a_weak_push_slowly(name: str) -> None:
    model, fastest = load_model(name), 0.0
    plant, T = IdealPlant(model), model.forward(model.home)
    measured = plant.reset(model.home)
    plant.push([0.5, 0.5, 0.0, 0.0, 0.0, 0.0])
    for _ in range(200):  # With the largest damping that a controller sets.
        measured = plant.step(idle(measured, guide_torque(model, measured, FREE, T, damping=2.56)))
        fastest = max(fastest, float(np.abs(measured.dq).max()))
    assert 0.01 < fastest < 0.3


@both
def test_translation_leaves_the_orientation(make: Maker, model: RobotModel) -> None:
    plant, T = make(model), model.forward(model.home)
    rest = plant.reset(model.home)
    plant.push([-6.0, 8.0, -5.0, 0.5, 0.5, 0.5])
    led = model.forward(run(plant, guide(model, FREE_TRANSLATION), 500, rest).q)
    assert np.linalg.norm(led.position - T.position) > 0.05
    assert turned(led, T) < 0.02


@both
def test_rotation_leaves_the_position(make: Maker, model: RobotModel) -> None:
    plant, T = make(model), model.forward(model.home)
    rest = plant.reset(model.home)
    plant.push([5.0, 5.0, -5.0, 0.5, 1.0, 0.4])
    led = model.forward(run(plant, guide(model, FREE_ROTATION), 300, rest).q)
    assert turned(led, T) > 0.1
    assert np.linalg.norm(led.position - T.position) < 0.006


@both
def test_nobody_can_lead_a_joint_past_its_limit(make: Maker, model: RobotModel) -> None:
    plant, upper = make(model), model.limits.joint.upper
    q = np.array(model.home)
    q[-1] = upper[-1] - 0.2
    rest = plant.reset(q)
    axis = model.forward(q).rotation[:, 2]
    plant.push([0.0, 0.0, 0.0, *(10.0 * axis)])
    law, highest, measured = guide(model), 0.0, rest
    for _ in range(300):
        measured = run(plant, law, 1, measured)
        highest = max(highest, float(measured.q[-1]))
    assert upper[-1] - 0.05 < highest < upper[-1]


@both
def test_walls_push_the_tool_back_into_the_box_and_nothing_inside_it(make: Maker, model: RobotModel) -> None:
    plant, T = make(model), model.forward(model.home)
    tilted = Pose.from_rpy(T.position, [0.4, -0.3, 0.6])
    box = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=tilted)
    stiffness = (2000.0,) * 3 + (300.0,) * 3
    rest = plant.reset(model.home)
    assert not wall_torque(model, rest, box, stiffness).any()
    outward = tilted.rotation[:, 1]
    plant.push([*(20.0 * outward), 0.0, 0.0, 0.0])
    free = guide(model, FREE_TRANSLATION)
    pressed = run(plant, lambda m: free(m) + wall_torque(model, m, box, stiffness), 2500, rest)
    assert outward @ (model.forward(pressed.q).position - T.position) == pytest.approx(0.05 + 20.0 / 2000.0, rel=0.03)
    asleep = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=tilted, active=False)
    assert not wall_torque(model, pressed, asleep, stiffness).any()
