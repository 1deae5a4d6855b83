"""The description of an arm from LoadRobotModel: as a model, compared with the table, and as a file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.core.errors import InvalidValueError, ModelError, VersionMismatchError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.base_parameters import full_regressor
from rcilab.makers.rokae.controller.model_download import model_response
from rcilab.makers.rokae.driver.loaded_arm import (
    _parameters_of,  # pyright: ignore[reportPrivateUsage]  # The independent computation below needs them.
    build_loaded_arm,
)
from rcilab.makers.rokae.wire import ModelResponse
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.recording.run import load_run
from rcilab.robots import DhRow, RobotDescription, describe_robot
from tests.recording.runs import some_run

TABLE = describe_robot("xMatePro7")
MODEL = RobotModel(TABLE)
FRICTION = np.array([[0.5, 0.4, 0.3, 0.3, 0.2, 0.2, 0.1], [0.59, 0.5, 0.45, 0.4, 0.35, 0.33, 0.33], [0.01] * 7])


def states(count: int = 20) -> list[np.ndarray]:
    return list(np.random.default_rng(5).uniform(-2.0, 2.0, (count, 3, 7)))


def heavier(arm: RobotDescription) -> RobotDescription:
    """An arm of the same kind whose links are other bodies, and whose lengths are calibrated."""
    random = np.random.default_rng(1)
    links = tuple(
        replace(
            link,
            mass=1.15 * link.mass,
            center_of_mass=link.center_of_mass + random.uniform(-0.01, 0.01, 3),
            inertia=1.2 * link.inertia,
        )
        for link in arm.links
    )
    rows = tuple(replace(row, d=row.d + random.uniform(-8e-4, 8e-4)) if row.d else row for row in arm.dh)
    return replace(arm, links=links, dh=rows, nominal=arm)


def with_friction(response: ModelResponse) -> ModelResponse:
    numbers = list(response.dynamics_with_friction)
    for joint in range(7):
        end = 6 + 10 * joint
        numbers[end - 3 : end] = FRICTION[:, joint]
    return replace(response, dynamics_with_friction=tuple(numbers))


def calibrated_rows(response: ModelResponse) -> ModelResponse:
    """The same with every number of the table calibrated: up to 1 mm and 3 mrad."""
    random = np.random.default_rng(2)
    steps = random.uniform(-1.0, 1.0, (7, 4)) * (1.0, 3e-3, 1.0, 3e-3)
    return replace(response, dh=tuple((np.reshape(response.dh, (7, 4)) + steps).ravel().tolist()))


def test_torques_gravity_and_mass_matrix_are_those_of_the_controllers_arm() -> None:
    true = RobotModel(heavier(TABLE))
    loaded = build_loaded_arm(with_friction(model_response(true.description)), TABLE, "robot", MODEL)
    for q, dq, ddq in states():
        ours, theirs = loaded.model.torque(q, dq, ddq), true.torque(q, dq, ddq)
        for name in ("full", "inertial", "coriolis", "gravity"):
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0, atol=1e-9)
        masses = (model.rigid_body.mass_matrix(q) for model in (loaded.model, true))
        np.testing.assert_allclose(*masses, rtol=0, atol=1e-9)
        rubbed = loaded.model.torque(q, dq, ddq, friction=True)
        viscous, coulomb, offset = FRICTION
        np.testing.assert_allclose(rubbed.friction, viscous * dq + coulomb * np.sign(dq) + offset, rtol=0, atol=1e-12)
    assert loaded.notes == ()
    assert abs(true.torque(MODEL.home).gravity - MODEL.torque(MODEL.home).gravity).max() > 1.0  # It is another arm.


def test_with_a_calibrated_table_torques_are_those_of_its_links_on_its_geometry() -> None:
    response = calibrated_rows(with_friction(model_response(heavier(TABLE))))
    model = build_loaded_arm(response, TABLE, "robot", MODEL).model
    parameters = _parameters_of(model.description)
    for q, dq, ddq in states():
        expected = full_regressor(model, q, dq, ddq) @ parameters
        np.testing.assert_allclose(model.torque(q, dq, ddq).full, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["xMatePro7", "xMatePro3", "xMate7"])
def test_the_inverse_of_a_calibrated_arm_reaches_its_poses(name: str) -> None:
    random, table = np.random.default_rng(3), describe_robot(name)
    steps = random.uniform(-1.0, 1.0, (table.n, 4)) * (1e-3, 3e-3, 1e-3, 3e-3)
    rows = tuple(
        DhRow(a=row.a + a, alpha=row.alpha + alpha, d=row.d + d, theta_offset=row.theta_offset + theta)
        for row, (a, alpha, d, theta) in zip(table.dh, steps.tolist(), strict=True)
    )
    arm = RobotModel(replace(table, dh=rows, nominal=table))
    joint = arm.limits.joint
    angles = arm.home + random.uniform(-0.5, 0.5, (30, arm.n))
    assert abs(arm.forward(arm.home).matrix - RobotModel(table).forward(arm.home).matrix).max() > 1e-3
    assert arm.redundancy.kind == RobotModel(table).redundancy.kind
    for q in angles:
        T = arm.forward(q)
        solutions = arm.inverse(T, arm.arm_angle(q) if arm.redundancy else None, near=q)
        assert abs(solutions.nearest(q) - q).max() < 1e-8
        assert all(arm.forward(found).is_close(T, 1e-9) for found in solutions)
    T = arm.forward_path(angles)
    batch = arm.inverse_batch(T).q
    found = np.isfinite(batch).all(axis=2)
    assert found.sum(axis=1).min() >= 4
    for row, branch in np.argwhere(found):
        assert arm.forward(batch[row, branch]).is_close(T[row], 1e-9)
    assert ((joint.lower < angles) & (angles < joint.upper)).all()
    goal = arm.forward(arm.home) @ Pose((0.02, 0.05, 0.03))
    motion = rcilab.plan_line(arm, arm.home, goal)
    assert arm.forward(motion.q[-1]).is_close(goal, 1e-9)
    assert rcilab.check(motion, arm, mode="cartesian_position").ok


def test_what_differs_is_listed_by_joint_and_parameter_with_its_amount() -> None:
    response = with_friction(model_response(TABLE))
    dh, numbers = list(response.dh), list(response.dynamics_with_friction)
    dh[4 * 2 + 2] += 0.52
    numbers[6] += 0.1
    loaded = build_loaded_arm(replace(response, dh=tuple(dh), dynamics_with_friction=tuple(numbers)), TABLE, "x", MODEL)
    found = {(entry.joint, entry.parameter): entry.arm - entry.table for entry in loaded.differences}
    assert found[3, "d"] == pytest.approx(0.52)
    assert found[2, "Ixx"] == pytest.approx(0.1, abs=0.02)  # The longer arm is regrouped a little differently.
    assert found[4, "Coulomb friction"] == 0.4
    text = str(loaded)
    assert "most of the lengths d of joint 3, by +0.52 mm" in text
    assert "joint 3  d " in text
    assert any("with and without friction differ" in note for note in loaded.notes)


def test_another_arm_another_zero_and_what_is_not_served_are_reported() -> None:
    far = list(model_response(TABLE).dh)
    far[2] += 20.0
    with pytest.raises(ModelError, match=r"d of joint 1 is 424 mm at the controller .* another arm"):
        build_loaded_arm(replace(model_response(TABLE), dh=tuple(far)), TABLE, "x", MODEL)
    six = describe_robot("xMate7")
    flat = list(model_response(six).dh)
    flat[4 * 1 + 3] = 0.0
    loaded = build_loaded_arm(replace(model_response(six), dh=tuple(flat)), six, "x", RobotModel(six))
    assert loaded.differences == ()
    assert "another zero position" in loaded.notes[0]
    assert "no dynamic parameters" in loaded.notes[1]
    empty = ModelResponse(dh=(0.0,) * 28, dynamics_with_friction=(0.0,) * 66, dynamics=(0.0,) * 45)
    assert build_loaded_arm(empty, TABLE, "x", MODEL).model.description.dh == TABLE.dh


def test_impossible_parameters_leave_those_of_the_table() -> None:
    response = model_response(TABLE)
    negative = replace(response, dynamics_with_friction=tuple(-x for x in response.dynamics_with_friction))
    loaded = build_loaded_arm(replace(negative, dynamics=(0.0,) * 45), TABLE, "x", MODEL)
    assert "mass matrix is not positive" in " ".join(loaded.notes)
    assert loaded.model.description.links is TABLE.links


def test_a_session_saves_its_arm_and_the_file_is_a_model_by_name(tmp_path: Path) -> None:
    tool, load = Pose((0.0, 0.0, 0.1)), Payload(mass=1.0)
    with rcilab.simulate(MODEL.with_tool(tool).with_load(load)) as robot:
        loaded = robot.rci.load_robot_model()
    assert loaded.differences == ()
    assert "what is in the table" in str(loaded)
    assert loaded.model.load.mass == 1.0
    loaded.save(tmp_path / "my_arm.json")
    model = load_model(str(tmp_path / "my_arm.json"), tool=tool)
    assert (model.name, model.T_flange_tool) == ("xMatePro7", tool)
    q, dq, ddq = states(1)[0]
    np.testing.assert_allclose(model.torque(q, dq, ddq).full, MODEL.torque(q, dq, ddq).full, rtol=0, atol=1e-12)
    with rcilab.simulate(model) as robot:
        robot.power_on()
        motion = rcilab.plan_joint(model, robot.state.q_c, model.home + 0.05)
        assert robot.execute(motion).stopped is None


def test_the_friction_of_a_simulated_real_arm_is_what_it_serves() -> None:
    assert TABLE.imperfections is not None
    with rcilab.simulate(MODEL, plant="mujoco", realism="real") as robot:
        loaded = robot.rci.load_robot_model()
    assert loaded.model.friction.coulomb.tolist() == [joint.friction for joint in TABLE.imperfections]
    assert {entry.parameter for entry in loaded.differences} == {"Coulomb friction"}
    assert "0.33 N m" in str(loaded)


def test_a_calibrated_arm_with_friction_comes_back_from_its_file(tmp_path: Path) -> None:
    response = calibrated_rows(with_friction(model_response(heavier(TABLE))))
    loaded = build_loaded_arm(response, TABLE, "rci://192.168.0.160", MODEL)
    loaded.save(tmp_path / "a.json")
    model = load_model(str(tmp_path / "a.json"))
    assert model.description.dh == loaded.model.description.dh
    assert model.description.dh_source == "LoadRobotModel of rci://192.168.0.160"
    q, dq, ddq = states(1)[0]
    ours, theirs = (arm.torque(q, dq, ddq, friction=True).full for arm in (model, loaded.model))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)
    assert model.fingerprint["model"] == loaded.model.fingerprint["model"]
    assert model.clearance(model.home).distance > 0.0
    assert "calibrated" in repr(model)
    run = replace(some_run(), model=model)
    run.save(tmp_path / "a.rcirun")
    recorded = load_run(tmp_path / "a.rcirun").model
    assert recorded is not None
    assert recorded.fingerprint == model.fingerprint


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"format": "x"}, 'has no "format": "rcilab arm"'),
        *(({"model": model}, f'names no arm: "model" is {model}') for model in (None, 5, True)),
        ({"dh": [[0, 0, 0, 0]]}, "dh.* must be a list of 7 entries"),
        ({"links": None}, "links.* must be a list of 7 entries"),
        ({"friction": {"viscous": [0.0] * 7}}, "coulomb"),
        ({"friction": {"viscous": [0.0] * 6, "coulomb": [0.0] * 7, "offset": [0.0] * 7}}, "viscous.* needs .7,"),
        ({"friction": {name: [1e308] * 7 for name in ("viscous", "coulomb", "offset")}}, "viscous must be within"),
        ({"dh": [[0, 0, 0, 0]] * 7}, "dh row 1.* is not near"),
        ({"links": [{"mass": 1e308, "center_of_mass": [0] * 3, "inertia": [0] * 9}] * 7}, "mass must be in 0 to"),
        ({"links": [{"mass": 1, "center_of_mass": [1e9] * 3, "inertia": [0] * 9}] * 7}, "mass must be within 10 m"),
        ({"links": [{"mass": 1, "center_of_mass": [0] * 3, "inertia": [1e300] * 9}] * 7}, "inertia must be within"),
    ],
)
def test_a_file_that_is_not_valid_is_refused_in_one_sentence(tmp_path: Path, change: dict, expected: str) -> None:
    file = tmp_path / "a.json"
    build_loaded_arm(model_response(TABLE), TABLE, "x", MODEL).save(file)
    file.write_text(json.dumps({**json.loads(file.read_text()), **change}))
    with pytest.raises(InvalidValueError, match=expected) as raised:
        load_model(str(file))
    assert "\n" not in str(raised.value)


def test_a_command_for_a_named_arm_says_so_of_a_file() -> None:
    with pytest.raises(ModelError, match=r"'good.json' is a file; this takes the name of an arm, such as xMatePro7"):
        describe_robot("good.json")


def test_a_missing_file_and_another_version_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="does not exist"):
        load_model(str(tmp_path / "none.json"))
    file = tmp_path / "a.json"
    build_loaded_arm(model_response(TABLE), TABLE, "x", MODEL).save(file)
    file.write_text(file.read_text().replace('"version": 1', '"version": 2'))
    with pytest.raises(VersionMismatchError):
        load_model(str(file))
    file.write_text(file.read_text().replace('"version": 2', '"version": 1').replace("xMatePro7", "kuka"))
    with pytest.raises(ModelError, match="known robots"):
        load_model(str(file))
    for text in ("{", '{"a":' * 15_000 + "1" + "}" * 15_000):
        file.write_text(text)
        with pytest.raises(InvalidValueError, match="is not valid JSON"):
            load_model(str(file))
