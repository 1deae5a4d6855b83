"""Things happen to a virtual robot from the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rcilab.cli import main
from rcilab.control_process.launch import start_controller


@pytest.fixture(scope="module")
def address():
    controller = start_controller("xMatePro7", lockstep=True, plant="mujoco")
    assert controller.world_address is not None
    yield controller.world_address
    controller.end()


def test_a_box_is_placed_the_arm_is_pushed_and_the_status_is_printed(address, capsys):
    for words in (
        ["place_box", "box=wall", "size=[0.1,1,1]", "position=[0.9,0,0.5]"],
        ["push", "wrench=[0,0,-20,0,0,0]", "link=4", "duration=0.1"],
        ["press", "button=estop"],
    ):
        assert main(["world", address, *words]) == 0
        assert capsys.readouterr().out == "done\n"
    assert main(["world", address, "status"]) == 0
    assert json.loads(capsys.readouterr().out)["button"] == "estop"
    assert main(["world", address, "press", "button=none"]) == 0


def test_the_arm_is_placed_at_angles_with_a_unit(address, capsys):
    assert main(["world", address, "place_arm", "q=0,30,0,60,0,90,-20deg"]) == 0
    assert main(["world", address, "set_tool", "position=[0,0,0.1]"]) == 0
    assert main(["world", address, "set_tool", "position=0,0,120mm"]) == 0
    assert main(["world", address, "set_load", "mass=2000g", "center_of_mass=0,0,50mm"]) == 0
    capsys.readouterr()
    assert main(["world", address, "status"]) == 0
    assert json.loads(capsys.readouterr().out)["q"] == pytest.approx(np.radians([0, 30, 0, 60, 0, 90, -20]))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["explode"], "unknown request 'explode'; known: push"),
        (["push"], "push needs wrench"),
        (["press", "button=red"], "button: 'red' is unknown"),
        (["press", "estop"], "needs FIELD=VALUE"),
        (["press", "button=" + "[" * 10_000], "button"),
        (["remove_box", "box=chair"], "chair"),
        (["place_arm", "q=0,130,0,60,0,90,0deg"], "joint 2 at 130 deg is outside its range of -120 to 120 deg"),
        (["place_arm", "q=[0,1]"], "has shape (2,), needs (7,)"),
        (["place_arm", "q=none"], "q: 'none' is not of the form"),
        (["set_tool", "position=0,0,120kg"], "position: '0,0,120kg' has the unit 'kg' where m or mm is expected"),
        (["set_load", "mass=heavy"], "mass: 'heavy' is not of the form MASS[g]"),
    ],
)
def test_what_cannot_happen_is_refused_in_one_sentence(address, capsys, words, said):
    assert main(["world", address, *words]) == 2
    shown = capsys.readouterr().err
    assert said in shown
    assert shown.count("\n") == 1


def test_the_address_of_the_arm_is_not_that_of_its_simulation_port(capsys):
    for command in (["world", "rci://127.0.0.2:1337", "status"], ["watch", "rci://127.0.0.2:1337"]):
        assert main(command) == 2
        shown = capsys.readouterr().err
        assert "use the simulation port, which the controller prints after 'world', such as 127.0.0.2:40123" in shown
        assert shown.count("\n") == 1


@pytest.mark.parametrize("address", ["", "here", "127.0.0.2", "127.0.0.2:x", "127.0.0.2:0", ":1"])
def test_an_address_that_is_none_is_refused(capsys, address):
    assert main(["world", address, "status"]) == 2
    assert "needs HOST:PORT" in capsys.readouterr().err
