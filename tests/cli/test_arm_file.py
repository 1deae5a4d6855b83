"""The configuration file of an arm: everything in it, what takes precedence, and one sentence for what is wrong."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rcilab.cli import controller as command
from rcilab.cli import main
from rcilab.cli.arm_file import _SECTIONS, read_arm_file
from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.sim.api import NetworkFaults
from rcilab.sim.controller_config import ControllerConfig

FULL = """
[arm]
model = "xMatePro7"
start = "10,30,0,60,0,90,-5deg"
di = [0, 3]
[tool]
position = "0,10,120mm"
rpy = [0, 0, 0.5]
[load]
mass = 2
center_of_mass = [0, 0, 0.05]
inertia = [0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01]
[box]
size = [1.5, 1.5, 1.5]
center = [0.4, 0, 0.6]
[soft_limits]
lower = "-160,-110,-160,-110,-160,-110,-350deg"
upper = "160,110,160,110,160,110,350deg"
[controller]
host = "127.0.0.9"
port = 0
plant = "mujoco"
mode_delay = 0.2
prefill = 20
lost_limit = 0
on_loss = "bridge"
auto_limit = true
log_format = "json"
record = "runs"
no_world = true
"""


def config_of(*arguments: str, monkeypatch: pytest.MonkeyPatch) -> ControllerConfig:
    """The configuration of a command line, whose controller is not started."""
    taken: list[ControllerConfig] = []

    def build(config: ControllerConfig) -> Any:
        taken.append(config)
        raise RcilabError("not started")

    monkeypatch.setattr("rcilab.makers.virtual_controller.build_virtual_controller", build)
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["controller", *arguments])
    with pytest.raises(RcilabError, match="not started"):
        args.run(args)
    return taken[0]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my_arm.toml"
    path.write_text(FULL, encoding="utf-8")
    return path


def test_a_file_holds_the_set_up_and_the_options(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = config_of(str(file), monkeypatch=monkeypatch)
    assert config.model == "xMatePro7"
    assert config.start == pytest.approx(np.radians([10, 30, 0, 60, 0, 90, -5]))
    assert config.tool is not None
    assert config.tool.is_close(Pose.from_rpy((0.0, 0.01, 0.12), (0.0, 0.0, 0.5)))
    assert config.load is not None
    assert (config.load.mass, config.load.inertia[0, 0]) == (2.0, 0.01)
    assert config.safety_box is not None
    assert config.safety_box.size == (1.5, 1.5, 1.5)
    assert config.soft_limits is not None
    assert config.soft_limits[1] == pytest.approx(np.radians([160, 110, 160, 110, 160, 110, 350]))
    assert config.inputs == (0, 3)
    assert (config.host, config.port, config.plant, config.mode_delay) == ("127.0.0.9", 0, "mujoco", 0.2)
    assert (config.prefill, config.lost_limit, config.auto_limit) == (20, None, True)
    assert config.on_loss == "bridge"
    assert (config.log_format, config.world_port) == ("json", None)


@pytest.mark.parametrize("is_first", [True, False])
def test_the_command_line_takes_precedence_wherever_it_stands(
    file: Path, monkeypatch: pytest.MonkeyPatch, is_first: bool
) -> None:
    options = "--plant ideal --mode-delay 1 --start 0,0.5,0,1,0,1.5,0 --load 1 --di 5 --tool=-10,0,120mm".split()
    arguments = [*options, str(file)] if is_first else [str(file), *options]
    config = config_of(*arguments, monkeypatch=monkeypatch)
    assert (config.plant, config.mode_delay, config.inputs) == ("ideal", 1.0, (5,))
    assert config.start == (0.0, 0.5, 0.0, 1.0, 0.0, 1.5, 0.0)
    assert config.load is not None
    assert config.load.mass == 1.0
    assert config.tool is not None
    assert config.tool.is_close(Pose((-0.01, 0.0, 0.12)))
    assert config.prefill == 20


def test_without_any_option_there_is_no_set_up(monkeypatch: pytest.MonkeyPatch) -> None:
    config = config_of("--model", "xMate3", monkeypatch=monkeypatch)
    assert config == ControllerConfig(model="xMate3", mode_delay=1.05, states_network=NetworkFaults(), is_recorded=True)
    assert config.setup(load_model(config.model)) is None


def test_the_example_of_the_help_is_a_valid_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("\n".join(line for line in command.EPILOG.splitlines() if line.startswith("  ")), encoding="utf-8")
    config = config_of(str(path), monkeypatch=monkeypatch)
    assert (config.plant, config.inputs) == ("mujoco", (0, 3))


PAGE = Path(__file__).parents[2] / "docs" / "controller.md"
NOT_IN_A_FILE = {
    "help", "file", "exit_with_parent", "loss", "reorder", "duplicate", "corrupt", "delay", "jitter",
    "faults_on", "tcp_delay", "tcp_split", "tcp_break", "seed", "stall",
}  # fmt: skip
"""Options of one experiment, not of an arm or its controller."""


def test_the_example_of_the_documentation_is_a_valid_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(PAGE.read_text(encoding="utf-8").partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    config = config_of(str(path), monkeypatch=monkeypatch)
    assert (config.plant, config.inputs) == ("mujoco", (0, 3))


def test_every_option_of_an_arm_and_its_controller_can_be_in_the_file_and_is_documented() -> None:
    subparsers = argparse.ArgumentParser().add_subparsers()
    command.add_parser(subparsers)
    options = {action.dest for action in subparsers.choices["controller"]._actions} - NOT_IN_A_FILE
    keys = {key for section in ("arm", "controller") for key in _SECTIONS[section]} | (_SECTIONS.keys() - {"arm"})
    assert options == keys - {"controller"}
    page = PAGE.read_text(encoding="utf-8")
    assert {key for section in _SECTIONS.values() for key in section if f"`{key}`" not in page} == set()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[arm]\nmodell = 1", "my_arm.toml: [arm]: 'modell' is unknown; known: model, start, di"),
        ("[robot]\nmodel = 'xMate3'", "my_arm.toml: '[robot]' is unknown; known: arm, tool, load"),
        ("arm = 3", "my_arm.toml: [arm] needs keys and values"),
        ("[arm]\nmodel = 3", "my_arm.toml: [arm] model needs a text in quotation marks, got 3"),
        ("[arm]\nstart = [0, 'x']", "my_arm.toml: [arm] start[1] must be a finite number [rad], got 'x'"),
        ("[arm]\nstart = '0,1mm'", "my_arm.toml: [arm] start: '0,1mm' has the unit 'mm'"),
        ("[arm]\ndi = 3", "my_arm.toml: [arm] di needs a list of signal numbers, such as [0, 3], got 3"),
        ("[tool]\nposition = [0, 0]", "my_arm.toml: [tool] position needs 3 numbers [m]"),
        ("[load]\nmass = 'heavy'", "my_arm.toml: [load] mass: 'heavy' is not of the form MASS[g]"),
        ("[load]\nmass = true", "my_arm.toml: [load] mass must be a finite number [kg], got True"),
        ("[load]\nmass = '2mm'", "my_arm.toml: [load] mass: '2mm' has the unit 'mm' where kg or g is expected"),
        ("[load]\ncenter_of_mass = [0, 0, 0]", "my_arm.toml: [load] mass is missing"),
        ("[load]\nmass = -1", "my_arm.toml: [load]: load mass must be a finite number, 0 or more [kg], got -1.0"),
        ("[box]\nsize = [1, 1, 0]\ncenter = [0, 0, 0]", "my_arm.toml: [box]: safety box size must be three lengths"),
        ("[soft_limits]\nlower = [0]", "my_arm.toml: [soft_limits] upper is missing"),
        ("[controller]\nport = 'x'", "my_arm.toml: [controller] port needs a whole number"),
        ("[controller]\nlockstep = 1", "my_arm.toml: [controller] lockstep needs true or false, got 1"),
        ("[arm\n", "is not valid TOML"),
        ("a = " + "[" * 9_000, "is not valid TOML"),
        ("#" * 200_000, "has 200000 bytes; at most 10000 are expected"),
    ],
)
def test_what_is_wrong_in_a_file_is_one_sentence_with_file_and_key(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "my_arm.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidValueError) as raised:
        read_arm_file(path)
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("arguments", "changed", "expected"),
    [
        ([], ("prefill = 20", "prefill = 200"), "my_arm.toml: [controller] prefill needs 0 to 100 cycles, got 200"),
        (["--prefill", "200"], ("", ""), "--prefill needs 0 to 100 cycles, got 200"),
        ([], ("10,30,0", "10,130,0"), "my_arm.toml: [arm] start: [10.0, 130.0, "),
        (["--patience", "0.001"], ("", ""), "--patience needs 0.01 to 3600 s, or 0 without lock-step, got 0.001"),
        ([], ("lost_limit = 0", "lost_limit = 9"), "lost_limit needs 10 to 20 cycles, got 9; 0 on the command line or"),
        (
            [],
            ('record = "runs"', 'record = "/dev/null"'),
            "my_arm.toml: [controller] record: '/dev/null' is not",
        ),
        (["--record", "/dev/null"], ("", ""), "--record: '/dev/null' is not a folder; choose another"),
        (["--record", ""], ("", ""), "--record needs the name of a folder, such as recordings, got ''"),
        ([], ('record = "runs"', 'record = ""'), "my_arm.toml: [controller] record needs the name of a folder"),
        ([], ("10,30,0", "30,0"), "my_arm.toml: [arm] start: "),
        (["--start", "0,130,0,0,0,0,0deg"], ("", ""), "--start: [0.0, 130.0, "),
        (["--start", "0,30deg"], ("", ""), "--start: '0,30deg' is not of the form Q1,Q2,...[deg] with 7 joint angles"),
        ([], ("mass = 2", "mass = 9"), "my_arm.toml: [load]: mass: 9.0 kg is outside 0 to 7 kg"),
        ([], ("mass = 2", "mass = 500"), "my_arm.toml: [load]: mass: 500.0 kg is outside 0 to 7 kg"),
        (["--load", "500"], ("", ""), "--load: mass: 500.0 kg is outside 0 to 7 kg"),
        ([], ("-160,-110", "-180,-110"), "my_arm.toml: [soft_limits]: lower limit of joint 1: -3.14159265 rad is"),
        ([], ("0, 3]", "0, 9]"), "my_arm.toml: [arm] di: 9 does not exist; needs 0 to 5"),
        (["--di", "1,x"], ("", ""), "--di needs numbers of digital inputs, such as 0,3, got '1,x'"),
        (["--box", "1,1,1@0,0,3"], ("", ""), "mm below the floor of the safety box; it must be above"),
        ([], ('plant = "mujoco"', 'plant = "clay"'), "my_arm.toml: [controller] plant: 'clay' is unknown"),
    ],
)
def test_a_value_that_cannot_be_names_its_option_or_its_key(
    file: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], changed: tuple[str, str], expected: str
) -> None:
    file.write_text(FULL.replace(*changed, 1) if changed[0] else FULL, encoding="utf-8")
    assert main(["controller", str(file), *arguments]) == 2
    shown = capsys.readouterr().err
    assert expected in shown
    assert shown.count("\n") == 1


def test_a_load_that_a_franka_arm_does_not_bear_names_its_option(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["controller", "--model", "FR3", "--port", "0", "--load", "9"]) == 2
    assert capsys.readouterr().err == "rcilab: --load: mass: 9.0 kg is above 3 kg, the rated payload\n"


@pytest.mark.parametrize("model", ["FR3", "RM65"])
@pytest.mark.parametrize(
    "option",
    ["--on-loss hold", "--auto-limit", "--force-sign by-arm", "--force-sign on-arm", "--mode-delay 0.2"],
    ids=lambda text: text.replace(" ", "="),
)
def test_an_option_that_the_controller_of_an_arm_has_not_is_refused(
    capsys: pytest.CaptureFixture[str], model: str, option: str
) -> None:
    assert main(["controller", "--model", model, "--port", "0", *option.split()]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith(f"rcilab: {option.split()[0]}: ")
    assert shown.endswith(f" cannot be set: the controller of {model} has no such option\n")


@pytest.mark.parametrize(
    "arguments", [["--box", "1,1,1@0,0,3"], ["--soft-limits=-60:60,-10:10,-60:60,-60:60,-60:60,-60:60,-60:60deg"]]
)
def test_an_arm_that_cannot_stand_in_its_home_pose_is_refused_and_a_start_that_was_not_given_is_not_mentioned(
    capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    assert main(["controller", "--model", "xMatePro7", "--port", "0", *arguments]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("rcilab: the arm: [0.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0] deg: ")
    assert shown.endswith("; that is its home pose, choose another with --start\n")


def test_a_mass_may_have_a_unit_and_the_folder_of_recordings_a_place_in_the_file(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text(FULL.replace("mass = 2", 'mass = "2000g"'), encoding="utf-8")
    config = config_of(str(file), monkeypatch=monkeypatch)
    assert config.load is not None
    assert config.load.mass == 2.0
    assert read_arm_file(file).options["record"] == "runs"
    assert config.is_recorded


def test_a_controller_without_an_arm_explains_how_to_name_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["controller"]) == 2
    assert "add --model NAME" in capsys.readouterr().err
    assert main(["controller", str(tmp_path / "none.toml")]) == 2
    assert "none.toml' does not exist" in capsys.readouterr().err
