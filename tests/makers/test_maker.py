"""The registry: what every maker brings, and that it is found by its folder."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

import rcilab
from rcilab.app.arm_features import explain_missing_feature
from rcilab.app.text import Text
from rcilab.control_process.supervisor import Supervisor
from rcilab.core.errors import InvalidValueError, ModelError
from rcilab.core.fault import FaultCode
from rcilab.makers.driver import parse_address
from rcilab.makers.maker import (
    Feature,
    Maker,
    all_makers,
    find_maker,
    find_missing_feature,
    maker_of,
    require_driver,
    require_feature,
    require_simulator,
    simulated_robots,
)
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES, describe_robot
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

FEATURES = [name for part in get_args(Feature) for name in (get_args(part) or (part,))]
MAKERS = pytest.mark.parametrize("maker", all_makers(), ids=lambda maker: maker.name)


def test_every_folder_with_robots_is_a_maker():
    folders = {path.parent.name for path in Path(rcilab.__file__).parent.glob("makers/*/robots")}
    assert {maker.name for maker in all_makers()} == folders
    assert {name for maker in all_makers() for name in maker.robots} == set(ROBOT_NAMES)
    assert len({maker.scheme for maker in all_makers()}) == len(all_makers())


@MAKERS
def test_the_descriptions_of_a_maker_name_it_and_have_its_faults_and_conditions(maker: Maker):
    for name in maker.robots:
        description = describe_robot(name)
        assert (description.name, description.maker, description.faults) == (name, maker.name, maker.faults())
        assert description.conditions is not None
        own, common = description.conditions(), maker.conditions()
        assert (own.name, [row.id for row in own.conditions]) == (common.name, [row.id for row in common.conditions])
        assert maker_of(load_model(name)) is maker


@MAKERS
def test_every_row_of_a_maker_raises_one_of_its_own_faults_or_none(maker: Maker):
    assert issubclass(maker.faults(), FaultCode)
    assert {type(row.fault) for row in maker.conditions().conditions} <= {maker.faults(), type(None)}
    assert all(fault.manual_name and fault.cause for fault in maker.faults())


@pytest.mark.parametrize(
    ("address", "model", "normal"),
    [
        ("fci://10.0.0.1", None, "fci://10.0.0.1:1337"),
        (" RCI://10.0.0.1:1 ", None, "rci://10.0.0.1:1"),
        ("10.0.0.1", "Panda", "fci://10.0.0.1:1337"),
        ("10.0.0.1", "xMate3", "rci://10.0.0.1:1337"),
    ],
)
def test_an_address_leads_to_the_maker_of_its_scheme_or_of_the_model(address, model, normal):
    assert str(parse_address(address, None if model is None else load_model(model))) == normal


@pytest.mark.parametrize(
    ("address", "model", "problem"),
    [
        (
            "http://robot",
            None,
            r"begins with http://, needs fci:// \(Franka\), .*rci:// \(ROKAE\), xarm:// \(UFACTORY\)",
        ),
        ("rci://robot", "Panda", r"begins with rci://, needs fci:// \(Franka\)$"),
        ("robot", None, r"has no scheme, needs fci:// \(Franka\), "),
    ],
)
def test_an_address_of_no_maker_or_of_another_one_names_the_schemes(address, model, problem):
    with pytest.raises(InvalidValueError, match=problem):
        parse_address(address, None if model is None else load_model(model))


@MAKERS
def test_what_cannot_be_simulated_or_driven_is_refused_by_the_capabilities(maker: Maker):
    has = maker.capabilities
    for name in maker.robots:
        model = load_model(name)
        assert (name in simulated_robots()) == has.simulates
        for require, possible in ((require_simulator, has.simulates), (require_driver, has.simulates or has.drives)):
            if possible:
                assert require(model) is model
            else:
                with pytest.raises(ModelError, match=name):
                    require(model)


@MAKERS
def test_every_feature_is_there_or_lacks_with_a_reason_in_both_languages(maker: Maker):
    has = maker.capabilities
    there = {*has.modes, *has.setup}
    there |= {"simulation"} if has.simulates else set()
    there |= {"driving"} if has.drives else set()
    there |= {"streaming"} if has.streams else set()
    there |= {"guiding"} if has.guides else set()
    there |= {"signals"} if has.outputs else set()
    there |= {"reboot"} if has.reboots else set()
    model = load_model(next(iter(maker.robots)))
    assert {feature for feature in FEATURES if find_missing_feature(model, feature) is None} == there
    for feature in set(FEATURES) - there:
        said = explain_missing_feature(model, feature)
        assert said is not None
        assert model.name in Text("zh").render(said)
        assert Text("en").render(said) != Text("zh").render(said)


def test_an_arm_that_is_only_planned_says_what_can_be_done_with_it(only_planned):
    model, problem = load_model(only_planned), "Panda is driven by Franka's own interface.*drive one of .*xMatePro3"
    for refuse in (
        require_driver,
        require_simulator,
        rcilab.simulate,
        Supervisor,
        lambda arm: rcilab.connect("rci://127.0.0.1:9", model=arm),
        lambda arm: build_virtual_controller(ControllerConfig(model=arm.name)),
    ):
        with pytest.raises(ModelError, match=problem):
            refuse(model)


def test_a_controller_without_a_feature_is_named_with_it(monkeypatch: pytest.MonkeyPatch):
    maker = maker_of(load_model("xMate3"))
    assert maker is not None
    lacking = replace(maker.capabilities, guides=False, modes=("joint_position",), outputs=(), inputs=(), streams=False)
    monkeypatch.setattr(type(maker), "capabilities", lacking)
    model = load_model("xMate3")
    names: dict[Feature, str] = {
        "guiding": "hand guiding",
        "torque": "torque mode",
        "signals": "digital signals",
        "streaming": "commands in every cycle",
    }
    for feature, name in names.items():
        with pytest.raises(ModelError, match=f"the controller of xMate3 has no {name}"):
            require_feature(model, feature)
        said = explain_missing_feature(model, feature)
        assert said is not None
        assert name in Text("en").render(said)
    assert require_feature(model, "joint_position") is model
    for has, error in (({"drives": False}, "no driver"), ({"simulates": False}, "no virtual controller")):
        monkeypatch.setattr(type(maker), "capabilities", replace(lacking, **has))
        with pytest.raises(ModelError, match=error):
            require_feature(model, "driving" if "drives" in has else "simulation")
        assert require_driver(model) is model


@pytest.mark.parametrize("folder", ["conformance", "robots"])
def test_neither_the_engine_nor_the_robot_format_names_a_maker(folder: str):
    words = {
        word for maker in all_makers() for word in (maker.name, maker.title.lower(), maker.conditions().name.lower())
    }
    for path in (Path(rcilab.__file__).parent / folder).rglob("*.py"):
        assert not words & set(re.findall(r"[a-z]+", path.read_text(encoding="utf-8").lower())), path


def test_loading_a_model_by_name_loads_neither_wire_nor_engine_nor_client_library():
    unwanted = ["rcilab.makers.rokae.wire", "rcilab.makers.rokae.controller", "rcilab.conformance.check", "ruckig"]
    unwanted += ["pylibfranka", "panda_py", "rcilab.makers.franka.driver"]
    code = f"import sys, rcilab; rcilab.load_model('xmate3'); print(*[n for n in {unwanted} if n in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.split() == []


@pytest.mark.parametrize(
    "maker", [maker for maker in all_makers() if maker.capabilities.simulates], ids=lambda maker: maker.name
)
def test_a_maker_is_patient_if_its_virtual_controller_is(maker: Maker):
    name = next(iter(maker.robots))
    if not maker.capabilities.simulates:
        pytest.skip("it has no virtual controller")
    config = ControllerConfig(model=name, port=0, world_port=None)
    model = load_model(name)
    server = maker.build_server(VirtualArm(model, build_plant("ideal", model)), config)
    assert maker.timing.is_patient == (server.patience > 0.0)
    assert find_maker(name) is maker
