"""The steps that can be added to a program besides waypoints from the arm or the target."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.cell.entries import SignalKind
from rcilab.core.spatial import Pose
from rcilab.motion.waypoint import Waypoint

_RADIUS = 0.05  # [m] Of a new circle.
_OFFSET = 0.05  # [m] Of a new retreat.
_TURN = math.radians(20.0)  # Of a new elbow move.


def new_steps(kind: str, T: Pose, psi: float | None, cell: Cell | None) -> tuple[Waypoint, ...]:
    """Returns the steps of a kind; a block has its begin and its end.

    Args:
        kind: A type of waypoint, or "open" or "close" for the tool; an unknown kind has no steps.
        T: Pose of the tool before it, in base.
        psi: Arm angle there, [rad]; None without one.
        cell: The cell, for the names of signals.
    """
    made: dict[str, Callable[[], tuple[Waypoint, ...]]] = {
        "wait": lambda: (Waypoint.wait(1.0),),
        "input": lambda: (Waypoint.await_input(_first_signal(cell, "input")),),
        "output": lambda: (Waypoint.set_output(_first_signal(cell, "output")),),
        "close": lambda: (Waypoint.use_tool("close"),),
        "open": lambda: (Waypoint.use_tool("open"),),
        "repeat": lambda: (Waypoint.repeat(2), Waypoint.end()),
        "group": lambda: (Waypoint.group(""), Waypoint.end()),
        "comment": lambda: (Waypoint.comment(""),),
        "retreat": lambda: (Waypoint.retreat(_OFFSET),),
        "circle": lambda: (_circle(T),),
        "nullspace": lambda: () if psi is None else (Waypoint.nullspace(math.remainder(psi + _TURN, math.tau)),),
    }
    return made[kind]() if kind in made else ()


NEW_STEPS = (
    "retreat", "circle", "nullspace", "wait", "input", "output", "close", "open", "repeat", "group", "comment"
)  # fmt: skip
"""The kinds of `new_steps`."""


def _first_signal(cell: Cell | None, kind: SignalKind) -> int | str:
    """Returns the name of the first signal of the cell, or number 0."""
    signals = () if cell is None else cell.signals
    return next((signal.name for signal in signals if signal.kind == kind), 0)


def _circle(T: Pose) -> Waypoint:
    """Returns a circle about the tool's z axis, beside the tool."""
    R = T.rotation
    center = T.position + _RADIUS * R[:, 0]
    return Waypoint.circle(np.round(center, 9), np.round(R[:, 2], 9))
