"""Client, page and controller take the same arguments and start with the same values."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pytest

from rcilab.app.setup.configuration_state import SetupState
from rcilab.app.setup.setup_fields import FIELD_NAMES, INERTIA_NAMES, field_range
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.maker import capabilities_of, parameters_of
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.bounds import SIGNAL_COUNT
from rcilab.makers.rokae.controller.settings import Settings, apply_request
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.model.dynamics.payload import NO_LOAD
from rcilab.model.robot_model import load_model
from rcilab.robots import RobotDescription, describe_robot

ARMS = ("xMatePro3", "xMatePro7", "xMate3", "xMate7")
BODY = (0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01)
NO_BODY = (0.0,) * 9
BEYOND = 1e-6  # Of a bound: more than any tolerance.


class Wire:
    """A connection that sends nothing and grants everything."""

    latest = None

    def __init__(self, n: int) -> None:
        self.n = n

    def request(self, request: rci.Request, timeout: float | None = None) -> rci.StatusResponse:
        return rci.StatusResponse(rci.SettingStatus.SUCCESS)


class Setter(NamedTuple):
    """One setter at both ends, as a function of the numbers that it bounds."""

    name: str
    client: Callable[[RciCommands, list[float]], object]
    request: Callable[[list[float]], rci.Request]
    low: list[float]
    high: list[float]
    good: list[float]


def along(axis: int, x: float) -> Pose:
    return Pose([x if i == axis else 0.0 for i in range(3)])


def box(values: list[float]) -> SafetyBox:
    return SafetyBox(size=tuple(values[:3]), T_base_box=Pose(values[3:]), active=True)


def box_request(values: list[float]) -> rci.Request:
    x, y, z = values[3:]
    return rci.SetCartesianLimit(values[:3], (1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1), True)


def placed(x: float) -> tuple[float, ...]:
    return (1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)


def setters(arm: RobotDescription) -> Iterator[Setter]:
    joint, tool, n = arm.limits.joint, arm.limits.cartesian, arm.n
    stiffness = [tool.translation_stiffness] * 3 + [tool.rotation_stiffness] * 3
    wrench = [tool.force] * 3 + [tool.moment] * 3
    lower, upper = joint.lower.tolist(), joint.upper.tolist()
    yield Setter(
        "collision", RciCommands.set_collision_behavior, rci.SetCollisionBehavior,
        [0.0] * n, joint.collision_threshold.tolist(), [1.0] * n,
    )  # fmt: skip
    yield Setter(
        "joint stiffness", RciCommands.set_joint_impedance, rci.SetJointImpedance,
        [0.0] * n, joint.stiffness.tolist(), [1.0] * n,
    )  # fmt: skip
    yield Setter(
        "Cartesian stiffness", RciCommands.set_cartesian_impedance, rci.SetCartesianImpedance,
        [0.0] * 6, stiffness, [1.0] * 6,
    )  # fmt: skip
    yield Setter(
        "wrench", RciCommands.set_cart_imp_desired_tau, rci.SetCartImpDesiredTau,
        [-x for x in wrench], wrench, [0.0] * 6,
    )  # fmt: skip
    yield Setter(
        "filters", lambda c, v: c.set_filters(*v), lambda v: rci.SetFilters(*v), [0.1] * 3, [1000.0] * 3, [50.0] * 3
    )
    yield Setter(
        "report filter", lambda c, v: c.set_torque_filter_cut_off_frequency(v[0]),
        lambda v: rci.SetTorqueFilterCutOffFrequency(v[0]), [0.1], [1000.0], [50.0],
    )  # fmt: skip
    yield Setter(
        "lower limits", lambda c, v: c.set_joint_limit(v, upper), lambda v: rci.SetJointLimit(upper, v),
        lower, upper, lower,
    )  # fmt: skip
    yield Setter(
        "upper limits", lambda c, v: c.set_joint_limit(lower, v), lambda v: rci.SetJointLimit(v, lower),
        lower, upper, upper,
    )  # fmt: skip
    yield Setter(
        "box", lambda c, v: c.set_cartesian_limit(box(v)), box_request,
        [1e-9] * 3 + [-10.0] * 3, [100.0] * 3 + [10.0] * 3, [1.0] * 3 + [0.0] * 3,
    )  # fmt: skip
    yield Setter(
        "tool", lambda c, v: c.set_coor(along(0, v[0])), lambda v: rci.SetCoor(placed(v[0])), [-2.0], [2.0], [0.1]
    )
    yield Setter(
        "force frame", lambda c, v: c.set_fc_coor(along(0, v[0])), lambda v: rci.SetFcCoor(placed(v[0]), 0),
        [-2.0], [2.0], [0.1],
    )  # fmt: skip
    yield Setter(
        "mass", lambda c, v: c.set_load(v[0], [0.0] * 3, np.zeros((3, 3))),
        lambda v: rci.SetLoad(v[0], (0.0,) * 3, NO_BODY), [0.0], [arm.rated_payload], [1.0],
    )  # fmt: skip
    yield Setter(
        "centre of mass", lambda c, v: c.set_load(1.0, v, np.array(BODY).reshape(3, 3)),
        lambda v: rci.SetLoad(1.0, tuple(v), BODY), [-2.0] * 3, [2.0] * 3, [0.0] * 3,
    )  # fmt: skip


def client_takes(arm: RobotDescription, setter: Setter, values: list[float]) -> bool:
    try:
        setter.client(RciCommands(Wire(arm.n), arm), values)  # type: ignore[arg-type]
    except InvalidValueError:
        return False
    return True


def controller_takes(arm: RobotDescription, request: rci.Request) -> bool:
    try:
        apply_request(Settings.of(arm), request, arm)
    except InvalidValueError:
        return False
    return True


@pytest.mark.parametrize("name", ARMS)
def test_client_and_controller_take_the_same_numbers_up_to_the_same_bounds(name) -> None:
    arm = describe_robot(name)
    for setter in setters(arm):
        for i, (low, high) in enumerate(zip(setter.low, setter.high, strict=True)):
            beyond = [low - max(BEYOND, BEYOND * abs(low)), high + max(BEYOND, BEYOND * abs(high))]
            inside = [] if setter.name.endswith("limits") else [low, high]  # A limit at the other end leaves no range.
            for value in (*inside, *beyond, math.nan, math.inf, -math.inf):
                values = [*setter.good[:i], value, *setter.good[i + 1 :]]
                taken = client_takes(arm, setter, values), controller_takes(arm, setter.request(values))
                assert taken == (value in inside,) * 2, (setter.name, i, value)
        assert client_takes(arm, setter, setter.good)
        assert controller_takes(arm, setter.request(setter.good))


@pytest.mark.parametrize("inertia", [BODY, (1.0, *BODY[1:]), (-0.01, *BODY[1:]), (0.01, 0.2, *BODY[2:])])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_both_ends_refuse_a_load_that_no_body_has(mass, inertia) -> None:
    arm = describe_robot("xMatePro7")
    request = rci.SetLoad(mass, (0.0,) * 3, inertia)
    load = Setter(
        "load", lambda c, v: c.set_load(mass, v, np.array(inertia).reshape(3, 3)), lambda v: request, [], [], []
    )
    possible = mass > 0.0 and inertia is BODY
    assert (client_takes(arm, load, [0.0] * 3), controller_takes(arm, request)) == (possible, possible)


@pytest.mark.parametrize("name", ARMS)
def test_page_and_notebook_offer_the_ranges_and_defaults_of_the_controller(name) -> None:
    model = load_model(name)
    powered_up = Settings.of(model.description)
    bounds = {setter.name: (setter.low, setter.high) for setter in setters(model.description)}
    groups = {
        "joint_stiffness": ("joint stiffness", powered_up.joint_stiffness),
        "cartesian_stiffness": ("Cartesian stiffness", powered_up.cartesian_stiffness),
        "desired_wrench": ("wrench", powered_up.desired_wrench),
        "collision_thresholds": ("collision", powered_up.collision_thresholds),
        "filters": ("filters", (powered_up.joint_filter, powered_up.cartesian_filter, powered_up.torque_filter)),
        "report_filter": ("report filter", (powered_up.torque_report_filter,)),
    }
    assert groups.keys() == {group.name for group in parameters_of(model)}
    for group in parameters_of(model):
        setter, defaults = groups[group.name]
        assert group.defaults == defaults
        assert ([p.low for p in group.parameters], [p.high for p in group.parameters]) == bounds[setter]


@pytest.mark.parametrize("name", ARMS)
def test_the_setup_tab_offers_nothing_that_the_controller_refuses(name) -> None:
    model = load_model(name)
    bounds = {setter.name: (setter.low, setter.high) for setter in setters(model.description)}
    longest, payload = capabilities_of(model).longest_tool, model.description.rated_payload
    for part, setter in (("tool", "tool"), ("force", "force frame"), ("load", "centre of mass")):
        offered = field_range(part, "x", payload, longest)
        assert (offered.low, offered.high) == (1e3 * bounds[setter][0][0], 1e3 * bounds[setter][1][0])
    mass = field_range("load", "mass", payload, longest)
    assert ([mass.low], [mass.high]) == bounds["mass"]
    for face in FIELD_NAMES["box"][:6]:
        assert 1e3 * bounds["box"][0][3] <= field_range("box", face, payload, longest).low
        assert field_range("box", face, payload, longest).high <= 1e3 * bounds["box"][1][3]
    most = field_range("load", INERTIA_NAMES[0], payload, longest).high
    assert controller_takes(model.description, rci.SetLoad(1.0, (0.0,) * 3, (most, 0, 0, 0, most, 0, 0, 0, most)))
    assert not controller_takes(model.description, rci.SetLoad(1.0, (0.0,) * 3, tuple(1.01 * most * np.eye(3).ravel())))


def test_tool_load_and_force_frame_start_alike_at_all_ends() -> None:
    powered_up, page = Settings.of(describe_robot("xMatePro7")), SetupState().wanted
    assert page.tool is not None
    assert page.force is not None
    assert np.array_equal(page.tool.matrix, powered_up.T_flange_tool.matrix)
    assert np.array_equal(page.force.T_flange_force.matrix, powered_up.T_flange_force.matrix)
    assert page.load is powered_up.load is NO_LOAD
    default = inspect.signature(RciCommands.set_fc_coor).parameters["type"].default
    assert powered_up.force_axes.name == page.force.type.name == default.name == "WORLD"


def test_there_are_as_many_signals_at_all_ends() -> None:
    arm = describe_robot("xMatePro7")
    has = capabilities_of(load_model("xMatePro7"))
    assert len(has.outputs) == len(has.inputs) == SIGNAL_COUNT
    for signal in (0, SIGNAL_COUNT - 1, SIGNAL_COUNT):
        exists = signal < SIGNAL_COUNT
        assert controller_takes(arm, rci.SetDO(signal, True)) is exists
        assert (
            client_takes(arm, Setter("DO", lambda c, v, s=signal: c.set_do(s, True), rci.SetDO, [], [], []), [])
            is exists
        )
        if exists:
            Settings.of(arm).with_input(signal, True)
        else:
            with pytest.raises(InvalidValueError):
                Settings.of(arm).with_input(signal, True)
