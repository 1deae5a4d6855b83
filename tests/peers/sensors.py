"""A plant whose sensors lie: the measured arm leaves its bounds while the commanded one stands still.

It stands for whatever makes a real arm do that (a servo that oscillates, an encoder that slips), and it does so in a
cycle that is known beforehand.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rcilab.core.arrays import readonly_copy
from tests.peers import faults
from tests.peers.faults import H
from tests.peers.kinematics import Matrix
from tests.peers.wire import State


class Lie(NamedTuple):
    """What the sensors add, one row a cycle."""

    bit: int
    modes: tuple[int, int]
    offsets: Matrix
    """Shape (cycles, 7), [rad]."""
    breaks: Callable[[State], bool]
    """Whether a state shows that it was time for the bit."""


class LyingSensors:
    """Wraps a plant; honest until `begin`. The lie is owned by the test, the plant by the controller."""

    def __init__(self, plant: Any) -> None:
        self._plant = plant
        self._lie: Lie | None = None
        self._cycle = 0
        self._q: Any = None
        self._news = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def begin(self, lie: Lie) -> None:
        self._cycle, self._lie = 0, lie

    def end(self) -> None:
        """Puts the arm where the sensors say it is: the lie has become true."""
        self._lie = None
        self._news = 2
        self._plant.reset(self._q)

    def step(self, setpoint: Any) -> Any:
        measured, lie = self._plant.step(setpoint), self._lie
        if lie is None:
            self._news -= 1
            return measured._replace() if self._news >= 0 else measured  # Real sensors repeat no sample.
        here, before = (lie.offsets[min(k, len(lie.offsets) - 1)] for k in (self._cycle, max(self._cycle - 1, 0)))
        self._cycle += 1
        self._q = readonly_copy(measured.q + here)
        return measured._replace(q=self._q, dq=readonly_copy(measured.dq + (here - before) / H))


def _offsets(joint: int, second: Matrix) -> Matrix:
    offsets = np.zeros((len(second), 7))
    offsets[:, joint - 1] = np.cumsum(np.cumsum(second)) * H * H
    return offsets


def _passes(joint: int, bound: float) -> Callable[[State], bool]:
    return lambda state: abs(state.dq_m[joint - 1]) > bound


def _has_bits(state: State) -> bool:
    return bool(state.errors)


_RISING = np.minimum(0.5 * np.arange(700), 5.03)  # [rad/s^2]
_JERKY = np.minimum(0.5 * np.arange(100), 45.0)  # [rad/s^2]
_GENTLE = np.minimum(0.2 * np.arange(300), 2.03)  # [rad/s^2]
_ELBOW = np.zeros((10, 7))
_ELBOW[5:, 0], _ELBOW[5:, 2] = 0.01, -0.01  # [rad] A jump that turns the elbow.

# What a measurement may be beyond the bound of a command: documented allowances for the servo.
ALLOWED_ANGLE = math.radians(1.0)  # [rad]
ALLOWED_PLACE = 0.01  # [m]
ALLOWED_VELOCITY = 1.1  # Times the bound.

LYING: dict[str, Lie] = {
    "a joint is beyond its soft limit": Lie(
        0, faults.JOINT_MODE, _offsets(1, _GENTLE), lambda state: state.q[0] > state.q_c[0] + 0.01 + ALLOWED_ANGLE
    ),
    "the tool is outside the safety box": Lie(
        1,
        faults.CARTESIAN_MODE,
        _offsets(1, _GENTLE),
        lambda state: float(np.abs(np.subtract(state.pos_m[3:12:4], state.pos_c[3:12:4])).max()) > 0.02 + ALLOWED_PLACE,
    ),
    "the arm angle jumps": Lie(2, faults.CARTESIAN_MODE, _ELBOW, _has_bits),
    "a joint is too fast": Lie(
        3, faults.JOINT_MODE, _offsets(1, _RISING), _passes(1, ALLOWED_VELOCITY * faults.VELOCITY[0])
    ),
    "the tool turns too fast": Lie(
        4, faults.CARTESIAN_MODE, _offsets(7, _RISING), _passes(7, ALLOWED_VELOCITY * faults.TOOL_VELOCITY)
    ),
    "a joint accelerates too much": Lie(5, faults.JOINT_MODE, _offsets(7, _JERKY), _has_bits),
    "the tool accelerates too much": Lie(6, faults.CARTESIAN_MODE, _offsets(7, _JERKY), _has_bits),
}
