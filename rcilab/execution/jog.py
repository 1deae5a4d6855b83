"""Jogging: a callback that moves the arm while a jog is held, and stops it afterwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias, get_args

from numpy.typing import ArrayLike

from rcilab.core.arrays import JointVector, as_vector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import JointPosition
from rcilab.core.errors import InvalidValueError
from rcilab.core.state import RobotState
from rcilab.model.dynamics.symmetric_solver import (
    SymmetricSolver as SymmetricSolver,  # Loaded now, not while the arm waits.
)
from rcilab.motion import Jog

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

JogKind: TypeAlias = Literal["joint", "base", "tool"]
"""Meaning of the values: joint velocities, or a twist of the tool in base or tool axes."""

_KINDS: tuple[JogKind, ...] = get_args(JogKind)
_NO_TWIST = (0.0,) * 6
LINGER = 1.0  # [s] Standstill after which a jog ends; until then another jog starts without delay.


@dataclass(frozen=True, slots=True)
class JogCommand:
    """Motion of the arm while the jog is held."""

    kind: JogKind
    values: tuple[float, ...]
    """n joint velocities, [rad/s], or six numbers of a twist, linear first, [m/s, rad/s]."""

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise InvalidValueError("kind", self.kind, f"is not a kind of jog; there are {', '.join(_KINDS)}")


def build_jog(kind: JogKind, values: ArrayLike, n: int) -> JogCommand:
    """Returns a jog of an arm with n joints.

    Raises:
        InvalidValueError: The kind is unknown, or the values are not the required number of finite numbers.
    """
    size, unit = (n, "rad/s") if kind == "joint" else (6, "m/s, rad/s")
    return JogCommand(kind, tuple(as_vector(values, size, "values", unit).tolist()))


class JogSource(Protocol):
    """The source of the held jog."""

    def read(self, current: JogCommand | None) -> JogCommand | None:
        """Returns the held jog, `current` if it cannot be read now, or None if nothing is held."""
        ...


class JogCallback:
    """The callback of a jog. Owned by the control loop's thread.

    Args:
        source: The source of the held jog.
        model: The arm, with its tool.
        q: Present commanded joint angles, shape (n,), [rad]; at standstill.

    Raises:
        PlanningError: A joint is outside its limits.
    """

    def __init__(self, source: JogSource, model: RobotModel, q: JointVector) -> None:
        self._source = source
        self._jog = Jog(model, q)
        self._command: JogCommand | None = None
        self._cycle = 0
        self._standstill_cycles = 0
        self.is_enabled = True
        """False: stop and end, even if a jog is held."""

    def __call__(self, state: RobotState, t: float) -> JointPosition:
        """Returns the command for a state; it is the last one `LINGER` after standstill without a jog."""
        cycle = round(t / CYCLE_TIME)
        self._update_command()
        q = self._jog.q
        for _ in range(cycle - self._cycle):
            q = self._jog.step()
        is_released = self._command is None and self._jog.is_stationary
        self._standstill_cycles = self._standstill_cycles + cycle - self._cycle if is_released else 0
        self._cycle = cycle
        is_over = is_released and (not self.is_enabled or self._standstill_cycles * CYCLE_TIME >= LINGER)
        return JointPosition(q, finished=is_over and cycle > 0)

    def _update_command(self) -> None:
        command = self._source.read(self._command) if self.is_enabled else None
        if command is None:
            if self._command is not None:
                self._release(self._command.kind)
                self._command = None
            return
        if command == self._command:
            return
        self._command = command
        if command.kind == "joint":
            self._jog.set_joint_velocity(command.values)
        else:
            self._jog.set_twist(command.values, frame=command.kind)

    def _release(self, kind: JogKind) -> None:
        """Stops the arm; a tool stays on its line meanwhile."""
        if kind == "joint":
            self._jog.stop()
        else:
            self._jog.set_twist(_NO_TWIST, frame=kind)
