"""The play-out of a client's commands, from rows with `PLAYOUT_FIELDS`: which command was played in which cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import JointPath
from rcilab.core.clock import CYCLE_TIME


def playout_delay(cycles: NDArray[np.void]) -> int:
    """Returns the usual number of cycles between a state and the one in which its command was played, at least 1.

    Args:
        cycles: Rows with `PLAYOUT_FIELDS`, shape (N,).
    """
    rows, sources = played_commands(cycles)
    return max(int(np.median(rows - sources)), 1) if rows.size else 1


def played_span(cycles: NDArray[np.void]) -> float:
    """Returns the time from the first played command to the last one, [s].

    Args:
        cycles: Rows with `PLAYOUT_FIELDS`, shape (N,).
    """
    played = np.flatnonzero(cycles["played"])
    return CYCLE_TIME * int(played[-1] - played[0]) if played.size else 0.0


def played_duration(cycles: NDArray[np.void]) -> float:
    """Returns the time from the first played command to the last one, or to the stop for a fault, [s].

    Args:
        cycles: Rows with `PLAYOUT_FIELDS`, shape (N,).
    """
    faulty = np.flatnonzero(cycles["faults"])[:1]
    ends = np.flatnonzero(cycles["missed"][: faulty[0] + 1])[-1:] if faulty.size else faulty
    played = np.flatnonzero(cycles["played"])
    return CYCLE_TIME * int(max([played[-1], *ends]) - played[0]) if played.size else 0.0


def played_joints(cycles: NDArray[np.void]) -> JointPath:
    """Returns the joint angles of the played commands, from the first one to the last row, shape (M, n), [rad].

    In cycles without a command or with a refused one, in those of the controller's own stop, and where poses or torques
    were commanded, they are those that the controller reports as commanded.

    Args:
        cycles: Rows with `PLAYOUT_FIELDS`, shape (N,).
    """
    rows, sources = played_commands(cycles)
    if not rows.size:
        return cycles["q_c"][:1].copy()
    q = cycles["q_c"].copy()
    sent = cycles["command"][sources]
    has_angles = np.isfinite(sent).all(axis=1) & (cycles["faults"][rows] == 0)
    q[rows[has_angles]] = sent[has_angles]
    return q[rows[0] :]


def played_commands(cycles: NDArray[np.void]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns the rows in which a command was played, and the rows with those commands: of the states they answer.

    Args:
        cycles: Rows with `PLAYOUT_FIELDS`, shape (N,).
    """
    rows = np.flatnonzero(cycles["played"])
    sources = rows - cycles["age"][rows].astype(np.intp)
    is_known = (sources >= 0) & (sources <= rows)
    return rows[is_known], sources[is_known]
