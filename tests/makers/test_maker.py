"""The registry: what every maker brings, and that it is found by its folder."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import rcilab
from rcilab.core.errors import ModelError
from rcilab.core.fault import FaultCode
from rcilab.makers.maker import (
    Maker,
    all_makers,
    driven_robots,
    find_scheme,
    maker_of,
    require_driver,
    require_simulator,
    simulated_robots,
)
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES, describe_robot

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
        assert description.conditions() is maker.conditions()
        assert maker_of(load_model(name)) is maker


@MAKERS
def test_every_row_of_a_maker_raises_one_of_its_own_faults_or_none(maker: Maker):
    assert issubclass(maker.faults(), FaultCode)
    assert {type(row.fault) for row in maker.conditions().conditions} <= {maker.faults(), type(None)}
    assert all(fault.manual_name and fault.cause for fault in maker.faults())


def test_an_address_leads_to_the_maker_of_its_scheme():
    assert [find_scheme(scheme).name for scheme in ("rci", "RCI", "fci")] == ["rokae", "rokae", "franka"]
    assert find_scheme("http") is None


def test_what_cannot_be_simulated_or_driven_is_refused_by_the_capabilities():
    arms = ("xMatePro3", "xMatePro7", "xMate3", "xMate7")
    assert (simulated_robots(), driven_robots()) == (arms, arms)
    model = load_model("xmate3")
    assert require_driver(require_simulator(model)) is model
    for refuse in (require_driver, require_simulator):
        with pytest.raises(ModelError, match=r"Panda is driven by Franka's own interface.*drive one of xMatePro3"):
            refuse(load_model("Panda"))


@pytest.mark.parametrize("folder", ["conformance", "robots"])
def test_neither_the_engine_nor_the_robot_format_names_a_maker(folder: str):
    words = {
        word for maker in all_makers() for word in (maker.name, maker.title.lower(), maker.conditions().name.lower())
    }
    for path in (Path(rcilab.__file__).parent / folder).rglob("*.py"):
        assert not words & set(re.findall(r"[a-z]+", path.read_text(encoding="utf-8").lower())), path


def test_loading_a_model_by_name_loads_neither_wire_nor_engine():
    unwanted = ["rcilab.makers.rokae.wire", "rcilab.makers.rokae.controller", "rcilab.conformance.check", "ruckig"]
    code = f"import sys, rcilab; rcilab.load_model('xmate3'); print(*[n for n in {unwanted} if n in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.split() == []
