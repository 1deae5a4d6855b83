"""Samples of the workspace, and dexterity along paths."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from tests.arms import ANY_POSE

TOOL = Pose.from_rpy((0.03, -0.02, 0.12), (0.3, -0.4, 0.5))


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_samples_are_inside_the_limits_and_the_tool_is_where_they_say(name):
    model = load_model(name, tool=TOOL)
    found, limits = model.sample_workspace(500, seed=3), model.limits.joint
    assert len(found) == 500
    assert ((found.q > limits.lower) & (found.q < limits.upper)).all()
    assert (np.ptp(found.q, axis=0) > 0.9 * (limits.upper - limits.lower)).all()  # All over the ranges.
    for q, position in zip(found.q, found.position, strict=True):
        np.testing.assert_allclose(model.forward(q).position, position, atol=1e-12)
    assert "500 samples" in repr(found)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_dexterity_of_a_table_is_that_of_its_rows(name):
    model = load_model(name, tool=TOOL)
    q = model.sample_workspace(50).q
    found = model.dexterity_path(q)
    for row in range(len(q)):
        one = model.dexterity(q[row])
        for measure in ("manipulability", "smallest", "condition"):
            assert getattr(found, measure)[row] == pytest.approx(getattr(one, measure), rel=1e-6)
    np.testing.assert_array_equal(model.sample_workspace(50).dexterity.smallest, found.smallest)


def test_the_same_seed_gives_the_same_samples_and_another_one_others():
    model = load_model("xMatePro7")
    np.testing.assert_array_equal(model.sample_workspace(20, seed=1).q, model.sample_workspace(20, seed=1).q)
    assert (model.sample_workspace(20, seed=1).q != model.sample_workspace(20, seed=2).q).all()


def test_a_box_keeps_the_samples_inside_it():
    model = load_model("xMatePro7")
    box = SafetyBox(size=(0.8, 0.8, 0.8), T_base_box=Pose((0.4, 0.0, 0.6)))
    free, boxed = model.sample_workspace(2000), model.sample_workspace(2000, box=box)
    inside = box.excess_path(free.position) <= 0.0
    assert 0 < inside.sum() < 2000
    np.testing.assert_array_equal(boxed.q, free.q[inside])
    nowhere = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose((5.0, 0.0, 0.0)))
    assert len(model.sample_workspace(10, box=nowhere)) == 0
    assert "0 samples" in repr(model.sample_workspace(10, box=nowhere))


@pytest.mark.parametrize("count", [0, -5, 10**7, 2.5, "many", None])
def test_a_count_that_is_none_or_out_of_range_is_refused(count):
    with pytest.raises(InvalidValueError, match=r"count must be a whole number from 1 to 1000000"):
        load_model("xMatePro7").sample_workspace(count)


@pytest.mark.parametrize("seed", [-1, "many", 2.5, None])
def test_a_seed_that_is_none_is_refused(seed):
    with pytest.raises(InvalidValueError, match=r"seed must be a whole number, 0 or more"):
        load_model("xMatePro7").sample_workspace(10, seed=seed)


@pytest.mark.parametrize("name", ANY_POSE)
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_dexterity_says_how_fast_the_tool_moves_and_how_the_joints_pay_for_it(name, seed):
    model, random = load_model(name, tool=TOOL), np.random.default_rng(seed)
    limits = model.limits.joint
    q = random.uniform(limits.lower, limits.upper)
    found, J = model.dexterity(q), model.jacobian(q)
    assert found.manipulability == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)), rel=1e-5, abs=1e-9)
    assert model.manipulability(q) == found.manipulability
    twists = random.normal(size=(50, 6))
    twists /= np.linalg.norm(twists, axis=1)[:, np.newaxis]
    cheapest = np.linalg.norm(np.linalg.lstsq(J, twists.T, rcond=None)[0], axis=0)  # Least joint speeds of each.
    assert (cheapest <= (1 + 1e-6) / found.smallest).all()  # No direction costs more than the worst one.
    assert cheapest.max() / cheapest.min() <= found.condition * (1 + 1e-6)
