"""Impedance control in both arms: springs where they were asked for, damped, stable, and true to their reference."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_joint
from rcilab.sim.compliance import DESIGN_PERIOD, ModalDamping, design_damping
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.impedance_control import cartesian_impedance, joint_impedance
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Measurement, Plant, Setpoint

Law = Callable[[Measurement], Array]
Maker = Callable[[RobotModel], Plant]

both = pytest.mark.parametrize("make", [IdealPlant, MuJoCoPlant], ids=["ideal", "mujoco"])
arms = pytest.mark.parametrize("name", ["xMatePro7", "xMate3"])
SOFT = [800.0, 1200.0, 1000.0, 60.0, 80.0, 100.0]
STIFF = [3000.0] * 3 + [300.0] * 3
STILL = np.zeros(6)


def run(plant: Plant, measured: Measurement, law: Law, cycles: int) -> Measurement:
    zeros = [0.0] * len(measured.q)
    for _ in range(cycles):
        measured = plant.step(Setpoint(Drive.TORQUE, measured.q.tolist(), zeros, zeros, law(measured)))
    return measured


def joints(model: RobotModel, q: Array, stiffness: list[float]) -> Law:
    zeros = np.zeros(model.n)
    return lambda measured: joint_impedance(model, q, zeros, zeros, measured, stiffness)


def tool(model: RobotModel, T: Pose, stiffness: list[float], **more: object) -> Law:
    null = (model.home, np.zeros(model.n), np.zeros(model.n))
    return lambda measured: cartesian_impedance(model, T, STILL, STILL, null, measured, stiffness, **more)  # type: ignore[arg-type]


def offset(T_c: Pose, T: Pose) -> Array:
    """Position and small rotation from T to T_c, base axes, shape (6,)."""
    R = T_c.rotation @ T.rotation.T
    turn = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2.0
    return np.concatenate((T_c.position - T.position, turn))


@both
@arms
def test_a_joint_yields_by_torque_over_stiffness_and_comes_back(make: Maker, name: str) -> None:
    model = load_model(name)
    plant, stiffness = make(model), [1000.0] * (model.n - 3) + [100.0] * 3
    rest, force = plant.reset(model.home), np.array([0.0, 20.0, -10.0, 0.0, 0.0, 0.5])
    plant.push(force)
    pushed = run(plant, rest, joints(model, model.home, stiffness), 1500)
    yielded = model.jacobian(pushed.q).T @ force / stiffness
    assert pushed.q - model.home == pytest.approx(yielded, abs=1e-5)
    assert np.abs(yielded).max() > 5e-3
    plant.push(np.zeros(6))
    assert run(plant, pushed, joints(model, model.home, stiffness), 1500).q == pytest.approx(model.home, abs=1e-6)


@both
def test_a_light_joint_with_a_rotor_is_as_stiff_as_asked_for(make: Maker) -> None:
    """The last link of an FR3 without a hand has 1e-4 kg m^2, its rotor 0.1: 1 kHz is enough for 2000 N m/rad."""
    model = load_model("FR3")
    plant, stiffness = make(model), [3000.0] * 3 + [2500.0] * 2 + [2000.0] * 2
    rest, force = plant.reset(model.home), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    plant.push(force)
    pushed = run(plant, rest, joints(model, model.home, stiffness), 1500)
    yielded = model.jacobian(pushed.q).T @ force / stiffness
    assert pushed.q - model.home == pytest.approx(yielded, abs=1e-5)
    assert abs(yielded[6]) > 9e-4


@both
@arms
def test_the_tool_yields_by_force_over_stiffness_and_comes_back(make: Maker, name: str) -> None:
    model = load_model(name, tool=Pose([0.0, 0.03, 0.12]))
    plant, T_c = make(model), load_model(name, tool=Pose([0.0, 0.03, 0.12])).forward(model.home)
    rest, wrench = plant.reset(model.home), np.array([10.0, -15.0, 8.0, 0.5, -0.8, 0.6])
    plant.push(wrench)
    pushed = run(plant, rest, tool(model, T_c, SOFT), 2000)
    assert offset(model.forward(pushed.q), T_c) == pytest.approx(wrench / SOFT, rel=0.01, abs=2e-5)
    plant.push(np.zeros(6))
    back = run(plant, pushed, tool(model, T_c, SOFT), 2000)
    assert offset(model.forward(back.q), T_c) == pytest.approx(STILL, abs=5e-5)


@both
def test_stiffness_and_desired_wrench_can_have_axes_of_their_own(make: Maker) -> None:
    model = load_model("xMatePro7")
    plant, T_c = make(model), model.forward(model.home)
    axes = Pose.from_rpy([0.0, 0.0, 0.0], [0.3, -0.5, 0.8]).rotation
    wrench = np.array([12.0, 0.0, 0.0, 0.0, 0.5, 0.0])
    law = tool(model, T_c, SOFT, desired_wrench6=wrench.tolist(), axes=axes)
    moved = offset(model.forward(run(plant, plant.reset(model.home), law, 2000).q), T_c)
    own = np.concatenate((axes.T @ moved[:3], axes.T @ moved[3:]))
    assert own == pytest.approx(wrench / SOFT, rel=0.01, abs=2e-5)


@both
def test_the_arm_presses_with_the_desired_wrench_on_what_holds_it(make: Maker) -> None:
    model = load_model("xMate3")
    plant, T_c = make(model), load_model("xMate3").forward(load_model("xMate3").home)
    desired = np.array([0.0, 0.0, -30.0, 0.0, 0.0, 0.0])
    rest = plant.reset(model.home)
    plant.push(-desired)  # What holds it presses back as hard.
    held = run(plant, rest, tool(model, T_c, SOFT, desired_wrench6=desired.tolist()), 1000)
    assert offset(model.forward(held.q), T_c) == pytest.approx(STILL, abs=1e-6)


@both
@arms
def test_the_greatest_stiffness_is_stable_also_with_a_long_tool(make: Maker, name: str) -> None:
    model = load_model(name, tool=Pose([0.2, 0.0, 0.5]))
    plant, q = make(model), model.home + 0.1
    rest, T_c = plant.reset(q), load_model(name, tool=Pose([0.2, 0.0, 0.5])).forward(q)
    laws: list[Law] = [
        joints(model, q, model.limits.joint.stiffness.tolist()),
        lambda measured: cartesian_impedance(model, T_c, STILL, STILL, (q, 0.0 * q, 0.0 * q), measured, STIFF),
    ]
    for law in laws:
        plant.push([20.0, -30.0, 10.0, 1.0, 2.0, -1.0])
        pushed = run(plant, rest, law, 300)
        plant.push(np.zeros(6))
        back = run(plant, pushed, law, 1500)
        assert np.abs(back.dq).max() < 1e-3
        assert offset(model.forward(back.q), T_c) == pytest.approx(STILL, abs=1e-4)
        rest = plant.reset(q)


def test_a_spring_is_damped_with_seven_tenths_of_critical() -> None:
    model = load_model("xMatePro7")
    plant, stiffness = IdealPlant(model), [800.0] * 4 + [80.0] * 3
    zeros = [0.0] * 7
    error, still = np.full(7, 1e-3), np.zeros(7)
    measured, lowest = plant.reset(model.home + error), 1.0
    M = model.rigid_body.mass_matrix(model.home)
    root = np.diag(np.sqrt(stiffness))
    slowest = (
        np.linalg.eigh(np.linalg.inv(root) @ M @ np.linalg.inv(root))[1][:, -1] @ root
    )  # One mode: its swing is that of a single mass.
    start = slowest @ error
    for _ in range(1500):
        tau = joint_impedance(model, model.home, still, still, measured, stiffness)
        measured = plant.step(Setpoint(Drive.TORQUE, zeros, zeros, zeros, tau))
        lowest = min(lowest, float(slowest @ (measured.q - model.home) / start))
    assert lowest == pytest.approx(-math.exp(-math.pi * 0.7 / math.sqrt(1.0 - 0.49)), rel=0.05)  # 4.6 % overshoot


def test_an_untouched_arm_follows_its_reference() -> None:
    model = load_model("xMatePro7")
    plant, measured = IdealPlant(model), IdealPlant(model).reset(model.home)
    stiffness, amplitude = [300.0] * 4 + [30.0] * 3, np.array([0.4, -0.3, 0.3, 0.2, 0.5, -0.3, 0.6])
    worst, w = 0.0, 2.0 * math.pi / 3.0
    for k in range(3000):
        t = k / 1000.0
        q, dq, ddq = (model.home + amplitude * s for s in (1 - math.cos(w * t), 0.0, 0.0))
        dq, ddq = amplitude * w * math.sin(w * t), amplitude * w * w * math.cos(w * t)
        tau = joint_impedance(model, q, dq, ddq, measured, stiffness)
        measured = plant.step(Setpoint(Drive.TORQUE, q, dq, ddq, tau))
        worst = max(worst, float(np.abs(measured.q - q).max()))
    assert worst < 4e-4  # [rad] It begins with a jump of its acceleration, and the springs are soft.


def test_an_untouched_tool_follows_its_reference() -> None:
    model = load_model("xMate7")
    plant, T = IdealPlant(model), model.forward(model.home)
    measured, worst, w, radius = plant.reset(model.home), 0.0, 2.0 * math.pi / 3.0, -0.04
    for k in range(3000):
        a = w * k / 1000.0
        out = radius * np.array([1.0 - math.cos(a), math.sin(a), 0.0, 0.0, 0.0, 0.0])
        speed = radius * w * np.array([math.sin(a), math.cos(a), 0.0, 0.0, 0.0, 0.0])
        acc = radius * w * w * np.array([math.cos(a), -math.sin(a), 0.0, 0.0, 0.0, 0.0])
        T_c = Pose.from_parts(T.parts[0], tuple((T.position + out[:3]).tolist()))  # type: ignore[arg-type]
        if k > 1500:  # It began at speed, from rest.
            worst = max(worst, float(np.abs(offset(T_c, model.forward(measured.q))).max()))
        tau = cartesian_impedance(model, T_c, speed, acc, (model.home, np.zeros(6), np.zeros(6)), measured, SOFT)
        measured = plant.step(Setpoint(Drive.TORQUE, [0.0] * 6, [0.0] * 6, [0.0] * 6, tau))
    assert worst < 3e-4  # [m, rad]


@both
def test_the_elbow_of_a_seven_axis_arm_is_led_softly_and_the_tool_does_not_feel_it(make: Maker) -> None:
    model = load_model("xMatePro7")
    plant, T_c = make(model), model.forward(model.home)
    q_null = np.array(model.inverse(T_c, psi=0.3).nearest(model.home))
    measured, worst = plant.reset(model.home), 0.0
    for _ in range(2500):
        tau = cartesian_impedance(model, T_c, STILL, STILL, (q_null, np.zeros(7), np.zeros(7)), measured, STIFF)
        measured = plant.step(Setpoint(Drive.TORQUE, [0.0] * 7, [0.0] * 7, [0.0] * 7, tau))
        worst = max(worst, float(np.abs(offset(model.forward(measured.q), T_c)).max()))
    assert model.arm_angle(measured.q) == pytest.approx(0.3, abs=0.01)
    assert worst < 1e-3  # [m, rad]


def test_a_damper_keeps_its_design_for_some_cycles_and_then_follows_the_arm() -> None:
    model, rng = load_model("xMatePro7"), np.random.default_rng(3)
    stiffness, damper = np.diag(np.full(7, 300.0)), ModalDamping()
    poses = [model.home + 0.02 * k for k in range(2 * DESIGN_PERIOD)]
    error = rng.normal(size=7)
    design = [design_damping(model.rigid_body.mass_inverse(q), stiffness) for q in poses]
    designs = [each.torque(np.zeros(7), error) for each in design]
    found = [damper.torque(lambda each=each: each, np.zeros(7), error) for each in design]
    kept = [k - k % DESIGN_PERIOD for k in range(2 * DESIGN_PERIOD)]
    assert all(np.allclose(tau, designs[k], rtol=1e-12) for tau, k in zip(found, kept, strict=True))
    assert not np.allclose(designs[0], designs[DESIGN_PERIOD], rtol=1e-3)


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_the_elbow_of_a_soft_arm_follows_a_quick_motion(plant: str) -> None:
    model = load_model("xMatePro7")
    goal = model.home + np.array([0.3, 0.1, 0, 0, 0, 0, 0])
    with simulate(model, plant=plant) as robot:
        robot.power_on()
        run = robot.execute(plan_joint(model, model.home, goal, speed=0.5), mode="cartesian_impedance")
        assert np.abs(run.q[-1] - goal).max() < (0.003 if plant == "ideal" else 0.02)  # Drives have friction in MuJoCo.
        assert np.abs(run.dq[-1]).max() < 0.02
        assert np.linalg.norm(run.T_base_tool[-1, :3, 3] - model.forward(goal).position) < 1e-4
