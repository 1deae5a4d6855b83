from __future__ import annotations

import numpy as np
import pytest

import rcilab
from rcilab.core.errors import InvalidValueError, ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import RobotModel, load_model, require_model
from rcilab.robots import ROBOT_NAMES


def test_a_model_is_found_in_any_case():
    assert load_model("xmatepro7").name == "xMatePro7"


def test_an_unknown_model_lists_the_known_ones():
    with pytest.raises(ModelError, match="xMatePro3, xMatePro7, xMate3, xMate7"):
        load_model("UR5")


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_every_limit_has_a_source(name):
    model = load_model(name)
    limits = model.limits
    for group in ("joint", "cartesian", "arm_angle"):
        values = getattr(limits, group)
        for bound in values.__slots__ if values is not None else ():
            # The arm's own bounds beside soft ones have their sources already; not every arm has bounds near the ends.
            if bound != "own" and getattr(values, bound) is not None:
                assert limits.source(f"{group}.{bound}")
    places = {
        "rokae": "RCI user manual V1.3.1, 4.4",
        "franka": "Franka's page",
        "ufactory": "user manual of UFACTORY Studio, 10",
        "realman": "the maker's client library",
    }
    assert places[model.description.maker] in limits.source("joint.acceleration")


def test_the_ranges_of_an_fr3_have_a_source_of_their_own():
    limits = load_model("FR3").limits
    assert limits.source("joint.lower") == limits.source("joint.near_ends") == limits.source("joint.velocity")
    assert limits.source("joint.lower").startswith("URDF of the FR3")
    assert limits.source("joint.jerk").startswith("Franka's page")


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
    with pytest.raises(InvalidValueError, match=r"model must be a robot model.*, got None"):
        require_model(None)


@pytest.mark.parametrize("value", [None, 3, b"tool"])
def test_what_is_no_tool_or_load_is_refused_in_words(value):
    model = load_model("xMate3")
    with pytest.raises(InvalidValueError, match=r"tool must be a Pose"):
        model.with_tool(value)
    with pytest.raises(InvalidValueError, match=r"load must be a Payload"):
        model.with_load(value)


def test_a_load_beyond_the_rated_payload_is_refused_with_value_bound_and_unit():
    assert load_model("xMatePro7", load=rcilab.Payload(mass=7.0)).load.mass == 7.0
    with pytest.raises(InvalidValueError, match=r"load mass: 100\.0 kg is above 7 kg for xMatePro7") as caught:
        load_model("xMatePro7").with_load(rcilab.Payload(mass=100.0))
    assert caught.value.value == 100.0
    with pytest.raises(InvalidValueError, match=r"load mass: 3\.5 kg is above 3 kg for xMate3"):
        load_model("xMate3", load=rcilab.Payload(mass=3.5))


def test_an_arm_angle_or_target_of_the_wrong_type_is_refused_in_words():
    model = load_model("xMatePro7")
    target = model.forward(model.home)
    with pytest.raises(InvalidValueError, match=r"psi must be a number .*got 'a'"):
        model.inverse(target, psi="a")
    with pytest.raises(InvalidValueError, match=r"psi must be a number .*got 'a'"):
        model.closest(target, model.home, psi="a")
    with pytest.raises(InvalidValueError, match="pose needs shape"):
        model.closest(None, model.home)
    assert model.closest(target.matrix, model.home).pose.is_close(target, 1e-9)


def test_an_angle_that_is_not_finite_is_named_by_row_and_joint():
    path = np.zeros((4, 7))
    path[2, 4] = np.nan
    with pytest.raises(InvalidValueError, match=r"q at row 2 \(from 0\), joint 5 must be finite \[rad\], got nan"):
        load_model("xMatePro7").forward_path(path)


def test_limits_show_themselves_in_one_short_line():
    limits = load_model("xMatePro7").limits
    for value in (limits, limits.joint):
        assert "7 joints" in repr(value)
        assert len(repr(value)) < 200


def test_a_state_shows_itself_in_one_short_line():
    with rcilab.simulate(load_model("xMatePro7")) as robot:
        text = repr(robot.state)
    assert text.startswith("<RobotState ")
    assert "deg" in text
    assert "faults: none" in text
    assert len(text) < 200


def test_values_of_a_model_show_themselves_in_one_short_line():
    model = load_model("xMatePro7", load=rcilab.Payload(mass=1.5, center_of_mass=[0.0, 0.01, 0.1]))
    sample = rcilab.plan_joint(model, model.home, model.home + 0.5).at(0.2)
    values = (model.description, model.description.base, model.load, model.torque(model.home, model.home, model.home))
    for value in (*values, sample):
        assert repr(value).startswith(f"<{type(value).__name__}")
        assert "\n" not in repr(value)
        assert len(repr(value)) < 180
    assert "xMatePro7: 7 joints" in repr(model.description)
    assert "1.5 kg, centre of mass at 0 0.01 0.1 m" in repr(model.load)


@pytest.mark.parametrize(
    ("manual", "names"),
    {
        "GetCartPose": ("pose", "forward_path"),
        "GetJointPos": ("inverse", "inverse_batch"),
        "Jacobian": ("jacobian",),
        "GetCartVel": ("velocity",),
        "GetCartAcc": ("acceleration",),
        "GetJointVel": ("joint_velocity",),
        "GetJointAcc": ("joint_acceleration",),
        "GetTau": ("torque",),
        "GetTauNoFriction": ("torque",),
        "SetLoad": ("with_load",),
        "SetCoor": ("with_tool", "with_stiffness_frame"),
    }.items(),
)
def test_who_knows_the_manuals_model_library_finds_its_names(manual, names):
    for name in names:
        assert f"({manual}" in getattr(RobotModel, name).__doc__ or f", {manual})" in getattr(RobotModel, name).__doc__


@pytest.mark.parametrize("name", ["FR3", "xMatePro7", "xArm5"])
def test_a_position_in_mm_is_answered_with_the_unit(name):
    model = load_model(name)
    with pytest.raises(UnreachableError, match="positions are in m"):
        model.inverse(Pose((400.0, 0.0, 300.0), model.forward(model.home).wxyz))
    with pytest.raises(UnreachableError) as caught:
        model.inverse(Pose((2.0, 0.0, 0.3), model.forward(model.home).wxyz))
    assert "positions are in m" not in str(caught.value)
