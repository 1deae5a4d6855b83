"""Which arm is at the other end: told from the Denavit-Hartenberg table that the controller serves."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.errors import ModelError
from rcilab.robots import ROBOT_NAMES, describe_robot

_LENGTH_TOLERANCE = 5e-5  # [m] The manual prints lengths to 0.1 mm.
_COLUMNS = 4


def identify_robot(dh: Sequence[float]) -> str:
    """Returns the name of the robot with these lengths.

    Args:
        dh: 28 numbers: 7 rows of a [mm], alpha [rad], d [mm], theta [rad]; a 6-axis arm leaves the last row at zero.

    Raises:
        ModelError: No robot of ours has them; the message says how to name one.
    """
    rows = [tuple(dh[i : i + _COLUMNS]) for i in range(0, len(dh), _COLUMNS)]
    for name in ROBOT_NAMES:
        known = [(row.a, row.d) for row in describe_robot(name).dh]
        known += [(0.0, 0.0)] * (len(rows) - len(known))
        if all(
            abs(row[0] / 1000.0 - a) < _LENGTH_TOLERANCE and abs(row[2] / 1000.0 - d) < _LENGTH_TOLERANCE
            for row, (a, d) in zip(rows, known, strict=True)
        ):
            return name
    lengths = ", ".join(f"{row[2]:g}" for row in rows)
    raise ModelError(
        f"the robot is none of those known ({', '.join(ROBOT_NAMES)}): its DH lengths d are {lengths} mm; "
        "say which model to use: connect(address, model=load_model(NAME))"
    )
