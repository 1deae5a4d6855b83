"""Accelerations of the measured arm, for its report in real time."""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME
from rcilab.sim.measured_state import MeasuredStateMonitor


class MeasuredAccelerations:
    """Backward differences of the measured velocities over one cycle. Owned by the controller.

    Attributes:
        joints: Of the joints, n plain floats, [rad/s^2].
        tool: Of the tool's twist in base axes, linear first, [m/s^2, rad/s^2].

    Args:
        state: The measured arm at standstill.
    """

    def __init__(self, state: MeasuredStateMonitor) -> None:
        self._dq, self._twist = self._velocities(state)
        self.joints, self.tool = [0.0] * len(self._dq), [0.0] * len(self._twist)

    def step(self, state: MeasuredStateMonitor) -> None:
        """Takes the measurement of the next cycle."""
        dq, twist = self._velocities(state)
        self.joints = [(v - before) / CYCLE_TIME for v, before in zip(dq, self._dq, strict=True)]
        self.tool = [(v - before) / CYCLE_TIME for v, before in zip(twist, self._twist, strict=True)]
        self._dq, self._twist = dq, twist

    @staticmethod
    def _velocities(state: MeasuredStateMonitor) -> tuple[list[float], list[float]]:
        return state.measured.dq.tolist(), list(state.tool.twist)
