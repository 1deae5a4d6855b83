"""Every fault of the fault lab is one that a controller really reports, with numbers that are the controller's own."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from unittest.mock import MagicMock

import numpy as np
import pytest

from rcilab.app import fault_lab
from rcilab.app.fault_lab.fault_demo import script
from rcilab.app.learn.learn_actions import build_display
from rcilab.core.errors import CommandRejectedError, InvalidValueError, ManualRecoveryError, ModelError, UsageError
from rcilab.core.fault import FaultCode, find_fault
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.maker import maker_of
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model

NO_LIBRARY = pytest.mark.skipif(sys.version_info >= (3, 13), reason="pylibfranka has no wheel for this Python")
MODEL = load_model("xMatePro7")
FAULTS = fault_lab.FaultTable(MODEL)
BY_POSE = sorted(Fault, key=lambda fault: (tuple(FAULTS[fault].start(MODEL)), fault))
"""So that the arm need not travel between any two."""


@pytest.fixture(scope="module")
def booth() -> Iterator[fault_lab.FaultLab]:
    with fault_lab.FaultLab("xMatePro7") as found:
        yield found


@pytest.mark.parametrize("fault", BY_POSE, ids=lambda fault: fault.name)
def test_the_controller_reports_it_and_the_record_shows_why(booth: fault_lab.FaultLab, fault: Fault) -> None:
    demo = booth.provoke(fault)
    assert demo.reported == (fault,)
    assert demo.cycles["faults"][-1] == 1 << fault
    assert not demo.cycles["faults"][:-1].any()
    assert demo.condition.fault is fault
    assert demo.signal.is_broken
    inside = demo.signal.values[:-1]
    lower, upper = demo.signal.lower[:-1], demo.signal.upper[:-1]
    assert ((lower < inside) & (inside < upper)).all(), "the first one past its bound"
    if fault is not Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME:
        numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", demo.sentence)]
        assert np.isclose(numbers, demo.value, rtol=5e-3).any(), "the controller's own number"  # It rounds to 3 digits.
    assert demo.way_out[-1] == "move"
    assert np.isfinite(demo.moved.q).all()


@pytest.mark.parametrize("arm", ["Panda", pytest.param("FR3", marks=NO_LIBRARY)])
def test_the_errors_of_franka_come_one_at_a_time_with_their_reason_and_the_arm_moves_again(arm: str) -> None:
    with fault_lab.FaultLab(arm) as lab:
        for fault in lab.faults:
            demo = lab.provoke(fault)
            is_of_tool = 17 <= fault <= 20  # Those of the joints that the pose needs come with it.
            assert fault in demo.reported if is_of_tool else demo.reported == (fault,)
            assert demo.condition.fault is fault
            lower, upper, inside = demo.signal.lower[:-1], demo.signal.upper[:-1], demo.signal.values[:-1]
            known = np.isfinite(inside)  # Not where the client missed states.
            assert ((lower < inside) & (inside < upper))[known].all(), fault
            assert fault.manual_name in demo.explain("en")
            assert demo.describe("sent", "en") != demo.describe("sent", "zh")
            assert demo.way_out[-2:] == ("recover", "move")
            shown = build_display(demo, None)
            assert shown.recording.mode == shown.displayed.run.setup.mode == demo.scenario.mode


@NO_LIBRARY
def test_the_bound_of_an_fr3_decreases_towards_the_end_of_a_range() -> None:
    with fault_lab.FaultLab("FR3") as lab:
        demo = lab.provoke("joint_motion_generator_velocity_limits_violation")
    signal = demo.signal
    assert "Joint 7" in demo.describe("sent")  # On a Panda, it is joint 1.
    assert signal.axis == 7
    assert (np.diff(signal.upper[-100:]) < 0.0).all()
    assert signal.bound < 0.1  # In the middle of the range it is 5.26 rad/s.


def test_every_fault_is_in_the_table_once() -> None:
    assert sorted(FAULTS) == list(Fault)
    assert sum(len(FAULTS.group(group)) for group in FAULTS.groups) == len(Fault)
    assert str(FAULTS).count(" k") == len(Fault)
    sent, measured = FAULTS.group("position")[:2]
    assert sent.fault.name.removeprefix("COMMAND_") == measured.fault.name.removeprefix("ACTUAL_")


@pytest.mark.parametrize("kind", [Fault, FrankaError])
def test_a_fault_is_found_by_any_of_its_names(kind: type[FaultCode]) -> None:
    assert all(find_fault(kind, fault.manual_name) is find_fault(kind, fault.name) is fault for fault in kind)
    with pytest.raises(InvalidValueError, match=list(kind)[-1].manual_name):
        find_fault(kind, "kJam")


def test_an_arm_without_a_virtual_controller_has_no_fault_lab(only_planned: str) -> None:
    with pytest.raises(ModelError, match="simulate"):
        fault_lab.FaultLab(only_planned)


def test_groups_without_a_scenario_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    maker = maker_of(MODEL)
    scenarios = tuple(scenario for scenario in maker.scenarios(MODEL) if scenario.group == "velocity")
    monkeypatch.setattr(type(maker), "scenarios", lambda self, model: scenarios)
    assert fault_lab.FaultTable(MODEL).groups == ("velocity",)


def test_an_arm_without_an_elbow_has_no_fault_of_it() -> None:
    with fault_lab.FaultLab("xMate7") as booth, pytest.raises(UsageError, match="7 axes"):
        booth.provoke(Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION)


def test_only_an_arm_that_is_too_far_outside_is_widened_and_any_other_refusal_is_an_error() -> None:
    booth, robot = fault_lab.FaultLab("xMate3"), MagicMock()
    robot.recover.side_effect = ManualRecoveryError("recover", "manual recovery needed")
    assert booth._recover(robot) == ["refused", "power_off", "widen", "power_on"]
    robot.recover.side_effect = CommandRejectedError("recover", "reflex")
    with pytest.raises(CommandRejectedError, match="reflex"):
        booth._recover(robot)


def test_an_arm_is_sent_only_the_parts_that_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    maker, robot = maker_of(MODEL), MagicMock()
    monkeypatch.setattr(type(maker), "capabilities", replace(maker.capabilities, setup=("joints",)))
    fault_lab.FaultLab(MODEL)._widen(robot)
    assert robot.configure.call_args.args[0].parts == ("joints",)


def test_who_wants_it_no_more_ends_it(booth: fault_lab.FaultLab) -> None:
    def tell(share: float) -> None:
        if share >= 0.5:
            raise TimeoutError

    with pytest.raises(TimeoutError):
        booth.provoke(Fault.COLLISION, tell)


def test_its_script_runs(capsys: pytest.CaptureFixture[str]) -> None:
    code = script(Fault.COMMAND_TORQUE_DISCONTINUITY, "xMate3")
    assert len(code.splitlines()) <= 5
    exec(compile(code, "script", "exec"), {})
    assert capsys.readouterr().out.startswith("kCommandTorqueDiscontinuity: ")
