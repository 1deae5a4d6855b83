"""The arm with mass: it follows, it holds, it stops, it bumps into things."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_joint
from rcilab.sim.mujoco_obstacles import MOST_BOXES
from rcilab.sim.mujoco_plant import MuJoCoPlant
from rcilab.sim.plant import Drive, Measurement, Plant, Setpoint

CYCLE = 0.001  # [s]
arms = pytest.mark.parametrize("name", ROBOTS)


def hold(drive: Drive, q: Array) -> Setpoint:
    still = [0.0] * len(q)
    return Setpoint(drive, np.asarray(q).tolist(), still, still)


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
    last = plant.reset(model.home)
    dq, ddq = np.zeros(7), np.array([3.0, -2.0, 1.0, 2.0, -3.0, 1.0, 2.0])
    q = np.array(model.home)
    for _ in range(200):
        dq = dq + CYCLE * ddq
        q = q + CYCLE * dq
        measured = plant.step(Setpoint(Drive.POSITION, q.tolist(), dq.tolist(), ddq.tolist()))
        moved = model.torque(measured.q, measured.dq, (measured.dq - last.dq) / CYCLE).full
        assert measured.tau == pytest.approx(moved, abs=0.05)  # [N m] of up to 60
        last = measured


def test_a_moved_arm_comes_to_an_exact_rest() -> None:
    model = load_model("xMate3")
    plant = MuJoCoPlant(model)
    near = model.home + 1e-3
    first = run(plant, hold(Drive.POSITION, near), 1000)
    assert plant.step(hold(Drive.POSITION, near)) is first
    assert first.q.tolist() == near.tolist()
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


def test_closed_brakes_bear_a_push_and_the_sensors_feel_it() -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    free = run(plant, hold(Drive.BRAKED, model.home), 10)
    wrench = np.array([0.0, 20.0, -20.0, 0.0, 0.0, 0.0])
    plant.push(wrench)
    pushed = run(plant, hold(Drive.BRAKED, model.home), 1000)
    assert np.abs(pushed.q - model.home).max() < 1e-9
    assert free.tau - pushed.tau == pytest.approx(model.jacobian(model.home).T @ wrench, abs=1e-9)


def test_brakes_that_close_under_a_push_hold_the_arm_where_it_stops() -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    plant.push([0.0, 20.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(200):
        moving = plant.step(Setpoint(Drive.TORQUE, model.home.tolist(), [0.0] * 7, [0.0] * 7, [0.0] * 7))
    assert np.abs(moving.dq).max() > 0.1
    run(plant, hold(Drive.BRAKED, model.home), 300)
    stopped = plant.step(hold(Drive.BRAKED, model.home))
    later = run(plant, hold(Drive.BRAKED, model.home), 1000)
    assert later.q == pytest.approx(stopped.q, abs=1e-9)
    assert (np.abs(later.q - moving.q) < 0.1 * np.abs(moving.dq).max()).all()  # [rad] within some 20 ms of that speed


def test_what_the_drives_do_not_know_of_the_friction_brings_a_free_arm_to_rest() -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    swing = [2.0, 1.0, 1.0, 1.0, 0.1, 0.1, 0.05]
    free = hold(Drive.TORQUE, model.home)
    for _ in range(200):
        moving = plant.step(Setpoint(Drive.TORQUE, free.q, free.dq, free.ddq, swing))
    slower = run(plant, free, 1000)
    assert 0.05 < slower.dq @ slower.dq < 0.9 * moving.dq @ moving.dq


@pytest.mark.parametrize("solid", ["box", "floor", "walls"])
def test_the_arm_cannot_go_through_what_is_solid(solid: str) -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    start = np.radians([0.0, 60.0, 0.0, 60.0, 0.0, 60.0, 0.0])  # The flange points down, 0.48 m in front.
    height = float(model.forward(start).position[2])
    assert height > 0.1
    plant.reset(start)
    match solid:
        case "box":
            plant.place_box("table", [2.0, 2.0, 0.1], Pose([0.0, 0.0, height - 0.2]))
            ground = height - 0.15
        case "floor":
            plant.set_floor(True)
            ground = 0.0
        case _:
            plant.set_walls(SafetyBox(size=(4.0, 4.0, 4.0), T_base_box=Pose([0.0, 0.0, 2.0 + height - 0.15])))
            ground = height - 0.15
    goal = start + np.radians([0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    stopped, free = descend(plant, start, goal), descend(MuJoCoPlant(model), start, goal)
    assert model.forward(free.q).position[2] < ground - 0.1
    assert model.forward(stopped.q).position[2] > ground - 0.01
    unexplained = model.torque(stopped.q, stopped.dq).full - stopped.tau
    assert unexplained[1] < -20.0  # [N m] What is solid presses back.


def descend(plant: Plant, start: Array, goal: Array) -> Measurement:
    plant.reset(start)
    for k in range(1000):
        q = start + (goal - start) * k / 1000
        plant.step(Setpoint(Drive.POSITION, q.tolist(), (goal - start).tolist(), [0.0] * 7))
    return run(plant, hold(Drive.POSITION, q), 500)


def test_a_box_can_be_moved_and_taken_away_and_stays_through_a_change_of_load() -> None:
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    start = np.radians([0.0, 60.0, 0.0, 60.0, 0.0, 60.0, 0.0])
    goal = start + np.radians([0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    far, near = Pose([0.0, 0.0, -3.0]), Pose([0.5, 0.0, float(model.forward(start).position[2]) - 0.2])
    plant.place_box("table", [2.0, 2.0, 0.1], far)
    unhindered = descend(plant, start, goal)
    assert unhindered.q == pytest.approx(goal, abs=0.01)
    plant.reset(start)
    plant.place_box("table", [2.0, 2.0, 0.1], near)
    assert np.abs(descend(plant, start, goal).q - goal).max() > 0.05
    plant.reset(start)
    plant.configure(loaded("xMatePro7"))
    assert np.abs(descend(plant, start, goal).q - goal).max() > 0.05
    plant.remove_box("table")
    assert descend(plant, start, goal).q == pytest.approx(goal, abs=0.01)


def test_boxes_are_judged_and_counted() -> None:
    plant = MuJoCoPlant(load_model("xMate3"))
    with pytest.raises(InvalidValueError, match="box size"):
        plant.place_box("flat", [1.0, 0.0, 1.0], Pose())
    with pytest.raises(InvalidValueError, match="box size"):
        plant.place_box("odd", [1.0, np.nan, 1.0], Pose())
    for number in range(MOST_BOXES):
        plant.place_box(f"box {number}", [0.1, 0.1, 0.1], Pose([5.0, 0.0, 0.0]))
    plant.place_box("box 0", [0.2, 0.1, 0.1], Pose([5.0, 0.0, 0.0]))
    with pytest.raises(InvalidValueError, match="exceeds the limit of 16 boxes"):
        plant.place_box("last straw", [0.1, 0.1, 0.1], Pose())
    with pytest.raises(InvalidValueError, match="there are: box 0, box 1"):
        plant.remove_box("table")


def test_the_same_setpoints_give_the_same_bits() -> None:
    def life() -> bytes:
        plant = MuJoCoPlant(load_model("xMatePro3"))
        plant.reset(load_model("xMatePro3").home)
        plant.set_floor(True)
        plant.push([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], 4)
        target = hold(Drive.POSITION, load_model("xMatePro3").home + 0.01)
        return b"".join(plant.step(target).q.tobytes() for _ in range(50))

    assert life() == life()


def test_what_mujoco_warns_of_is_logged_and_no_file_is_written(tmp_path, monkeypatch, caplog) -> None:
    monkeypatch.chdir(tmp_path)
    model = load_model("xMatePro7")
    plant = MuJoCoPlant(model)
    plant.push([1e13, 0.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(3):
        plant.step(Setpoint(Drive.TORQUE, model.home.tolist(), [0.0] * 7, [0.0] * 7, tau=[0.0] * 7))
    assert any("MuJoCo" in record.message for record in caplog.records)
    assert list(tmp_path.iterdir()) == []


def test_a_box_that_overlaps_the_arm_is_refused_with_the_depth_and_the_clearing_distance() -> None:
    plant = MuJoCoPlant(load_model("xMatePro7"))
    size, inside = [0.1, 1.0, 1.0], [0.6, 0.0, 0.5]
    with pytest.raises(
        InvalidValueError, match=r"would overlap link5 of the arm by 87 mm; place it (\d+) mm farther"
    ) as caught:
        plant.place_box("wall", size, Pose(inside))
    facts = caught.value.facts
    assert facts["axis"] == "+x"
    home = load_model("xMatePro7").home
    plant.place_box("wall", size, Pose(inside + np.array([float(facts["way"]), 0.0, 0.0])))
    after = run(plant, hold(Drive.POSITION, home), 100)
    assert np.abs(after.q - home).max() < 1e-6  # It is not thrown.


def test_a_box_that_was_refused_leaves_the_one_of_its_name_where_it_was() -> None:
    plant = MuJoCoPlant(load_model("xMatePro7"))
    plant.place_box("wall", [0.1, 1.0, 1.0], Pose([2.0, 0.0, 0.5]))
    with pytest.raises(InvalidValueError, match="would overlap"):
        plant.place_box("wall", [0.1, 1.0, 1.0], Pose([0.6, 0.0, 0.5]))
    plant.remove_box("wall")
    with pytest.raises(InvalidValueError, match="does not exist"):
        plant.remove_box("wall")
