"""Recorded cycles in files come back as they were."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from rcilab.core.command import CartesianPosition, JointTorque
from rcilab.core.cycle_log import save_cycles
from rcilab.core.cycle_recorder import Recorder
from rcilab.core.errors import ControlError, InvalidValueError, UsageError
from rcilab.execution.recorder import CycleLog
from tests.execution.peer import Peer


@pytest.fixture
def record():
    with Peer() as peer:
        log = CycleLog(Recorder(7, 10))
        for t, command in ((0.0, None), (0.001, CartesianPosition(np.eye(4), 0.25)), (0.002, JointTorque(np.ones(7)))):
            log.write(peer._state(), 5, t, 6, command)
    return log.recorder.rows()


def test_a_npz_holds_every_field_as_it_was(record, tmp_path):
    ControlError("x", (), record).save(tmp_path / "last.npz")
    with np.load(tmp_path / "last.npz") as back:
        assert set(back.files) == set(record.dtype.names) - {"reserved"}
        for name in back.files:
            assert np.array_equal(back[name], record[name], equal_nan=True)
        assert back["command_pose"].shape == (3, 4, 4)


def test_a_csv_has_a_column_a_number_and_loses_no_digit(record, tmp_path):
    save_cycles(record, tmp_path / "last.csv")
    with open(tmp_path / "last.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 3
    assert [float(row["q[3] [rad]"]) for row in rows] == record["q"][:, 2].tolist()
    assert [row["command_pose[1,1]"] for row in rows] == ["nan", "1.0", "nan"]
    assert [row["command_psi [rad]"] for row in rows] == ["nan", "0.25", "nan"]
    assert float(rows[2]["command_tau[7] [N m]"]) == 1.0


def test_an_unknown_ending_a_missing_folder_and_no_record_are_told(record, tmp_path):
    with pytest.raises(InvalidValueError, match=r"must end in \.csv or \.npz, .*got '.*last\.xls'"):
        save_cycles(record, tmp_path / "last.xls")
    with pytest.raises(InvalidValueError, match="cannot be written: No such file"):
        save_cycles(record, tmp_path / "nowhere" / "last.csv")
    with pytest.raises(UsageError, match="has no record"):
        ControlError("x").save(tmp_path / "last.csv")
