"""The jog in the control process: a callback that moves the arm as long as somebody holds it, and stops it after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.control_process.jog_command import JogCommand, JogKind, is_held, read_jog
from rcilab.control_process.layout import ControlBlock
from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import JointPosition
from rcilab.core.state import RobotState
from rcilab.model.dynamics.symmetric_solver import (
    SymmetricSolver as SymmetricSolver,  # Loaded now, not as the arm waits.
)
from rcilab.motion import Jog

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_NO_TWIST = (0.0,) * 6
LINGER = 1.0  # [s] at rest after which a jog ends; until then the next one begins at once. A choice.


class HeldJog:
    """Gives the command of every cycle of a jog. Owned by the control process's one thread.

    Args:
        block: Where the jog is read from.
        model: The arm, with its tool.
        q: Commanded joint angles now, shape (n,), [rad]; at rest.

    Raises:
        PlanningError: A joint is outside its limits: there is no way to move inside them.
    """

    def __init__(self, block: ControlBlock, model: RobotModel, q: JointVector) -> None:
        self._block = block
        self._jog = Jog(model, q)
        self._command: JogCommand | None = None
        self._cycle = 0
        self._resting = 0
        self.is_wanted = True
        """False: whatever is held, come to rest and end; another request waits."""

    def __call__(self, state: RobotState, t: float) -> JointPosition:
        """Returns the command that answers a state; the one of an arm that nobody moves any more is the last."""
        cycle = round(t / CYCLE_TIME)
        self._lead()
        q = self._jog.q
        for _ in range(cycle - self._cycle):
            q = self._jog.step()
        is_free = self._command is None and self._jog.is_at_rest
        self._resting = self._resting + cycle - self._cycle if is_free else 0
        self._cycle = cycle
        is_over = is_free and (not self.is_wanted or self._resting * CYCLE_TIME >= LINGER)
        return JointPosition(q, finished=is_over and cycle > 0)

    def _lead(self) -> None:
        """Takes what is held now."""
        counters = self._block.counters
        if not (self.is_wanted and is_held(counters)):
            if self._command is not None:
                self._let_go(self._command.kind)
                self._command = None
            return
        command = read_jog(self._block.jog, counters)
        if command is None or command == self._command:
            return
        self._command = command
        if command.kind == "joint":
            self._jog.set_joint_velocity(command.values)
        else:
            self._jog.set_twist(command.values, frame=command.kind)

    def _let_go(self, kind: JogKind) -> None:
        """Comes to rest; a tool stays on its line meanwhile."""
        if kind == "joint":
            self._jog.stop()
        else:
            self._jog.set_twist(_NO_TWIST, frame=kind)
