"""How far a motion is while it is streamed."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.core.state import Mode


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionProgress:
    """The motion that `RobotSession.execute` streams just now; see `RobotSession.progress`."""

    time: float
    """Since its first command, [s]."""
    duration: float
    """How long it takes at the pace that it has, [s]; of a motion that is held, until it stands."""
    place: float
    """Where in its plan it is, [s]; behind `time` when it ran slower or was held."""
    planned: float
    """Where its plan ends, [s]."""
    pace: float
    """Part of its planned speed that it runs at, or comes to; 0 when it is held."""
    mode: Mode
    """How the arm is commanded in it."""

    def __repr__(self) -> str:
        return (
            f"<MotionProgress: at {self.place:.3f} s of the plan, {100.0 * self.pace:.0f} % of its speed, {self.mode}>"
        )
