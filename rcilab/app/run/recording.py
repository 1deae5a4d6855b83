"""The last executed motion, for plots, table and export."""

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
    """The last executed motion as reported by the controller."""

    t: np.ndarray
    """[s], shape (N,)."""
    q: np.ndarray
    """Measured, [rad], shape (N, n)."""
    q_c: np.ndarray
    """Commanded, [rad], shape (N, n)."""
    dq: np.ndarray
    """Measured, [rad/s], shape (N, n)."""
    tau: np.ndarray | None = None
    """Measured, [N m], shape (N, n); None if it was not recorded."""
    delay: int
    """Cycles between a command and the state that shows it: the controller's play-out, and its answer."""
    mode: str = ""
    """Control mode, such as "torque"; "" during the motion, where it is that of the plan."""
    run: Run | None = None
    """The whole run, once the arm stands still."""
    scaled_motion: SpeedScaledMotion | None = None
    """How the plan was run, if its speed override was changed during the motion; None: as planned."""
    tracking: Tracking | None = None
    """The tracking error, once the arm stands still."""
    file: str = ""
    """Its file; "" without one."""
    is_operator_absent: bool = False
    """Whether it was stopped because no page answered."""
    finding: str = ""
    """Joint, value and bound of the fault, from the last cycles; "" if they are unknown."""
    moment: float | None = None
    """Time of the fault, as in `t`, [s]; None for a motion without one."""
