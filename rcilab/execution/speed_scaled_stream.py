"""A prepared motion while it is streamed: how far it is, and another pace for it, from another thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import UsageError
from rcilab.core.state import Mode
from rcilab.execution.motion_progress import MotionProgress
from rcilab.execution.streaming import MotionStream
from rcilab.motion.speed_scaling import SpeedScaledMotion

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

PACE_LEADS = (100, 300, 1000, 4000)  # Cycles from now on which another pace begins: what planning it may take.
HANDING_OVER = 30  # Cycles between the rows of now and the first of others.


class SpeedScaledStream:
    """What `RobotSession.execute` streams. The control loop's thread calls `stream`, any other one `change_pace`.

    Attributes:
        paced: How it is run through, with every change so far.
        stream: The callback.

    Args:
        paced: How it begins.
        mode: How the arm is commanded.
        model: The arm, with its tool and load.
        on_cycle: Told the number of every cycle.
    """

    def __init__(
        self, paced: SpeedScaledMotion, mode: Mode, model: RobotModel, on_cycle: Callable[[int], None] | None
    ) -> None:
        self.paced = paced
        self.stream = MotionStream(paced.q, mode, model, on_cycle)
        self._mode: Mode = mode
        self._model = model

    @property
    def duration(self) -> float:
        """How long it takes at the pace that it has, [s]; of a motion that is held, until it stands."""
        return self.paced.duration

    @property
    def is_paced(self) -> bool:
        """Whether it is run through in another way than planned."""
        return self.paced.changed > 0

    def as_motion(self) -> Motion:
        """Returns what is commanded in all, as a motion."""
        return self.paced.as_motion()

    @property
    def progress(self) -> MotionProgress:
        """Its place and pace."""
        paced, cycle = self.paced, self.stream.cycle
        return MotionProgress(
            time=cycle * CYCLE_TIME,
            duration=paced.duration,
            place=paced.place_at(cycle),
            planned=paced.motion.duration,
            pace=paced.pace,
            mode=self._mode,
        )

    def change_pace(self, pace: float) -> None:
        """Goes on at another pace, from 0 (held) to 1; see `RobotSession.set_pace`.

        Raises:
            PlanningError: There is no way within the limits to change from here.
            UsageError: This machine is too busy to plan it in time.
        """
        from rcilab.conformance.speed_scaling_check import plan_pace

        for lead in PACE_LEADS:
            changed = plan_pace(self.paced, self.stream.cycle + lead, pace, self._model, self._mode)
            first = min(self.stream.cycle + HANDING_OVER, changed.changed)  # What was to change before goes along.
            if self.stream.switch(first, changed.q[first:], holds=changed.holds):
                self.paced = changed
                return
        raise UsageError(
            "this machine is too busy to change the pace of the motion in time; it goes on as it is"
        ).coded("too_busy")
