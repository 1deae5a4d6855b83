"""What presses on the arm is told from its sensors, and nothing is told where nothing presses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.dynamics.payload import Payload
from rcilab.model.dynamics.rigid_body import RigidBody
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_joint
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.momentum_observer import MomentumObserver
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Measurement, Plant, Setpoint

CYCLE = 0.001  # [s]
Maker = Callable[[RobotModel], Plant]
both = pytest.mark.parametrize("make", [IdealPlant, MuJoCoPlant], ids=["ideal", "mujoco"])
arms = pytest.mark.parametrize("name", ROBOTS)
LOAD = Payload(mass=2.0, center_of_mass=np.array([0.0, 0.0, 0.05]))


def hold(measured: Measurement, drive: Drive = Drive.POSITION) -> Setpoint:
    zeros = [0.0] * len(measured.q)
    return Setpoint(drive, measured.q.tolist(), zeros, zeros)


def watched(plant: Plant, observer: MomentumObserver, setpoint: Setpoint, cycles: int):
    for _ in range(cycles):
        answer = observer.step(plant.step(setpoint))
    return answer


@both
@arms
def test_at_rest_nothing_presses_exactly(make: Maker, name: str) -> None:
    model = load_model(name, load=LOAD)
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home + 0.2)
    observer.reset(rest)
    for drive in (Drive.POSITION, Drive.BRAKED):
        tau_ext, wrench = watched(plant, observer, hold(rest, drive), 20)
        assert not tau_ext.any()
        assert not wrench.any()
    again = observer.step(rest)
    assert again[0] is tau_ext
    assert again[1] is wrench


@both
@arms
def test_no_legal_motion_looks_like_a_collision(make: Maker, name: str) -> None:
    model = load_model(name, load=LOAD)
    goal = model.home + np.array([1.2, 0.6, -0.8, 0.5, -1.0, 0.4, 1.5])[: model.n]
    motion = plan_joint(model, model.home, goal, speed=1.0)
    dq = np.diff(motion.q, axis=0, prepend=motion.q[:1]) / CYCLE
    ddq = np.diff(dq, axis=0, prepend=dq[:1]) / CYCLE
    plant, observer = make(model), MomentumObserver(model)
    observer.reset(plant.reset(model.home))
    largest = np.zeros(model.n)
    for q, v, a in zip(motion.q, dq, ddq, strict=True):
        tau_ext, _ = observer.step(plant.step(Setpoint(Drive.POSITION, q.tolist(), v.tolist(), a.tolist())))
        largest = np.maximum(largest, np.abs(tau_ext))
    assert (largest < 0.01 * model.limits.joint.collision_threshold).all(), largest
    assert np.abs(dq).max() > 2.0  # [rad/s] It was a fast one.
    rest = plant.step(hold(Measurement(motion.q[-1], 0 * goal, goal)))
    assert not watched(plant, observer, hold(rest), 2000)[0].any()


@both
@arms
def test_a_push_on_the_held_tool_is_found_with_its_sign(make: Maker, name: str) -> None:
    model = load_model(name, tool=Pose([0.02, 0.0, 0.1]), load=LOAD)
    plant, observer = make(model), MomentumObserver(model)
    rest, wrench = plant.reset(model.home), np.array([5.0, 8.0, -20.0, 0.5, -0.4, 0.3])
    observer.reset(rest)
    plant.push(wrench)
    tau_ext, found = watched(plant, observer, hold(rest), 1500)
    assert tau_ext == pytest.approx(model.jacobian(rest.q).T @ wrench, abs=0.2)
    assert found == pytest.approx(wrench, abs=0.3)
    plant.push(np.zeros(6))
    tau_ext, found = watched(plant, observer, hold(rest), 3000)
    assert not tau_ext.any()
    assert not found.any()


@both
def test_a_push_shows_with_a_time_constant_of_five_milliseconds(make: Maker) -> None:
    model = load_model("xMatePro7")
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home)
    observer.reset(rest)
    wrench = np.array([0.0, 0.0, -30.0, 0.0, 0.0, 0.0])
    plant.push(wrench)
    expected = (model.jacobian(rest.q).T @ wrench)[1]
    told = [observer.step(plant.step(hold(rest)))[0][1] / expected for _ in range(30)]
    assert told[0] < 0.3
    assert told[5] == pytest.approx(1.0 - 1.2**-6, abs=0.05)
    assert told[29] == pytest.approx(1.0, abs=0.05)


@both
def test_a_push_on_a_link_shows_at_the_joints_before_it_and_at_no_other(make: Maker) -> None:
    model = load_model("xMatePro7")
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home)
    observer.reset(rest)
    plant.push([0.0, 25.0, 0.0, 0.0, 0.0, 0.0], link=4)
    tau_ext, _ = watched(plant, observer, hold(rest), 1500)
    assert abs(tau_ext[0]) > 2.0
    assert tau_ext[4:] == pytest.approx(np.zeros(3), abs=0.05)


@both
def test_a_load_that_was_not_set_looks_like_a_pull_downwards(make: Maker) -> None:
    model = load_model("xMatePro3")
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home)
    observer.reset(rest)
    plant.mount(LOAD)
    tau_ext, wrench = watched(plant, observer, hold(rest), 1500)
    missing = RigidBody(model.description, LOAD).gravity(rest.q) - model.torque(rest.q).gravity
    assert tau_ext == pytest.approx(-missing, abs=0.05)
    assert wrench[:3] == pytest.approx([0.0, 0.0, -2.0 * 9.81], abs=0.3)


@both
def test_a_yielding_arm_feels_what_accelerates_it(make: Maker) -> None:
    model = load_model("xMate3")
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home)
    observer.reset(rest)
    wrench = np.array([0.0, 6.0, 0.0, 0.0, 0.0, 0.0])
    plant.push(wrench)
    measured = rest
    for _ in range(100):
        measured = plant.step(hold(measured, Drive.TORQUE))
        tau_ext, _ = observer.step(measured)
    assert tau_ext == pytest.approx(model.jacobian(measured.q).T @ wrench, abs=0.25)
    assert np.abs(measured.dq).max() > 0.2


@both
@pytest.mark.parametrize("name", ["Panda", "FR3"])
def test_rotors_and_damping_that_a_model_has_are_no_external_force(make: Maker, name: str) -> None:
    model = load_model(name)
    plant, observer = make(model), MomentumObserver(model)
    rest = plant.reset(model.home)
    observer.reset(rest)
    still, largest = hold(rest), 0.0
    for k in range(600):
        tau = np.array([6.0, 4.0, -4.0, 3.0, 1.0, 1.0, 0.5]) * np.sin(2.0 * np.pi * k / 600.0)
        measured = plant.step(Setpoint(Drive.TORQUE, still.q, still.dq, still.ddq, tau))
        largest = max(largest, float(np.abs(observer.step(measured)[0]).max()))
    assert largest < 0.1
