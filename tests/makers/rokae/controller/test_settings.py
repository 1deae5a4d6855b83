"""Every setter keeps what is in range, inclusive, and refuses the rest without a trace."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.settings import Settings, apply_request
from rcilab.robots import RobotDescription, describe_robot
from rcilab.sim.arm_parameters import ForceAxesKind

NAN = math.nan
POSE = (1.0, 0.0, 0.0, 0.25, 0.0, 1.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.75, 0.0, 0.0, 0.0, 1.0)
MIRROR = (-1.0, *POSE[1:])
SKEW = (1.0, 0.1, *POSE[2:])
NO_NUMBER = (*POSE[:3], NAN, *POSE[4:])
BENT = (*POSE[:15], 0.999)
THRESHOLDS = (75.0, 75.0, 60.0, 45.0, 30.0, 30.0, 20.0)
STIFFNESS = (3000.0,) * 4 + (300.0,) * 3
UPPER = tuple(math.radians(angle) for angle in (170, 120, 170, 120, 170, 120, 360))
LOWER = tuple(-angle for angle in UPPER)
WRENCH = (60.0, -60.0, 60.0, 30.0, -30.0, 30.0)
CARTESIAN = (3000.0,) * 3 + (300.0,) * 3
INERTIA = (0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01)


def more(values: tuple[float, ...], place: int, by: float = 1e-6) -> tuple[float, ...]:
    return (*values[:place], values[place] + by, *values[place + 1 :])


GOOD = [
    rci.SetCollisionBehavior(THRESHOLDS),
    rci.SetCollisionBehavior((0.0,) * 7),
    rci.SetJointImpedance(STIFFNESS),
    rci.SetCartesianImpedance(CARTESIAN),
    rci.SetCartesianImpedance((0.0,) * 6),
    rci.SetCartImpDesiredTau(WRENCH),
    rci.SetFilters(0.1, 1000.0, 55.5),
    rci.SetTorqueFilterCutOffFrequency(1000.0),
    rci.SetJointLimit(UPPER, LOWER),
    rci.SetCartesianLimit((0.1, 2.0, 1e-3), POSE),
    rci.SetCoor(POSE),
    rci.SetFcCoor(POSE, 2),
    rci.SetLoad(7.0, (0.0, 0.0, 0.1), INERTIA),
    rci.SetLoad(0.0, (0.0,) * 3, (0.0,) * 9),
    rci.EnableVirtualGuide(True),
    rci.SetDO(5, True),
]
BAD = [
    *(rci.SetCollisionBehavior(more(THRESHOLDS, joint)) for joint in range(7)),
    rci.SetCollisionBehavior(more((0.0,) * 7, 3, -1e-9)),
    rci.SetCollisionBehavior(more(THRESHOLDS, 2, NAN)),
    *(rci.SetJointImpedance(more(STIFFNESS, joint)) for joint in range(7)),
    rci.SetJointImpedance(more(STIFFNESS, 0, NAN)),
    *(rci.SetCartesianImpedance(more(CARTESIAN, axis)) for axis in range(6)),
    rci.SetCartesianImpedance((-1.0,) * 6),
    *(rci.SetCartImpDesiredTau(more((0.0,) * 6, axis, 60.1)) for axis in range(6)),
    rci.SetCartImpDesiredTau(more((0.0,) * 6, 5, -30.1)),
    rci.SetCartImpDesiredTau((NAN,) * 6),
    rci.SetFilters(1000.1, 1.0, 1.0),
    rci.SetFilters(1.0, 0.0, 1.0),
    rci.SetFilters(1.0, -0.1, 1.0),
    rci.SetFilters(1.0, 1.0, NAN),
    rci.SetTorqueFilterCutOffFrequency(0.0),
    rci.SetTorqueFilterCutOffFrequency(NAN),
    rci.SetTorqueFilterCutOffFrequency(math.inf),
    *(rci.SetJointLimit(more(UPPER, joint), LOWER) for joint in range(7)),
    *(rci.SetJointLimit(UPPER, more(LOWER, joint, -1e-6)) for joint in range(7)),
    rci.SetJointLimit(LOWER, UPPER),
    rci.SetJointLimit(more(UPPER, 1, NAN), LOWER),
    rci.SetCartesianLimit((0.0, 1.0, 1.0), POSE),
    rci.SetCartesianLimit((1.0, NAN, 1.0), POSE),
    rci.SetCartesianLimit((1.0, math.inf, 1.0), POSE),
    rci.SetCartesianLimit((1.0, 1.0, 1.0), SKEW),
    *(rci.SetCoor(pose) for pose in (MIRROR, SKEW, NO_NUMBER, BENT)),
    *(rci.SetFcCoor(pose, 0) for pose in (MIRROR, SKEW, NO_NUMBER, BENT)),
    rci.SetFcCoor(POSE, 3),
    rci.SetLoad(7.1, (0.0,) * 3, INERTIA),
    rci.SetLoad(-0.1, (0.0,) * 3, INERTIA),
    rci.SetLoad(NAN, (0.0,) * 3, INERTIA),
    rci.SetLoad(1.0, (0.0, NAN, 0.0), INERTIA),
    rci.SetLoad(1.0, (0.0,) * 3, more(INERTIA, 4, math.inf)),
    rci.SetLoad(1.0, (0.0,) * 3, more(INERTIA, 1, 0.5)),
    rci.SetDO(6, True),
    rci.SetDO(255, True),
]


@pytest.fixture
def arm() -> RobotDescription:
    return describe_robot("xMatePro7")


@pytest.fixture
def settings(arm: RobotDescription) -> Settings:
    return Settings.of(arm)


@pytest.mark.parametrize("request_", GOOD, ids=lambda request_: type(request_).__name__)
def test_values_on_the_edge_of_their_range_are_taken(settings, arm, request_: rci.Request) -> None:
    apply_request(settings, request_, arm)


@pytest.mark.parametrize("request_", BAD, ids=lambda request_: type(request_).__name__)
def test_values_beyond_their_range_are_refused(settings, arm, request_: rci.Request) -> None:
    with pytest.raises(InvalidValueError):
        apply_request(settings, request_, arm)


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        (rci.SetCollisionBehavior(more(THRESHOLDS, 2)), "threshold of joint 3: 60.000001 N m is outside 0 to 60 N m"),
        (rci.SetCartImpDesiredTau(more((0.0,) * 6, 5, -30.1)), "moment about z: -30.1 N m is outside -30 to 30 N m"),
        (rci.SetFilters(1.0, 0.0, 1.0), "Cartesian frequency: 0.0 Hz is outside 0.1 to 1000 Hz"),
        (
            rci.SetJointLimit(LOWER, UPPER),
            "lower limit of joint 1: 2.96705973 rad is not below the upper",
        ),
        (
            rci.SetCoor((*POSE[:3], 25.0, *POSE[4:])),
            "distance of the tool from the flange: 25.0162447 m is",
        ),
        (rci.SetDO(6, True), "signal: 6 does not exist; there are 0 to 5"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_refusal_names_the_value_its_bound_and_its_unit(settings, arm, request_: rci.Request, said: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        apply_request(settings, request_, arm)
    assert said in str(caught.value)


def test_taken_values_are_in_the_settings(settings, arm) -> None:
    for request_ in GOOD:
        settings = apply_request(settings, request_, arm)
    assert settings.collision_thresholds == (0.0,) * 7
    assert settings.desired_wrench == WRENCH
    assert (settings.joint_filter, settings.cartesian_filter, settings.torque_filter) == (0.1, 1000.0, 55.5)
    assert settings.T_flange_tool.position.tolist() == [0.25, 0.5, 0.75]
    assert settings.force_axes is ForceAxesKind.PATH
    assert settings.safety_box is not None
    assert settings.safety_box.size == (0.1, 2.0, 1e-3)
    assert settings.outputs == (False,) * 5 + (True,)
    assert settings.virtual_guide


def test_a_6_axis_arm_looks_at_six_elements_only() -> None:
    arm = describe_robot("xMate3")
    settings = Settings.of(arm)
    for request_ in (
        rci.SetCollisionBehavior((75.0, 75.0, 45.0, 30.0, 30.0, 20.0, NAN)),
        rci.SetJointImpedance((3000.0,) * 3 + (300.0,) * 3 + (NAN,)),
        rci.SetJointLimit((1.0,) * 6 + (NAN,), (-1.0,) * 6 + (NAN,)),
    ):
        settings = apply_request(settings, request_, arm)
    assert settings.collision_thresholds == (75.0, 75.0, 45.0, 30.0, 30.0, 20.0)
    assert settings.joint_upper == (1.0,) * 6
    with pytest.raises(InvalidValueError, match=r"mass: 3\.1 kg is outside 0 to 3 kg"):
        apply_request(settings, rci.SetLoad(3.1, (0.0,) * 3, INERTIA), arm)


def test_a_controller_wakes_up_with_the_widest_limits(settings, arm) -> None:
    assert np.array_equal(settings.joint_upper, arm.limits.joint.upper)
    assert settings.collision_thresholds == THRESHOLDS
    assert settings.safety_box is None
