"""The arm with mass: it follows, it holds, it yields, it stops."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.arrays import Array
from rcilab.controller.mujoco_plant import MuJoCoPlant
from rcilab.controller.plant import Drive, Measurement, Plant, Setpoint
from rcilab.dynamics.payload import Payload
from rcilab.errors import InvalidValueError
from rcilab.model import RobotModel, load_model
from rcilab.motion import plan_joint
from rcilab.robots import ROBOT_NAMES

CYCLE = 0.001  # [s]
arms = pytest.mark.parametrize("name", ROBOT_NAMES)


def hold(drive: Drive, q: Array, **more: list[float]) -> Setpoint:
    still = [0.0] * len(q)
    return Setpoint(drive, np.asarray(q).tolist(), still, still, **more)


def run(plant: Plant, setpoint: Setpoint, cycles: int) -> Measurement:
    for _ in range(cycles - 1):
        plant.step(setpoint)
    return plant.step(setpoint)


def loaded(name: str) -> RobotModel:
    model = load_model(name)
    return model.with_load(Payload(mass=model.description.rated_payload, center_of_mass=np.array([0.0, 0.0, 0.06])))


@arms
def test_a_fast_motion_with_the_rated_load_is_followed_within_a_milliradian(name: str) -> None:
    model = loaded(name)
    goal = model.home + np.array([1.2, 0.6, -0.8, 0.5, -1.0, 0.4, 1.5])[: model.n]
    motion = plan_joint(model, model.home, goal, speed=1.0)
    plant = MuJoCoPlant(model)
    plant.reset(motion.q[0])
    dq = np.diff(motion.q, axis=0, prepend=motion.q[:1]) / CYCLE  # backward differences, as the controller's
    ddq = np.diff(dq, axis=0, prepend=dq[:1]) / CYCLE
    errors = [
        np.abs(plant.step(Setpoint(Drive.POSITION, q.tolist(), v.tolist(), a.tolist())).q - q)
        for q, v, a in zip(motion.q[1:], dq[1:], ddq[1:], strict=True)
    ]
    assert np.max(errors) < 1e-3
    assert np.max(errors) > 1e-6  # a drive, not a copy: it has mass and friction
    at_rest = run(plant, hold(Drive.POSITION, motion.q[-1]), 1000)
    assert at_rest.q == pytest.approx(motion.q[-1], abs=1e-8)


@arms
def test_a_resting_arm_measures_gravity_as_pinocchio_computes_it(name: str) -> None:
    for model in (load_model(name), loaded(name)):
        plant = MuJoCoPlant(model)
        rng = np.random.default_rng(8)
        for q in rng.uniform(0.8 * model.limits.joint.lower, 0.8 * model.limits.joint.upper, (10, model.n)):
            plant.reset(q)
            measured = run(plant, hold(Drive.POSITION, q), 5)
            assert measured.tau == pytest.approx(model.torque(q, 0 * q, 0 * q).gravity, abs=1e-6)
            assert measured.q.tolist() == q.tolist()


def test_measured_torque_is_that_of_the_rigid_body_model_along_the_way() -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    plant.reset(model.home)
    dq, ddq = np.zeros(7), np.array([3.0, -2.0, 1.0, 2.0, -3.0, 1.0, 2.0])
    q = np.array(model.home)
    for _ in range(200):
        dq = dq + CYCLE * ddq
        q = q + CYCLE * dq
        measured = plant.step(Setpoint(Drive.POSITION, q.tolist(), dq.tolist(), ddq.tolist()))
    expected = model.torque(measured.q, measured.dq, ddq).full
    assert measured.tau == pytest.approx(expected, abs=0.3)  # [N m] of up to 60: the servo's own correction


def test_an_arm_at_rest_answers_with_the_same_measurement() -> None:
    model = load_model("xMate3")
    plant = MuJoCoPlant(model)
    near = model.home + 1e-3
    first = run(plant, hold(Drive.POSITION, near), 1000)
    assert plant.step(hold(Drive.POSITION, near)) is first
    assert not first.dq.any()
    assert plant.step(hold(Drive.POSITION, near + 1e-4)) is not first


def test_brakes_stop_a_fast_arm_and_then_hold_it_still() -> None:
    model = loaded("xMatePro3")
    plant = MuJoCoPlant(model)
    speed = [2.0, 1.0, 2.0, -2.0, 2.0, 1.0, 2.0]
    q = np.array(model.home)
    for k in range(300):
        v = np.array(speed) * min(1.0, k / 200)
        q = q + CYCLE * v
        moving = plant.step(Setpoint(Drive.POSITION, q.tolist(), v.tolist(), [0.0] * 7))
    assert np.abs(moving.dq).min() > 0.9
    stopped = run(plant, hold(Drive.BRAKED, q), 400)
    assert plant.step(hold(Drive.BRAKED, q)) is stopped
    assert not stopped.dq.any()
    assert np.abs(stopped.q - moving.q).max() < 2.0 * 0.05  # [rad] within some 20 ms of full speed


def test_impedance_is_a_spring_against_a_push_and_comes_back() -> None:
    model = load_model("xMatePro3")
    plant = MuJoCoPlant(model)
    plant.reset(model.home)
    stiffness = [1000.0] * 4 + [100.0] * 3
    spring = hold(Drive.IMPEDANCE, model.home, stiffness=stiffness)
    force = np.array([0.0, 20.0, 0.0, 0.0, 0.0, 0.0])
    plant.push(force)
    pushed = run(plant, spring, 4000)
    yielded = model.jacobian(pushed.q).T @ force / stiffness
    assert pushed.q - model.home == pytest.approx(yielded, abs=2e-4)
    assert np.abs(yielded).max() > 5e-3
    assert pushed.wrench_ext == pytest.approx(-force)
    assert pushed.tau_ext == pytest.approx(-model.jacobian(pushed.q).T @ force, abs=1e-9)
    plant.push(np.zeros(6))
    assert run(plant, spring, 4000).q == pytest.approx(model.home, abs=1e-5)


def test_a_guided_arm_is_weightless_yields_and_comes_to_rest() -> None:
    model = loaded("xMatePro7")
    plant = MuJoCoPlant(model)
    plant.reset(model.home)
    guided = hold(Drive.GUIDED, model.home)
    assert run(plant, guided, 500).q == pytest.approx(model.home, abs=1e-9)
    plant.push([0.0, 15.0, 0.0, 0.0, 0.0, 0.0])
    assert run(plant, guided, 500).q[0] > model.home[0] + 0.01
    plant.push(np.zeros(6))
    assert np.abs(run(plant, guided, 8000).dq).max() < 0.02


def test_torque_commands_accelerate_as_newton_says() -> None:
    model = load_model("xMate3")
    plant = MuJoCoPlant(model)
    plant.reset(model.home)
    tau = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5]
    plant.step(hold(Drive.TORQUE, model.home, tau=tau))
    moved = plant.step(hold(Drive.TORQUE, model.home, tau=tau))
    assert moved.dq[5] > 1e-3
    assert moved.tau[5] == pytest.approx(model.torque(moved.q, moved.dq, 0 * moved.q).full[5], abs=0.5)


def test_a_heavier_load_is_felt_after_configure_and_the_arm_stays_where_it_was() -> None:
    plant = MuJoCoPlant(load_model("xMatePro7"))
    q = np.array([0.3, 0.9, 0.0, 0.5, 0.0, 0.7, 0.0])
    light = plant.reset(q)
    plant.configure(loaded("xMatePro7"))
    heavy = plant.step(hold(Drive.POSITION, q))
    assert heavy.q.tolist() == q.tolist()
    assert abs(heavy.tau[1]) > abs(light.tau[1]) + 20.0


def test_the_same_setpoints_give_the_same_bits() -> None:
    def life() -> bytes:
        plant = MuJoCoPlant(load_model("xMatePro3"))
        plant.reset(load_model("xMatePro3").home)
        target = hold(Drive.POSITION, load_model("xMatePro3").home + 0.01)
        return b"".join(plant.step(target).q.tobytes() for _ in range(50))

    assert life() == life()


def test_a_push_of_nonsense_is_refused() -> None:
    plant = MuJoCoPlant(load_model("xMate3"))
    with pytest.raises(InvalidValueError, match="wrench"):
        plant.push([np.nan] * 6)


def test_it_is_a_plant_with_every_drive() -> None:
    plant: Plant = MuJoCoPlant(load_model("xMate7"))
    assert plant.kind == "mujoco"
    assert plant.drives == frozenset(Drive)
