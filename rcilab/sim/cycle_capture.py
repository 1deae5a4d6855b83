"""The record of a virtual controller: every cycle, with the command of its client, in a ring that others read.

A row is written when the state of its cycle is sent; the command that answers it is added when it arrives. A client
that received no state in time, or old ones again, repeats numbers (see `jitter_buffer`): such a command is added to the
next row without one, also to one that is yet to come.
The rows of a motion have its number; two events, `begin` and `end`, say whose motion it was, with which settings, and
how it ended.
"""

from __future__ import annotations

import math
import struct
import time
from collections import deque
from collections.abc import Callable
from operator import attrgetter
from typing import Any

import numpy as np

from rcilab.core.cycle_log import OTHER_STATE_FIELDS, PLAYOUT_FIELDS, STATE_FIELDS, cycle_dtype
from rcilab.core.cycle_ring import CAPACITY, CycleRing, RingCounter
from rcilab.core.fault import FaultCode
from rcilab.core.state import RobotState
from rcilab.i18n.translator import Remark
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.maker_server import SimulatedController

_HEAD = struct.Struct("<Qdqqdd")
_FAULTS = struct.Struct("<QIBBBB")
_STAMP = struct.Struct("<q")
_ANSWERED = struct.Struct("<qd")
_NUMBERS = struct.Struct("<4d")
_PLAYOUT = struct.Struct(f"<{len(PLAYOUT_FIELDS)}Q")
_FARTHEST = 256  # [rows] A command for a state before or after so many others is not recorded: no queue is longer.


class CycleCapture:
    """Writes the record. Owned by the controller's loop.

    Args:
        ring: The ring.
        controller: The controller.
        describe: Returns more settings in force as JSON data, for the event at the beginning of a motion.
    """

    def __init__(
        self, ring: CycleRing, controller: SimulatedController, describe: Callable[[], dict[str, Any]] = dict
    ) -> None:
        self._ring, self._controller, self._describe = ring, controller, describe
        n = ring.n
        dtype = cycle_dtype(n, complete=True, playout=True)
        assert dtype.fields is not None
        self._memory, self._size = ring.memory, dtype.itemsize
        self._offsets = {name: int(field[1]) for name, field in dtype.fields.items()}
        self._joints = struct.Struct(f"<{n}d").pack_into
        self._pose = struct.Struct("<17d").pack_into
        self._count = 0
        self._motion = 0  # Number of the last motion.
        self._is_moving = False
        self._client = ""
        self._lost_client = ""
        self._rows: dict[int, int] = {}  # Row of each recent message id.
        self._commands: dict[int, int] = {}  # Row of each queued command, by its identity.
        self._waiting: deque[tuple[int, ArmCommand]] = deque()  # Time of arrival, [ns]; for rows to come.
        self._arrays_of = attrgetter(*STATE_FIELDS, *OTHER_STATE_FIELDS[:-4])
        self._numbers_of = attrgetter(*OTHER_STATE_FIELDS[-4:])
        nothing = np.full(n, math.nan).tobytes()
        self._no_command = nothing
        self._no_pose = np.full(17, math.nan).tobytes()
        self._faults: tuple[FaultCode, ...] = ()
        self._bits = 0
        self._received = self._duplicates = 0
        controller.arm.on_command = self._take

    def connect(self, client: str) -> None:
        """Stores the address of the client."""
        self._client = client

    def disconnect(self, reason: str) -> None:
        """Stores why the connection ended, if a motion is in progress."""
        if self._is_moving:
            self._lost_client = f"the client {reason}"

    def write(self) -> None:
        """Writes the row of this cycle; call it after its state was sent."""
        controller = self._controller
        state, arm = controller.state, controller.arm
        self._follow_motion(state)
        playback, playout = arm.playback, arm.playout
        played = age = missed = 0
        if playback is not None:
            missed = int(playback.is_lost)
            if not missed and playback.command is not None:
                played = 1
                age = self._count - self._commands.pop(id(playback.command), self._count)
        motion = self._motion if self._is_moving else 0
        row = self._pack(state, (motion, played, age, len(playout), missed, playout.late))
        start = self._count % CAPACITY * self._size
        self._memory[start : start + self._size] = row
        self._rows.setdefault(state.message_id, self._count)
        self._rows.pop(state.message_id - _FARTHEST, None)
        self._count += 1
        if self._waiting:
            self._add(self._count - 1, *self._waiting.popleft())
        self._ring.counters[RingCounter.ROWS] = self._count

    def _take(self, command: ArmCommand) -> None:
        """Adds a command to the row of the state that it answers, or to the next one without a command."""
        now = time.monotonic_ns()
        self._received += 1
        row = self._rows.get(command.number)
        if row is None:
            return
        while row < self._count and self._is_answered(row):
            row += 1
        if row < self._count and not self._waiting:
            self._add(row, now, command)
        elif len(self._waiting) < _FARTHEST:
            self._waiting.append((now, command))

    def _is_answered(self, row: int) -> bool:
        offset = row % CAPACITY * self._size + self._offsets["sent_ns"]
        return _STAMP.unpack_from(self._memory, offset)[0] != 0

    def _add(self, row: int, arrived: int, command: ArmCommand) -> None:
        start = row % CAPACITY * self._size
        delay = arrived - _STAMP.unpack_from(self._memory, start + self._offsets["received_ns"])[0]
        lateness = 1e-9 * delay if delay >= 0 else math.nan  # It was there before this state: it had no deadline.
        _ANSWERED.pack_into(self._memory, start + self._offsets["sent_ns"], arrived, lateness)
        mode = self._controller.arm.mode
        if mode.law is ControlLaw.TORQUE:
            self._joints(self._memory, start + self._offsets["command_tau"], *command.tau)
        elif mode.is_cartesian:
            psi = command.psi if command.has_psi else math.nan
            self._pose(self._memory, start + self._offsets["command_pose"], *command.T_base_tool, psi)
        else:
            self._joints(self._memory, start + self._offsets["command"], *command.q)
        self._commands[id(command)] = row

    def _follow_motion(self, state: RobotState) -> None:
        """Writes the events of a motion that begins or has ended."""
        controller = self._controller
        is_following = controller.arm.is_following or controller.arm.playback is not None
        is_moving = is_following or (self._is_moving and controller.is_moving)
        if is_moving is self._is_moving:
            return
        self._is_moving = is_moving
        arm = controller.arm
        if is_moving:
            self._motion += 1
            self._lost_client, self._received = "", 0
            self._commands.clear()
            self._waiting.clear()
            load = arm.model.load
            self._ring.add_event(
                {
                    "event": "begin",
                    "motion": self._motion,
                    "mode": state.controller_mode.name.lower(),
                    "client": self._client,
                    "wall_ns": time.time_ns(),
                    "tool": arm.model.T_flange_tool.as_row_major(),
                    "load": [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()],
                    "settings": {**describe_parameters(arm.parameters), **self._describe()},
                }
            )
            return
        playout = arm.playout
        reason = controller.reason if controller.faults else Remark(self._lost_client)
        self._ring.add_event(
            {
                "event": "end",
                "motion": self._motion,
                "rows": self._count,
                "stopped": reason.as_dict() if reason else None,
                "received": self._received,
                "lost": playout.lost,
                "most_lost": playout.max_consecutive_lost,
                "late": playout.late,
                "dropped": playout.dropped,
                "duplicates": playout.duplicates,
            }
        )

    def _pack(self, state: RobotState, playout: tuple[int, ...]) -> bytes:
        if state.faults is not self._faults:
            self._faults, self._bits = state.faults, sum(1 << fault for fault in state.faults)
        modes = state.robot_mode, state.controller_mode, state.motion_generator_mode, 0
        return b"".join(
            (
                _HEAD.pack(state.message_id, math.nan, time.monotonic_ns(), 0, math.nan, state.success_rate),
                state.q.tobytes(),
                state.q_c.tobytes(),
                state.dq.tobytes(),
                self._no_command,
                _FAULTS.pack(self._bits, 0, *modes),
                state.tau.tobytes(),
                self._no_pose,
                self._no_command,
                *[values.tobytes() for values in self._arrays_of(state)],
                _NUMBERS.pack(*self._numbers_of(state)),
                _PLAYOUT.pack(*playout),
            )
        )


def describe_parameters(parameters: ArmParameters) -> dict[str, Any]:
    """Returns the settings of an arm as JSON data, in SI units; tool and load are kept elsewhere."""
    box = parameters.safety_box
    return {
        "joint_lower": parameters.joint_lower,
        "joint_upper": parameters.joint_upper,
        "collision_thresholds": parameters.collision_thresholds,
        "joint_stiffness": parameters.joint_stiffness,
        "cartesian_stiffness": parameters.cartesian_stiffness,
        "desired_wrench": parameters.desired_wrench,
        "joint_filter": parameters.joint_filter,
        "cartesian_filter": parameters.cartesian_filter,
        "torque_filter": parameters.torque_filter,
        "force_frame": parameters.T_flange_force.as_row_major(),
        "force_axes": parameters.force_axes.value,
        "virtual_guide": parameters.virtual_guide,
        "auto_limit": parameters.auto_limit,
        "safety_box": None
        if box is None
        else {"size": box.size, "pose": box.T_base_box.as_row_major(), "active": box.active},
    }
