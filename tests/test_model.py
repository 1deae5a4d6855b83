from __future__ import annotations

import pytest

import rcilab
from rcilab.errors import InvalidValueError, ModelError
from rcilab.model import load_model, require_model
from rcilab.robots import ROBOT_NAMES
from rcilab.spatial import Pose


def test_a_model_is_found_in_any_case():
    assert load_model("xmatepro7").name == "xMatePro7"


def test_an_unknown_model_lists_the_known_ones():
    with pytest.raises(ModelError, match="xMatePro3, xMatePro7, xMate3, xMate7"):
        load_model("UR5")


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_every_limit_has_a_source(name):
    limits = load_model(name).limits
    for group in ("joint", "cartesian", "arm_angle"):
        values = getattr(limits, group)
        for bound in values.__slots__ if values is not None else ():
            assert limits.source(f"{group}.{bound}")
    assert "4.4" in limits.source("joint.velocity")


def test_an_unknown_limit_lists_the_known_ones():
    with pytest.raises(InvalidValueError, match=r"joint\.velocity"):
        load_model("xMate3").limits.source("joint.speed")


def test_limits_cannot_be_changed():
    limits = load_model("xMatePro7").limits
    with pytest.raises(ValueError, match="read-only"):
        limits.joint.velocity[0] = 99.0


def test_home_is_well_inside_the_limits():
    for name in ROBOT_NAMES:
        model = load_model(name)
        assert (model.home > model.limits.joint.lower + 0.2).all()
        assert (model.home < model.limits.joint.upper - 0.2).all()


def test_fingerprint_changes_with_what_it_names_and_nothing_else():
    plain = load_model("xMatePro7").fingerprint
    tooled = load_model("xMatePro7", tool=Pose((0, 0, 0.1))).fingerprint
    assert {key for key in plain if plain[key] != tooled[key]} == {"tool"}
    loaded = load_model("xMatePro7", load=rcilab.Payload(mass=1.0)).fingerprint
    assert {key for key in plain if plain[key] != loaded[key]} == {"load"}


def test_every_public_name_can_be_loaded():
    assert all(getattr(rcilab, name) is not None for name in rcilab.__all__)


def test_a_name_that_does_not_exist_lists_those_that_do():
    with pytest.raises(AttributeError, match="load_model"):
        _ = rcilab.load_robot


def test_a_name_where_a_model_belongs_says_what_to_write():
    model = load_model("xMatePro7")
    assert require_model(model) is model
    with pytest.raises(InvalidValueError, match=r"model: 'xMatePro7' is a name; use load_model\('xMatePro7'\)"):
        require_model("xMatePro7")
    with pytest.raises(InvalidValueError, match="model: None is no robot model"):
        require_model(None)
