"""Golden logs: one short run a mode, written by `python -m tests.peers.golden`, compared by test_golden_logs.

A log holds, for every fifth cycle of a motion, what the state says, one array a field. Runs are in lock-step, on the
ideal plant, where nothing depends on the machine but the last digits. Write them anew when a change of behaviour is
meant, look at what changed (the command prints it), and say why in the commit.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.peers import programs, wire
from tests.peers.arena import arena

FOLDER = Path(__file__).parents[1] / "makers" / "rokae" / "controller" / "golden"
SECONDS, PERIOD = 0.625, 1.25  # [s] Half a swing, from rest to rest.
STRIDE = 5  # [cycles]
FIELDS = ("q", "q_c", "psi_m", "vel_c", "tau_m", "tau_c", "tau_ext_in_base")
UNITS = {"tau_m": 10.0, "tau_c": 10.0, "tau_ext_in_base": 10.0}
"""How large a value of a field is, roughly; what a difference is held against."""

RUNS: dict[str, tuple[int, Callable[..., Any]]] = {
    "joint_position": (wire.JOINT_POSITION, programs.joint_sine),
    "cartesian_position": (wire.CARTESIAN_POSITION, programs.circle),
    "joint_impedance": (wire.JOINT_IMPEDANCE, programs.joint_impedance),
    "cartesian_impedance": (wire.CARTESIAN_IMPEDANCE, programs.cartesian_impedance),
    "torque": (wire.TORQUE, programs.torque),
}


def record(name: str) -> dict[str, NDArray[np.float64]]:
    """Runs one mode and returns its log."""
    mode, program = RUNS[name]
    with arena() as place, place.connect(answers_once=True) as robot:
        programs.prepare(robot, factor=1.0)
        robot.states.clear()
        program(robot, SECONDS, period=PERIOD)
        robot.receive_fresh_state()
        moving = {state.message_id: state for state in robot.states if state.controller_mode == mode}
    numbers = sorted(moving)
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "states are missing"
    rows = [moving[number] for number in numbers][::STRIDE]
    return {field: np.array([getattr(state, field) for state in rows]) for field in FIELDS}


def load(name: str) -> dict[str, NDArray[np.float64]]:
    """Returns a golden log."""
    with np.load(FOLDER / f"{name}.npz") as file:
        return {field: file[field] for field in FIELDS}


def difference(found: dict[str, NDArray[np.float64]], golden: dict[str, NDArray[np.float64]]) -> dict[str, float]:
    """Returns the largest difference of each field, as a share of what is large for it."""
    lengths = {len(found["q"]), len(golden["q"])}
    assert len(lengths) == 1, f"the runs have {lengths} rows"
    return {field: float(np.abs(found[field] - golden[field]).max()) / UNITS.get(field, 1.0) for field in FIELDS}


if __name__ == "__main__":
    for run in RUNS:
        log = record(run)
        if (FOLDER / f"{run}.npz").exists():
            print(run, {field: f"{value:.2g}" for field, value in difference(log, load(run)).items() if value > 0.0})
        np.savez_compressed(FOLDER / f"{run}.npz", **log)  # type: ignore[arg-type]
        print(run, len(log["q"]), "rows", (FOLDER / f"{run}.npz").stat().st_size, "bytes")
