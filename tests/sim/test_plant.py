"""What both arms have in common: they hold, they are moved by torques as Newton says, they feel what presses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.dynamics.rigid_body import RigidBody
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Measurement, Plant, Setpoint

CYCLE = 0.001  # [s]
LOAD = Payload(mass=2.0, center_of_mass=np.array([0.02, -0.01, 0.06]), inertia=np.diag([0.01, 0.02, 0.015]))

Maker = Callable[[RobotModel], Plant]


def frictionless(model: RobotModel) -> MuJoCoPlant:
    return MuJoCoPlant(model, friction=0.0)


both = pytest.mark.parametrize("make", [IdealPlant, frictionless], ids=["ideal", "mujoco"])


@pytest.fixture(params=["xMatePro7", "xMate3"])
def model(request: pytest.FixtureRequest) -> RobotModel:
    return load_model(request.param, tool=Pose([0.03, 0.0, 0.1]), load=LOAD)


def hold(q: Array, drive: Drive = Drive.POSITION) -> Setpoint:
    return Setpoint(drive, np.asarray(q).tolist(), [0.0] * len(q), [0.0] * len(q))


def twist(q: Array, tau: Array | list[float]) -> Setpoint:
    return Setpoint(Drive.TORQUE, np.asarray(q).tolist(), [0.0] * len(q), [0.0] * len(q), np.asarray(tau).tolist())


def run(plant: Plant, setpoint: Setpoint, cycles: int) -> Measurement:
    for _ in range(cycles - 1):
        plant.step(setpoint)
    return plant.step(setpoint)


def kinetic_energy(model: RobotModel, measured: Measurement) -> float:
    return float(measured.dq @ model.rigid_body.mass_matrix(measured.q) @ measured.dq / 2.0)


@both
def test_a_resting_arm_carries_its_weight_and_answers_with_the_same_measurement(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    for q in (model.home, model.home + 0.3):
        rest = plant.reset(q)
        assert rest.tau == pytest.approx(model.torque(q).gravity, abs=1e-9)
        assert rest.q.tolist() == q.tolist()
        assert not rest.dq.any()
        assert plant.step(hold(q)) is rest
        assert plant.step(hold(q, Drive.BRAKED)) is rest
        assert not rest.q.flags.writeable


@both
def test_without_a_torque_the_arm_stays_where_it_is(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    plant.reset(model.home)
    assert run(plant, twist(model.home, [0.0] * model.n), 500).q == pytest.approx(model.home, abs=1e-9)


@both
def test_torques_move_the_arm_as_newton_and_euler_say(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    last = plant.reset(model.home)
    tau = np.array([6.0, -5.0, 2.0, 4.0, -0.5, 0.6, 0.3])[: model.n]
    for _ in range(150):
        measured = plant.step(twist(model.home, tau))
        ddq = (measured.dq - last.dq) / CYCLE
        middle, speed = (measured.q + last.q) / 2.0, (measured.dq + last.dq) / 2.0
        terms = model.torque(middle, speed, ddq)
        # M ddq + C dq = tau; what is left is what a millisecond changes in M and C.
        assert terms.full - terms.gravity == pytest.approx(tau, abs=0.1)
        last = measured
    assert np.abs(measured.dq).max() > 0.3
    assert measured.tau == pytest.approx(tau + model.torque(measured.q).gravity, abs=0.1)


@both
def test_a_free_swing_keeps_its_energy(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    plant.reset(model.home)
    start = run(plant, twist(model.home, [8.0, -6.0, 4.0, -4.0, 0.3, 0.2, 0.1][: model.n]), 100)
    energy = kinetic_energy(model, start)
    coasting = run(plant, twist(model.home, [0.0] * model.n), 200)
    assert energy > 0.3  # [J]
    assert np.abs(coasting.q - start.q).max() > 0.1
    assert kinetic_energy(model, coasting) == pytest.approx(energy, rel=0.01)


@both
@pytest.mark.parametrize("link", [None, 3])
def test_a_push_accelerates_by_jacobian_and_inertia(make: Maker, model: RobotModel, link: int | None) -> None:
    plant = make(model)
    plant.reset(model.home)
    wrench, point = np.array([5.0, -10.0, 8.0, 0.5, 0.2, -0.3]), np.array([0.02, -0.05, 0.04])
    plant.push(wrench, link, point)
    measured = plant.step(twist(model.home, [0.0] * model.n))
    expected = CYCLE * np.linalg.solve(model.rigid_body.mass_matrix(model.home), work(model, link, point, wrench))
    assert measured.dq == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert np.abs(expected).max() > 1e-3


def work(model: RobotModel, link: int | None, point: Array, wrench: Array) -> Array:
    """J^T w by differences of our own forward kinematics; a link turns as the frame after its joint does."""
    if link is None:
        return model.with_tool(model.T_flange_tool @ Pose(point)).jacobian(model.home).T @ wrench
    zero = model.joint_frames(np.zeros(model.n))[link - 1]
    T_frame_link = zero.inverse() @ Pose([0.0, 0.0, model.description.links[link - 1].origin_height])

    def place(q: Array) -> Pose:
        return model.joint_frames(q)[link - 1] @ T_frame_link @ Pose(point)

    step, torque = 1e-6, []
    here = place(model.home)
    for row in np.eye(model.n) * step:
        there = place(model.home + row)
        turn = (there.rotation @ here.rotation.T - np.eye(3)) / step
        axis = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        torque.append(wrench[:3] @ (there.position - here.position) / step + wrench[3:] @ axis)
    return np.array(torque)


@both
def test_a_held_arm_feels_a_push_in_its_joints(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    plant.reset(model.home)
    wrench = np.array([10.0, 0.0, -20.0, 0.0, 1.0, 0.0])
    plant.push(wrench)
    held = run(plant, hold(model.home), 1500)
    expected = model.torque(held.q).gravity - model.jacobian(held.q).T @ wrench
    assert held.tau == pytest.approx(expected, abs=1e-3)
    assert held.q == pytest.approx(model.home, abs=5e-3)
    assert plant.step(hold(model.home)) is held
    braked = run(plant, hold(model.home, Drive.BRAKED), 3)
    assert braked.tau == pytest.approx(expected, abs=0.1)
    plant.push([0.0] * 6)
    free = run(plant, hold(model.home), 1500)
    assert free.q == pytest.approx(model.home, abs=1e-9)
    assert free.tau == pytest.approx(model.torque(model.home).gravity, abs=1e-6)


@both
def test_a_load_that_was_not_set_is_carried_and_pulls_a_yielding_arm_down(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    plant.reset(model.home)
    heavy = Payload(mass=6.0, center_of_mass=np.array([0.0, 0.0, 0.05]))
    gravity = RigidBody(model.description, heavy).gravity(model.home)
    plant.mount(heavy)
    assert run(plant, hold(model.home), 1500).tau == pytest.approx(gravity, abs=1e-4)
    height = model.forward(model.home).position[2]
    fallen = run(plant, twist(model.home, [0.0] * model.n), 200)
    assert model.forward(fallen.q).position[2] < height - 0.01
    plant.mount(None)
    plant.reset(model.home)
    assert plant.step(hold(model.home)).tau == pytest.approx(model.torque(model.home).gravity, abs=1e-6)


@both
def test_a_load_that_was_set_is_felt_and_the_arm_stays_where_it_was(make: Maker, model: RobotModel) -> None:
    plant = make(model.with_load(Payload()))
    light = plant.reset(model.home + 0.2)
    plant.configure(model)
    heavy = plant.step(hold(light.q))
    assert heavy.q.tolist() == light.q.tolist()
    assert heavy.tau == pytest.approx(model.torque(light.q).gravity, abs=1e-6)
    assert run(plant, twist(light.q, [0.0] * model.n), 100).q == pytest.approx(light.q, abs=1e-9)


@both
def test_nonsense_does_not_push(make: Maker, model: RobotModel) -> None:
    plant = make(model)
    for wrench, link, point in [([np.nan] * 6, None, None), ([1.0] * 5, 1, None), ([1.0] * 6, 1, [0.0, np.inf, 0.0])]:
        with pytest.raises(InvalidValueError, match=r"wrench|point"):
            plant.push(wrench, link, point)
    for link in (0, model.n + 1, -1, True):
        with pytest.raises(InvalidValueError, match=f"link needs one of .*, 1 to {model.n}, got {link}"):
            plant.push([1.0] * 6, link)


def test_the_ideal_plant_is_where_it_was_told_to_be(model: RobotModel) -> None:
    plant = IdealPlant(model)
    q, dq, ddq = model.home + 0.01, np.full(model.n, 0.2), np.full(model.n, 1.5)
    measured = plant.step(Setpoint(Drive.POSITION, q.tolist(), dq.tolist(), ddq.tolist()))
    assert np.array_equal(measured.q, q)
    assert np.array_equal(measured.dq, dq)
    assert np.array_equal(measured.tau, model.torque(q, dq, ddq).full)
    stopped = plant.step(hold(model.home, Drive.BRAKED))
    assert stopped.q.tolist() == q.tolist()
    assert not stopped.dq.any()
    assert plant.step(hold(q)).tau == pytest.approx(model.torque(q).gravity, abs=1e-12)


def test_the_ideal_plant_measures_the_backward_difference_of_its_angles(model: RobotModel) -> None:
    plant = IdealPlant(model)
    before = run(plant, twist(model.home, [1.0] * model.n), 50)
    after = plant.step(twist(model.home, [1.0] * model.n))
    assert (after.q - before.q) / CYCLE == pytest.approx(after.dq, abs=1e-12)


def test_nothing_is_solid_around_the_ideal_plant(model: RobotModel) -> None:
    plant: Plant = IdealPlant(model)
    with pytest.raises(UsageError, match="mujoco"):
        plant.place_box("table", [1.0, 1.0, 0.1], Pose())
    with pytest.raises(UsageError, match="mujoco"):
        plant.remove_box("table")
    with pytest.raises(UsageError, match="mujoco"):
        plant.set_floor(True)
    with pytest.raises(UsageError, match="mujoco"):
        plant.set_walls(SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=Pose()))
    plant.set_floor(False)
    plant.set_walls(None)


@pytest.mark.parametrize("name", ["Panda", "FR3"])
def test_an_arm_whose_description_has_damping_coasts_alike_on_both_plants(name: str) -> None:
    model = load_model(name)
    speeds = []
    for plant in (IdealPlant(model), MuJoCoPlant(model)):
        plant.reset(model.home)
        run(plant, twist(model.home, [6.0, *[0.0] * 6]), 300)
        speeds.append(float(run(plant, twist(model.home, [0.0] * 7), 1000).dq[0]))
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)
