from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.upright import upright_flange


def random_state(model, seed=11):
    rng = np.random.default_rng(seed)
    return rng.uniform(-2, 2, model.n), rng.uniform(-1, 1, model.n), rng.uniform(-3, 3, model.n)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_full_torque_is_the_sum_of_its_terms(name):
    model = load_model(name)
    q, dq, ddq = random_state(model)
    terms = model.torque(q, dq, ddq)
    np.testing.assert_allclose(terms.full, terms.inertial + terms.coriolis + terms.gravity, atol=1e-12)
    np.testing.assert_allclose(terms.inertial, model.rigid_body.mass_matrix(q) @ ddq, atol=1e-11)
    np.testing.assert_allclose(model.torque(q).full, terms.gravity, atol=1e-12)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_gravity_torque_is_the_slope_of_the_potential_energy(name):
    model = load_model(name, load=Payload(mass=0.5, center_of_mass=(0.01, 0.02, 0.05)))
    q, _, _ = random_state(model)
    step = 1e-6  # [rad]
    slope = [
        (potential_energy(model, q + s) - potential_energy(model, q - s)) / (2 * step) for s in np.eye(model.n) * step
    ]
    np.testing.assert_allclose(model.torque(q).gravity, slope, atol=1e-6)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_gravity_of_a_tilted_arm_is_that_of_an_upright_one_along_its_direction(name):
    model = load_model(name, load=Payload(mass=0.5, center_of_mass=(0.01, 0.02, 0.05)))
    q, _, _ = random_state(model)
    body = model.rigid_body
    np.testing.assert_allclose(body.tilted_gravity(q, (0.0, 0.0, -1.0)), body.gravity(q), atol=1e-11)
    assert abs(body.tilted_gravity(q, (0.0, 1.0, 0.0))[0]) > 1e-3  # Joint 1 is vertical.


def potential_energy(model, q):
    """Energy from our own forward kinematics: a link turns as the Denavit-Hartenberg frame after its joint does."""
    zero, now = model.joint_frames(np.zeros(model.n)), model.joint_frames(q)
    energy = 0.0
    for frame_zero, frame, link in zip(zero, now, model.description.links, strict=True):
        center_at_zero = link.center_of_mass + link.origin
        local = frame_zero.rotation.T @ (center_at_zero - frame_zero.position)
        energy += 9.81 * link.mass * (frame.position + frame.rotation @ local)[2]
    load = model.load
    return energy + 9.81 * load.mass * (now[-1].position + now[-1].rotation @ load.center_of_mass)[2]


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_every_link_has_a_possible_inertia(name):
    for link in load_model(name).description.links:
        moments = np.linalg.eigvalsh(link.inertia)
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2] * (1 - 1e-9)
        assert link.source


def test_a_load_that_is_none_is_refused():
    with pytest.raises(InvalidValueError, match=r"load mass must be .*, got -1"):
        Payload(mass=-1.0)
    with pytest.raises(InvalidValueError, match="symmetric"):
        Payload(mass=1.0, inertia=[[1, 2, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(InvalidValueError, match="finite"):
        Payload(mass=1.0, center_of_mass=(0, 0, float("nan")))


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_what_a_motion_takes_beyond_gravity_is_the_same_row_by_row_and_all_at_once(name):
    model = load_model(name).with_load(Payload(mass=0.5, center_of_mass=(0.01, 0.02, 0.05)))
    states = [random_state(model, seed) for seed in range(5)]
    together = model.rigid_body.motion_torques(*(np.array(column) for column in zip(*states, strict=True)))
    terms = [model.torque(*state) for state in states]
    np.testing.assert_allclose(together, [t.inertial + t.coriolis for t in terms], atol=1e-11)
    np.testing.assert_allclose(model.torque(states[0][0]).gravity, terms[0].gravity, atol=1e-12)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_all_terms_at_once_are_those_of_the_single_questions(name):
    tool = Pose.from_rpy([0.0, 0.05, 0.1], [0.2, 0.1, -0.7])
    model = load_model(name, tool=tool, load=Payload(mass=0.5, center_of_mass=(0.01, 0.02, 0.05)))
    body, (q, dq, ddq) = model.rigid_body, random_state(model)
    terms, torque, step = body.tool_terms(q, dq), model.torque(q, dq, ddq), 1e-6  # [s]
    np.testing.assert_allclose(terms.mass_inverse @ body.mass_matrix(q), np.eye(model.n), atol=1e-9)
    np.testing.assert_allclose(body.mass_inverse(q), terms.mass_inverse, atol=1e-12)
    np.testing.assert_allclose(body.motion_torque(q, dq, ddq), torque.inertial + torque.coriolis, atol=1e-11)
    np.testing.assert_allclose(body.gravity(q), torque.gravity, atol=1e-11)
    np.testing.assert_allclose(terms.jacobian, model.jacobian(q), atol=1e-12)
    np.testing.assert_allclose(body.tool_jacobian(q), model.jacobian(q), atol=1e-12)
    np.testing.assert_allclose(
        body.link_jacobian(q, model.n, (upright_flange(model.description) @ tool).position),
        model.jacobian(q),
        atol=1e-12,
    )
    assert terms.pose.is_close(model.forward(q), 1e-12)
    np.testing.assert_allclose(terms.twist, model.jacobian(q) @ dq, atol=1e-12)
    slope = (model.jacobian(q + step * dq) - model.jacobian(q - step * dq)) / (2.0 * step)
    np.testing.assert_allclose(terms.acceleration(np.zeros(model.n)), slope @ dq, atol=1e-8)
    np.testing.assert_allclose(terms.acceleration(ddq), terms.jacobian @ ddq + slope @ dq, atol=1e-8)
    np.testing.assert_allclose(body.acceleration(q, dq, torque.full), ddq, atol=1e-9)
    held = torque.inertial + torque.coriolis
    np.testing.assert_allclose(body.weightless_acceleration(q, dq, held), ddq, atol=1e-9)
    assert body.tool_terms(q, dq) is terms
    assert body.tool_terms(q.copy(), dq) is not terms


@pytest.mark.parametrize("name", ROBOT_NAMES)
@pytest.mark.parametrize("tool", [None, Pose([0.1, -0.05, 0.2], [0.9, 0.1, 0.3, 0.2])])
def test_the_motion_of_the_tool_is_that_of_forward_kinematics_and_jacobian(name, tool):
    model, rng = load_model(name, tool=tool), np.random.default_rng(5)
    for q, dq in rng.normal(size=(50, 2, model.n)):
        motion = model.rigid_body.tool_motion(q, dq)
        assert motion.pose.is_close(model.forward(q), 1e-14)
        assert np.array_equal(motion.matrix, motion.pose.matrix)
        assert np.allclose(motion.twist, model.jacobian(q) @ dq, rtol=0, atol=1e-12)


@pytest.mark.parametrize("error", [1e-10, 3e-10])
def test_an_inertia_that_rounding_bent_is_straightened(error):
    inertia = np.diag((2e-10, 1e-10, 1e-10)) + [[0.0, error, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    load = Payload(mass=0.5, inertia=inertia)
    assert np.array_equal(load.inertia, load.inertia.T)
    assert np.isfinite(load_model("xMatePro7", load=load).rigid_body.gravity(np.zeros(7))).all()


def test_a_moment_that_rounding_brought_below_zero_is_zero():
    load = Payload(mass=0.5, inertia=np.diag((-1e-10, 1e-3, 1e-3)))
    assert np.linalg.eigvalsh(load.inertia).min() > -1e-18
    assert np.isfinite(load_model("xMatePro7", load=load).rigid_body.gravity(np.zeros(7))).all()
