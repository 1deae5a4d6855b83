"""Torques of whole tables, with and without friction."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError
from rcilab.model.dynamics.friction import JointFriction
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from rcilab.robots.mjcf import build_mjcf

TERMS = ("full", "inertial", "coriolis", "gravity", "friction")


def states(model, count=5):
    return np.random.default_rng(4).uniform(-2, 2, (3, count, model.n))


@pytest.mark.parametrize("name", ROBOT_NAMES)
@pytest.mark.parametrize("friction", [False, True])
def test_a_table_gives_what_its_rows_give(name, friction):
    model = load_model(name, load=Payload(mass=0.5, center_of_mass=(0.01, 0.02, 0.05)))
    q, dq, ddq = states(model)
    table = model.torque(q, dq, ddq, friction=friction)
    for row in range(len(q)):
        one = model.torque(q[row], dq[row], ddq[row], friction=friction)
        for term in TERMS:
            np.testing.assert_allclose(getattr(table, term)[row], getattr(one, term), atol=1e-11)
    assert "5 rows" in repr(table)
    np.testing.assert_allclose(model.torque(q).full, table.gravity, atol=1e-11)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_friction_is_on_top_of_the_rigid_arm_and_against_the_motion(name):
    model = load_model(name)
    q, dq, ddq = states(model)
    rigid, whole = model.torque(q, dq, ddq), model.torque(q, dq, ddq, friction=True)
    assert not rigid.friction.any()
    np.testing.assert_allclose(whole.full - rigid.full, whole.friction, atol=1e-12)
    assert (whole.friction * dq > 0.0).all()  # Moving costs power, in either direction.
    assert not model.torque(q, ddq=ddq, friction=True).friction.any()


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_friction_is_that_of_the_simulated_arm(name):
    model = load_model(name)
    simulated = mujoco.MjModel.from_xml_string(build_mjcf(model.description))
    _, dq, _ = states(model)
    found = model.torque(np.zeros(dq.shape), dq, friction=True).friction
    np.testing.assert_allclose(found, simulated.dof_damping * dq, rtol=1e-9)


def test_a_table_of_another_length_is_refused():
    model = load_model("xMatePro7")
    with pytest.raises(InvalidValueError, match="dq"):
        model.torque(np.zeros((3, 7)), np.zeros((2, 7)))


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_identified_friction_is_a_line_for_each_direction_and_costs_power(seed):
    random = np.random.default_rng(seed)
    viscous, coulomb = random.uniform(0, 3, (2, 7))
    model, (q, dq, ddq) = load_model("xMatePro7"), states(load_model("xMatePro7"))
    law = JointFriction(viscous=viscous, coulomb=coulomb, offset=np.zeros(7))
    whole, rigid = model.torque(q, dq, ddq, friction=law), model.torque(q, dq, ddq)
    np.testing.assert_allclose(whole.full, rigid.full + whole.friction, atol=1e-12)
    np.testing.assert_allclose(np.abs(whole.friction), viscous * np.abs(dq) + coulomb, atol=1e-12)
    assert (whole.friction * dq >= 0.0).all()
    shifted = JointFriction(viscous=viscous, coulomb=coulomb, offset=random.normal(size=7))
    np.testing.assert_allclose(shifted.torque(-dq) + shifted.torque(dq), 2.0 * np.tile(shifted.offset, (len(dq), 1)))
    assert not law.torque(np.zeros(7)).any()  # At rest it holds no joint in place, nor does it push one.


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        (None, "friction must be True, False or a JointFriction, got None"),
        ("much", "must be True, False or a JointFriction"),
        (JointFriction(viscous=[1.0] * 6, coulomb=[0.0] * 6, offset=[0.0] * 6), "is for 6 joints, the arm has 7"),
    ],
)
def test_what_is_no_friction_of_the_arm_is_refused_in_words(friction, words):
    with pytest.raises(InvalidValueError, match=words):
        load_model("xMatePro7").torque(np.zeros(7), friction=friction)


def test_a_friction_that_drives_is_refused():
    with pytest.raises(InvalidValueError, match=r"coulomb friction must not be negative"):
        JointFriction(viscous=[1.0] * 7, coulomb=[-1.0] * 7, offset=[0.0] * 7)
    with pytest.raises(InvalidValueError, match=r"offset friction: .* needs \(7,\)"):
        JointFriction(viscous=[1.0] * 7, coulomb=[1.0] * 7, offset=[0.0] * 6)
    with pytest.raises(InvalidValueError, match=r"viscous friction.*finite"):
        JointFriction(viscous=[float("nan")] * 7, coulomb=[1.0] * 7, offset=[0.0] * 7)
