"""Every fault of the gallery is one that a controller really reports, with numbers that are the controller's own."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest

from rcilab.app import fault_lab
from rcilab.app.fault_lab.catalogue import load_catalogue
from rcilab.app.fault_lab.fault_demo import script
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.i18n.locale import LANGUAGES
from rcilab.makers.rokae.faults import Fault, find_fault
from tests.catalogues import require_equal

BY_POSE = sorted(Fault, key=lambda fault: (fault_lab.FAULTS[fault].pose or (), fault))
"""So that the arm need not travel between any two."""


@pytest.fixture(scope="module")
def booth() -> Iterator[fault_lab.FaultLab]:
    with fault_lab.FaultLab() as found:
        yield found


@pytest.mark.parametrize("fault", BY_POSE, ids=lambda fault: fault.name)
def test_the_controller_reports_it_and_the_record_shows_why(booth: fault_lab.FaultLab, fault: Fault) -> None:
    exhibit = booth.provoke(fault)
    assert exhibit.reported == (fault,)
    assert exhibit.cycles["faults"][-1] == 1 << fault
    assert not exhibit.cycles["faults"][:-1].any()
    assert exhibit.condition.fault is fault
    assert exhibit.signal.is_broken
    inside = exhibit.signal.values[:-1]
    assert ((exhibit.signal.lower < inside) & (inside < exhibit.signal.upper)).all(), "the first one past its bound"
    if fault is not Fault.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME:
        numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", exhibit.said)]
        assert np.isclose(numbers, exhibit.value, rtol=5e-3).any(), (
            "the controller's own number"
        )  # It rounds to 3 digits.
    assert exhibit.way_out[-1] == "move"
    assert np.isfinite(exhibit.moved.q).all()


def test_every_fault_hangs_in_the_gallery_once() -> None:
    assert list(fault_lab.FAULTS) == list(Fault)
    assert sum(len(fault_lab.FAULTS.group(group)) for group in fault_lab.GROUPS) == len(Fault)
    assert str(fault_lab.FAULTS).count(" k") == len(Fault)


def test_it_speaks_both_languages() -> None:
    require_equal(load_catalogue, LANGUAGES)


def test_a_fault_is_found_by_any_of_its_names() -> None:
    assert all(find_fault(fault.manual_name) is find_fault(fault.name) is fault for fault in Fault)
    with pytest.raises(InvalidValueError, match="kCollision"):
        find_fault("kJam")


def test_an_arm_without_an_elbow_has_no_fault_of_it() -> None:
    with fault_lab.FaultLab("xMate7") as booth, pytest.raises(UsageError, match="7 axes"):
        booth.provoke(Fault.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION)


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
