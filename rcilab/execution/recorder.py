"""The log of a control loop: every state and its answer as a row of a recorder, with its lateness."""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable
from operator import attrgetter

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import CartesianPosition, Command, JointPosition, JointTorque
from rcilab.core.cycle_log import OTHER_STATE_FIELDS, STATE_FIELDS
from rcilab.core.cycle_recorder import Recorder
from rcilab.core.fault import FaultCode
from rcilab.core.state import RobotState

_CYCLE_NS = round(CYCLE_TIME * 1e9)
_NO_POSE = (math.nan,) * 16
_NUMBERS = struct.Struct("<4d")
_GRID_CYCLES = 8  # For so many cycles, a clock shift of the controller or a delay here counts as lateness.


class CycleLog:
    """Writes states and answers as rows of a recorder, with their lateness. Owned by the loop's thread.

    Lateness is relative to the robot's own 1 ms grid, estimated from the earliest of the last `_GRID_CYCLES` states.
    This short history follows another computer's clock and a controller that skipped a cycle.

    Args:
        recorder: The recorder.
        on_row: Called after every row; must be quick.
        state_cycles: Cycles from one state to the next.
    """

    def __init__(
        self, recorder: Recorder, on_row: Callable[[CycleLog], None] | None = None, *, state_cycles: int = 1
    ) -> None:
        self.recorder = recorder
        self._state_cycles = state_cycles
        self._on_row = on_row
        self.lateness = 0.0
        """Lateness of the newest row, [s]; NaN if the loop did not wait for it."""
        self.lost_total = 0
        """States that were not received."""
        self.skipped_total = 0
        """States that the driver replaced by newer ones."""
        self.state: RobotState | None = None
        """The state of the newest row."""
        self.braking = False
        """Whether the present commands are part of a stop; set by the control loop."""
        self._last_id: int | None = None
        self._origins: deque[int] = deque(maxlen=_GRID_CYCLES)
        self._nothing = (math.nan,) * recorder.n
        self._arrays_of = attrgetter(*STATE_FIELDS, *(OTHER_STATE_FIELDS[:-4] if recorder.complete else ()))
        self._numbers_of = attrgetter(*OTHER_STATE_FIELDS[-4:]) if recorder.complete else None
        self._idle_count = -1  # `recorder.count` after the newest row, if that was written here outside a motion.

    def restart(self) -> None:
        """Resets the grid and the last number for a new connection."""
        self._last_id = None
        self.lost_total = 0

    def write(
        self,
        state: RobotState,
        received_ns: int,
        t: float = math.nan,
        sent_ns: int = 0,
        command: Command | None = None,
        *,
        is_awaited: bool = True,
        counts_gap: bool = True,
    ) -> None:
        """Records one state and its answer, if there was one.

        Args:
            state: The state.
            received_ns: Monotonic time of its arrival, [ns].
            t: Motion time, [s].
            sent_ns: Monotonic time of the answer, [ns]; 0 without one.
            command: The command sent as answer.
            is_awaited: Whether the loop waited for it; the lateness of a state that was already queued is unknown.
            counts_gap: Whether the numbers between the last state and this one are those of lost states.
        """
        before, self.state = self.state, state
        number = state.message_id
        lost = 0
        if self._last_id is None or number < self._last_id:
            self._origins.clear()
        elif number > self._last_id:
            missing = max((number - self._last_id) // self._state_cycles - 1, 0)
            lost = missing if counts_gap else 0
            self.lost_total += lost
            self.skipped_total += missing - lost
        self._last_id = number
        if is_awaited:
            self._origins.append(received_ns - number * _CYCLE_NS)
            self.lateness = ((sent_ns or received_ns) - number * _CYCLE_NS - min(self._origins)) * 1e-9
        else:
            self.lateness = math.nan
        is_idle = command is None and sent_ns == 0 and math.isnan(t)
        if is_idle and self._idle_count == self.recorder.count and before is not None and _is_alike(state, before):
            self.recorder.repeat(number, received_ns, self.lateness, lost)
        else:
            self._write(state, received_ns, t, sent_ns, command, lost)
        if is_idle:
            self._idle_count = self.recorder.count
        if self._on_row is not None:
            self._on_row(self)

    def _write(
        self, state: RobotState, received_ns: int, t: float, sent_ns: int, command: Command | None, lost: int
    ) -> None:
        q, pose, psi, tau = self._nothing, _NO_POSE, math.nan, self._nothing
        if isinstance(command, JointPosition):
            q = command.q.tolist()
        elif isinstance(command, CartesianPosition):
            pose = command.T_base_tool.ravel().tolist()
            psi = math.nan if command.psi is None else command.psi
        elif isinstance(command, JointTorque):
            tau = command.tau.tolist()
        self.recorder.write(
            state.message_id,
            t,
            received_ns,
            sent_ns,
            self.lateness,
            state.success_rate,
            state.q.tolist(),
            state.q_c.tolist(),
            state.dq.tolist(),
            q,
            _bits(state.faults) if state.faults else 0,
            lost,
            (state.robot_mode, state.controller_mode, state.motion_generator_mode),
            state.tau.tolist(),
            pose,
            psi,
            tau,
            braking=self.braking,
            rest=self._pack_rest(state),
        )

    def _pack_rest(self, state: RobotState) -> bytes:
        arrays = b"".join([values.tobytes() for values in self._arrays_of(state)])
        return arrays if self._numbers_of is None else arrays + _NUMBERS.pack(*self._numbers_of(state))


def _is_alike(state: RobotState, other: RobotState) -> bool:
    """Returns whether two states give the same row: by identity, because the decoder reuses repeated values."""
    return (
        state.q is other.q
        and state.q_c is other.q_c
        and state.dq is other.dq
        and state.tau is other.tau
        and state.tau_ext_in_base is other.tau_ext_in_base
        and state.T_base_tool is other.T_base_tool
        and state.theta is other.theta
        and state.faults == other.faults
        and state.success_rate == other.success_rate
        and state.robot_mode is other.robot_mode
        and state.controller_mode is other.controller_mode
        and state.motion_generator_mode is other.motion_generator_mode
    )


def _bits(faults: tuple[FaultCode, ...]) -> int:
    bits = 0
    for fault in faults:
        bits |= 1 << fault
    return bits
