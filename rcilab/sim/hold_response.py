"""The response of the position servo to commands that stop coming: the reference while and after commands are held.

A controller that holds the last command stops its joints within tens of milliseconds, as its servo lets them; when
commands come again, the joints catch up and overshoot. The servo is a second-order system per joint,

    y'' + 2 zeta omega y' + omega^2 y = omega^2 u

In an undisturbed motion its delay 2 zeta / omega is left out, so that the arm is where its commands are. A held command
u therefore ends at u + 2 zeta / omega times the velocity, and what is off the commands afterwards decays like the
servo's error. Both are the same equation around another point, so position and velocity are continuous. See
`docs/pauses.md` for the recording of a real arm that this reproduces.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.robots.description import RobotDescription, ServoFigures

_TYPICAL = ServoFigures(bandwidth=110.0, damping=0.9)  # Of an arm without figures: those of the xMate's large joints.
_SETTLED = 1e-10  # [rad] Deviation from the commands, and its change in a cycle, that is dropped.
_EVEN = 50  # [cycles] The longest pause over which the commanded acceleration is taken to be constant.
_STILL = 1e-3  # [rad/s] A stream that ends below this velocity has ended at standstill.


def servo_figures(description: RobotDescription) -> tuple[ServoFigures, ...]:
    """Returns the servos of an arm, one per joint; typical ones if it has no figures."""
    return description.servos or (_TYPICAL,) * description.n


class HoldResponse:
    """Joint angles that follow commands, and hold the last one while none come. Owned by a motion generator.

    Attributes:
        is_active: Whether the joints are off their commands because of a pause.

    Args:
        servos: One per joint.
        q: Joint angles at the start, n plain floats, [rad].
    """

    def __init__(self, servos: Sequence[ServoFigures], q: list[float]) -> None:
        self._decays = [_decay_of_a_cycle(servo) for servo in servos]
        self._delays = [2.0 * servo.damping / servo.bandwidth for servo in servos]
        self.is_active = False
        self._is_holding = False
        self._last = self._before = q  # The last two commands, and the cycles between them.
        self._gap = 1
        self._q = q  # Where the servo is while it is active.
        self._dq = [0.0] * len(q)
        self._off = self._off_rate = self._dq  # How far the commands are ahead of it, after a pause.

    def hold(self) -> list[float]:
        """Returns the joint angles of a cycle without a command, [rad]."""
        velocity = self._velocity()
        if not self.is_active:
            self._q, self._dq = self._last, velocity
        self.is_active = self._is_holding = True
        goal = [q + delay * v for q, delay, v in zip(self._last, self._delays, velocity, strict=True)]
        off, self._dq = self._decay([q - x for q, x in zip(self._q, goal, strict=True)], self._dq)
        self._q = [x + d for x, d in zip(goal, off, strict=True)]
        return self._q

    def follow(self, q: list[float], cycles: int) -> list[float]:
        """Returns the joint angles of a cycle with a command, [rad]: the command itself, unless there was a pause.

        Args:
            q: Command, n plain floats, [rad].
            cycles: Cycles since the last one.
        """
        before = self._velocity() if self.is_active else []
        self._before, self._last, self._gap = self._last, q, cycles
        if not self.is_active:
            return q
        velocity = self._velocity()
        if self._is_holding:
            self._is_holding = False
            if 1 < cycles <= _EVEN:  # The mean velocity of the pause; at its end, with constant acceleration:
                velocity = [2.0 * v - old for v, old in zip(velocity, before, strict=True)]
            self._off = [x - CYCLE_TIME * v - y for x, v, y in zip(q, velocity, self._q, strict=True)]
            self._off_rate = [v - dy for v, dy in zip(velocity, self._dq, strict=True)]
        self._off, self._off_rate = self._decay(self._off, self._off_rate)
        if max(map(abs, self._off)) < _SETTLED and max(map(abs, self._off_rate)) * CYCLE_TIME < _SETTLED:
            self.is_active = False
            return q
        self._q = [x - d for x, d in zip(q, self._off, strict=True)]
        self._dq = [v - d for v, d in zip(velocity, self._off_rate, strict=True)]
        return self._q

    def settle(self) -> list[float] | None:
        """Returns the joint angles of a cycle after the last command of a motion, [rad]; None: nothing is left to do.

        Nothing is left either if the commands ended in motion: then the arm stops from where it is.
        """
        if not self.is_active or max(map(abs, self._velocity())) > _STILL:
            return None
        return self.follow(self._last, 1)

    def _velocity(self) -> list[float]:
        """Returns the velocity of the last commands, [rad/s]."""
        h = CYCLE_TIME * self._gap
        return [(new - old) / h for new, old in zip(self._last, self._before, strict=True)]

    def _decay(self, off: list[float], rate: list[float]) -> tuple[list[float], list[float]]:
        """Returns deviation and its rate one cycle later."""
        columns = list(zip(self._decays, off, rate, strict=True))
        return [a * x + b * v for (a, b, _, _), x, v in columns], [c * x + d * v for (_, _, c, d), x, v in columns]


def _decay_of_a_cycle(servo: ServoFigures) -> tuple[float, ...]:
    """Returns the 2 x 2 transition matrix of deviation and rate over one cycle, row by row: a matrix exponential."""
    omega = servo.bandwidth
    rates = np.array([[0.0, 1.0], [-omega * omega, -2.0 * servo.damping * omega]]) * CYCLE_TIME
    transition = term = np.eye(2)
    for order in range(1, 20):  # The series converges: omega times the cycle is below one.
        term = term @ rates / order
        transition = transition + term
    return tuple(transition.ravel().tolist())
