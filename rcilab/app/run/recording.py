"""The last executed motion, as plots, table and export show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rcilab.motion.speed_scaling import SpeedScaledMotion
    from rcilab.recording.run import Run
    from rcilab.recording.tracking import Tracking


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """The last executed motion as the controller reported it."""

    t: np.ndarray
    """[s], shape (N,)."""
    q: np.ndarray
    """Measured, [rad], shape (N, n)."""
    q_c: np.ndarray
    """Commanded, [rad], shape (N, n)."""
    dq: np.ndarray
    """Measured, [rad/s], shape (N, n)."""
    tau: np.ndarray | None = None
    """Measured, [N m], shape (N, n); None where it was not kept."""
    delay: int
    """Cycles between a command and the state that shows it: the controller's play-out, and its answer."""
    run: Run | None = None
    """All of it, once the arm stands still."""
    paced: SpeedScaledMotion | None = None
    """How the plan was run, where its speed override was changed on the way; None: as planned."""
    tracking: Tracking | None = None
    """How far the arm was from its plan, once it stands still."""
    file: str = ""
    """Where it is on disk; "" where it is not."""
    is_left_alone: bool = False
    """Whether it was stopped because no page answered."""
    finding: str = ""
    """What the last cycles show of the fault, joint, value and bound; "" where it is not known."""
    moment: float | None = None
    """When a fault was reported, as in `t`, [s]; None for a motion without one."""
