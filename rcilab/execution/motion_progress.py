"""Progress of a motion that is being streamed."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.core.state import Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionProgress:
    """Progress of the motion that `RobotSession.execute` is streaming; see `RobotSession.progress`."""

    time: float
    """Time since its first command, [s]."""
    duration: float
    """Its duration with the present speed override, [s]; of a held motion, until standstill."""
    plan_time: float
    """Time in its plan, [s]; less than `time` if it ran slower or was held."""
    plan_duration: float
    """Duration of its plan, [s]."""
    speed_override: float
    """Present or requested speed override, from 0 (held) to 1."""
    mode: Mode
    """Command mode."""

    def __repr__(self) -> str:
        percent = 100.0 * self.speed_override
        return f"<MotionProgress: at {self.plan_time:.3f} s of the plan, {percent:.0f} % of its speed, {self.mode}>"
