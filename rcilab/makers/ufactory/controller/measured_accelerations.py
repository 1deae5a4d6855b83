"""Accelerations of the measured arm, for its report in real time."""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.measured_state import MeasuredStateMonitor


class MeasuredAccelerations:
    """Backward differences of the measured velocities over one cycle. Owned by the controller.

    Args:
        state: The measured arm at standstill.
    """

    def __init__(self, state: MeasuredStateMonitor) -> None:
        self._dq = self._last_dq = state.measured.dq
        self._twist = self._last_twist = list(state.tool.twist)

    @property
    def joints(self) -> list[float]:
        """Accelerations of the joints, n plain floats, [rad/s^2]."""
        return ((self._dq - self._last_dq) / CYCLE_TIME).tolist()

    @property
    def tool(self) -> list[float]:
        """Derivative of the tool's twist in base axes, linear first, 6 plain floats, [m/s^2, rad/s^2]."""
        return [(v - before) / CYCLE_TIME for v, before in zip(self._twist, self._last_twist, strict=True)]

    def step(self, state: MeasuredStateMonitor) -> None:
        """Takes the measurement of the next cycle."""
        self._last_dq, self._dq = self._dq, state.measured.dq
        self._last_twist, self._twist = self._twist, list(state.tool.twist)
