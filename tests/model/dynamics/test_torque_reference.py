"""Torques against numbers computed by the vendor's model library, and the quirks in which we do not follow it."""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rcilab.makers.rokae.base_parameters import regressor
from rcilab.model.dynamics.friction import JointFriction
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.robots import ROBOT_NAMES

REFERENCE = json.loads((Path(__file__).parent / "reference_torque.json").read_text())["models"]
TOLERANCE = 1e-9  # [N m]; the agreement is near 1e-12.
RIGID = ("inertial", "coriolis", "gravity")


def column(name, call, term):
    return np.array([case[call][term] for case in REFERENCE[name]["cases"]])


def states(name):
    return (np.array([case[key] for case in REFERENCE[name]["cases"]]) for key in ("q", "dq", "ddq"))


def blocks(name, friction=True):
    """What was served for each joint: what its link weighs, and in what it loses power, if that was served too."""
    numbers = REFERENCE[name]["with_friction" if friction else "without_friction"]
    tail = 3 if friction else 0
    first = 3 + tail
    return [numbers[:first]] + [numbers[i : i + 7 + tail] for i in range(first, len(numbers), 7 + tail)]


def base_parameters(name):
    first, *others = blocks(name)
    return np.array(first[:1] + [number for block in others for number in block[:7]])


def served_friction(name):
    viscous, coulomb, offset = np.array([block[-3:] for block in blocks(name)]).T
    return JointFriction(viscous=viscous, coulomb=coulomb, offset=offset)


@cache
def served_arm(name):
    """An arm of our own that has the base parameters that were served.

    Torques are linear in a link's first moments and its inertia about a fixed point, so a linear system, at states of
    its own, gives all sets of them that make those torques; stepping between these sets and the possible bodies finds
    one that is both.
    """
    model, served = load_model(name), base_parameters(name)
    q, dq, ddq = np.random.default_rng(3).uniform(-2, 2, (3, 20, 7))
    wanted = np.concatenate([regressor(model, *state) @ served for state in zip(q, dq, ddq, strict=True)])

    def arm(table):
        links = [with_moments(*pair) for pair in zip(model.description.links, table.reshape(7, 9), strict=True)]
        return RobotModel(dataclasses.replace(model.description, links=tuple(links)))

    def torques(table):
        return arm(table).torque(q, dq, ddq).full.ravel()

    table = np.concatenate([moments(link) for link in model.description.links])
    step = 1e-4  # [kg m] and [kg m^2]: so little that every link stays a possible body.
    start = torques(table)
    slopes = (np.stack([torques(table + step * unit) for unit in np.eye(63)], axis=1) - start[:, np.newaxis]) / step
    inverse, offset = np.linalg.pinv(slopes, rcond=1e-8), start - slopes @ table
    for _ in range(200):
        table = table + inverse @ (wanted - offset - slopes @ table)
        links = [with_moments(*pair) for pair in zip(model.description.links, table.reshape(7, 9), strict=True)]
        if min(np.linalg.eigvalsh(link.inertia)[0] for link in links) > 0.0:
            return arm(table)
        table = np.concatenate([moments(possible(link)) for link in links])
    raise AssertionError("no bodies found with these parameters")


def moments(link):
    """First moments and inertia about the frame's origin, 3 and 6 numbers: what torques are linear in."""
    about_origin = link.inertia + link.mass * steiner(link.center_of_mass)
    return np.concatenate((link.mass * link.center_of_mass, about_origin[np.triu_indices(3)]))


def with_moments(link, numbers):
    """The link with other moments and the same mass."""
    centre, (a, b, c, d, e, f) = numbers[:3] / link.mass, numbers[3:]
    about_origin = np.array(((a, b, c), (b, d, e), (c, e, f)))
    return dataclasses.replace(link, center_of_mass=centre, inertia=about_origin - link.mass * steiner(centre))


def possible(link):
    """The link with an inertia that some body has."""
    values, axes = np.linalg.eigh(link.inertia)
    return dataclasses.replace(link, inertia=axes * np.maximum(values, 1e-3) @ axes.T)


def steiner(p):
    return p @ p * np.eye(3) - np.outer(p, p)


@pytest.mark.parametrize("name", REFERENCE)
def test_every_term_and_the_sum_agree_for_an_arm_with_the_parameters_that_were_served(name):
    found = served_arm(name).torque(*states(name), friction=served_friction(name))
    for term in (*RIGID, "friction", "full"):
        expected = column(name, "with_friction", term)
        np.testing.assert_allclose(getattr(found, term), expected, atol=TOLERANCE, rtol=0, err_msg=term)
        assert np.abs(expected).max() > 0.1  # It is no comparison of nothing with nothing.


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_without_friction_it_ignores_the_last_two_numbers(name):
    """It takes two built-in constants for the first moments of link 7; ours are the torques of what was served."""
    model, served = load_model(name), base_parameters(name)
    assert served[-2:].tolist() == blocks(name, friction=False)[-1][-2:]  # They were served, and differ from those:
    rows = [regressor(model, *state)[:, -2:] for state in zip(*states(name), strict=True)]
    ours = served_arm(name).torque(*states(name))
    theirs = column(name, "without_friction", "full")
    assert np.abs(theirs - ours.full).max() > 1e-2
    constants, *_ = np.linalg.lstsq(np.concatenate(rows), (theirs - ours.full).ravel(), rcond=None)
    np.testing.assert_allclose(np.stack(rows) @ constants, theirs - ours.full, atol=TOLERANCE, rtol=0)
    sums = sum(column(name, "without_friction", term) for term in RIGID)
    np.testing.assert_allclose(sums, theirs, atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_its_single_call_mixes_both_parameter_sets(name):
    for term in ("full", "inertial", "coriolis"):
        np.testing.assert_array_equal(column(name, "separate", term), column(name, "with_friction", term))
    gravity = column(name, "separate", "gravity")
    np.testing.assert_array_equal(gravity, column(name, "without_friction", "gravity"))
    assert np.abs(gravity - served_arm(name).torque(*states(name)).gravity).max() > 1e-2


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_its_single_call_takes_friction_from_misplaced_numbers(name):
    """The number before the viscous one for the Coulomb level, and the viscous one for the offset."""
    _, dq, _ = states(name)
    before, viscous = np.array([block[-4:-2] for block in blocks(name)]).T
    theirs = column(name, "separate", "friction")
    np.testing.assert_allclose(theirs, before * np.sign(dq) + viscous, atol=TOLERANCE, rtol=0)
    assert np.abs(theirs - served_friction(name).torque(dq)).max() > 1.0


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_the_vendors_quirk_is_known_its_load_is_no_rigid_body_and_ours_is_one(name):
    """There the lateral centre of mass and the products of inertia count for nothing, and joint 7 feels nothing."""
    bare = load_model(name)
    inertia = np.array(((0.03, 0.004, -0.003), (0.004, 0.02, 0.005), (-0.003, 0.005, 0.025)))
    load = Payload(mass=0.5, center_of_mass=(0.05, -0.08, 0.06), inertia=inertia)
    model, random = bare.with_load(load), np.random.default_rng(6)
    for q in random.uniform(-2, 2, (10, model.n)):
        flange = model.pose(q, "flange")
        J, R = model.jacobian(q, "flange"), flange.rotation
        J_centre = J[:3] + np.cross(J[3:].T, R @ load.center_of_mass).T
        added = load.mass * J_centre.T @ J_centre + J[3:].T @ R @ inertia @ R.T @ J[3:]
        found = model.rigid_body.mass_matrix(q) - bare.rigid_body.mass_matrix(q)
        np.testing.assert_allclose(found, added, atol=1e-12)
        weight = 9.81 * load.mass * J_centre[2]
        np.testing.assert_allclose(model.torque(q).gravity - bare.torque(q).gravity, weight, atol=1e-11)
    assert abs(weight[-1]) > 1e-2  # The last joint feels a centre of mass beside its axis.
    plain = bare.with_load(Payload(mass=0.5, center_of_mass=(0.0, 0.0, 0.06), inertia=np.diag(np.diag(inertia))))
    ddq = random.uniform(-2, 2, model.n)
    assert np.abs(model.torque(q, ddq=ddq).inertial - plain.torque(q, ddq=ddq).inertial).max() > 1e-2
