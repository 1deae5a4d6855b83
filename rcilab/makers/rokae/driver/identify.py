"""Identifies the arm by the Denavit-Hartenberg table that the controller serves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

from rcilab.core.errors import ModelError
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.robots import DhRow, describe_robot

Lengths: TypeAlias = Sequence[Sequence[float]]
"""a and d of every joint, [m]."""

_LENGTH_TOLERANCE = 5e-5  # [m] The manual prints lengths to 0.1 mm.
_CALIBRATION = 5e-3  # [m] Largest difference of a calibrated arm from its manual; two arms differ by 15 mm at least.
_COLUMNS = 4


def identify_robot(dh: Sequence[float]) -> str:
    """Returns the name of the robot with these lengths.

    Args:
        dh: 28 numbers: 7 rows of a [mm], alpha [rad], d [mm], theta [rad]; a 6-axis arm leaves the last row at zero.

    Raises:
        ModelError: No known robot has them; the message says how to name one.
    """
    served = _served_lengths(dh)
    name = _find_name(served)
    if name is None:
        raise ModelError(
            f"the robot is not one of those known ({', '.join(ROBOTS)}): its DH lengths d are {_in_mm(served)} "
            "mm; say which model to use: connect(address, model=load_model(NAME))"
        )
    return name


def require_same_arm(dh: Sequence[float], name: str, lengths: Lengths, address: str) -> None:
    """Checks that the controller has the arm that motions are planned for.

    A controller that serves zeros is accepted. An arm that rcilab does not know must have the given lengths, up to a
    calibration.

    Args:
        dh: The controller's table, see `identify_robot`.
        name: Name of the given model.
        lengths: Its lengths, see `dh_lengths`.
        address: Address of the controller, for the message.

    Raises:
        ModelError: It is another arm; the message names both.
    """
    served = _served_lengths(dh)
    if not any(a or d for a, d in served):
        return
    found = _find_name(served)
    if found == name or (found is None and _agree(served, lengths, _CALIBRATION)):
        return
    axes = len(served) if any(served[-1]) else len(served) - 1
    if found is None:
        raise ModelError(
            f"the controller at {address} moves an arm of {axes} axes with the DH lengths d {_in_mm(served)} mm, you "
            f"gave {name} ({len(lengths)} axes, {_in_mm(lengths)} mm); load the model of the arm that is there"
        ).coded("unknown_arm", address=address, count=axes, ours=name)
    raise ModelError(
        f"the controller at {address} is an {found} ({axes} axes), you gave {name} ({len(lengths)}); "
        f"leave model out, or load_model({found!r})"
    ).coded("other_arm", address=address, theirs=found, ours=name)


def dh_lengths(dh: Sequence[DhRow]) -> list[tuple[float, float]]:
    """Returns a and d of every row, [m]."""
    return [(row.a, row.d) for row in dh]


def _served_lengths(dh: Sequence[float]) -> list[tuple[float, float]]:
    return [(dh[i] / 1000.0, dh[i + 2] / 1000.0) for i in range(0, len(dh), _COLUMNS)]


def _find_name(served: Lengths) -> str | None:
    names = (name for name in ROBOTS if _agree(served, dh_lengths(describe_robot(name).dh), _LENGTH_TOLERANCE))
    return next(names, None)


def _agree(served: Lengths, known: Lengths, tolerance: float) -> bool:
    whole = [*known, *[(0.0, 0.0)] * (len(served) - len(known))]
    pairs = zip(served, whole, strict=True)
    return all(abs(a - b) < tolerance and abs(d - e) < tolerance for (a, d), (b, e) in pairs)


def _in_mm(lengths: Lengths) -> str:
    return ", ".join(f"{d * 1000.0:g}" for _, d in lengths)
