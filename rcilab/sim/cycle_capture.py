"""The record of a virtual controller: every cycle, with the command of its client, in a ring that others read.

A row is written when the state of its cycle is sent; the command that answers it is added when it arrives. A client
that received no state in time, or old ones again, repeats numbers, and one may have restarted its numbering (see
`jitter_buffer`): such a command is added to the next row without one, also to one that is yet to come, at the latest
that in which it is played.
The rows of a motion have its number; two events, `begin` and `end`, have its client, its settings and its end.
"""

from __future__ import annotations

import math
import struct
import sys
from collections import deque
from collections.abc import Callable
from operator import attrgetter
from time import monotonic_ns, time_ns
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rcilab.core.cycle_log import NOT_RECORDED, OTHER_STATE_FIELDS, PLAYOUT_FIELDS, STATE_FIELDS, cycle_dtype
from rcilab.core.cycle_ring import CAPACITY, CycleRing, RingCounter
from rcilab.core.state import RobotState
from rcilab.i18n.translator import Remark
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.maker_server import SimulatedController

_HEAD = struct.Struct("<Qdqqdd")
_FAULTS = struct.Struct("<QIBBBB")
_STAMPS = struct.Struct("<qq")
_ANSWERED = struct.Struct("<qd")
_NUMBER = struct.Struct("<Q")
_TAIL = struct.Struct(f"<4d{len(PLAYOUT_FIELDS)}Q")
_POSES = ("T_base_tool", "T_base_tool_c")
_OTHERS = (name for name in (*STATE_FIELDS, *OTHER_STATE_FIELDS) if name not in _POSES)
_FIELDS = ("message_id", "success_rate", "q", "q_c", "dq", "tau", *_OTHERS)
_ROWS = int(RingCounter.ROWS)
_NAN = math.nan  # A global name is found faster.
_RESERVE = 2048  # [rows] That are written before the next look at `has_room`, and those that may still change.
_FARTHEST = 1024  # [rows] Whose commands may be added; then readers take the row.
_LONGEST_QUEUE = 256  # Commands that may wait for a row: no queue of the arm is longer.
_ROUNDING = 1e-6  # [rad/s] Of joints that stand.
_STANDSTILL = 0.02  # [rad/s] Of commanded joints, for a client that ends within a cycle of standstill. A tuning value.


_Answer: TypeAlias = tuple[Callable[..., None], int, Callable[[ArmCommand], Any]]
"""The packer of some numbers of a command, their offset in a row, and what returns them."""


class _Arrival(NamedTuple):
    """A command that arrived."""

    time_ns: int
    """[ns]"""
    lateness: float
    """Time since its state was sent, [s]; NaN if its number is that of no recent state."""
    command: ArmCommand


class CycleCapture:
    """Writes the record. Owned by the controller's loop.

    Args:
        ring: The ring.
        controller: The controller.
        describe: Returns more settings in force as JSON data, for the event at the beginning of a motion.
    """

    __slots__ = (  # It takes a microsecond less a cycle.
        "_answers",
        "_arm",
        "_client",
        "_commands",
        "_controller",
        "_count",
        "_counters",
        "_describe",
        "_fields_of",
        "_guests",
        "_has_played",
        "_is_moving",
        "_last_played",
        "_late",
        "_lost",
        "_lost_client",
        "_lowest",
        "_memory",
        "_modes",
        "_motion",
        "_no_answer",
        "_no_joints",
        "_no_rates",
        "_number",
        "_offset",
        "_offsets",
        "_playout",
        "_reason",
        "_received",
        "_ring",
        "_rows",
        "_size",
        "_stamps",
        "_status",
        "_taken",
        "_unrecorded",
        "_waiting",
    )

    def __init__(
        self, ring: CycleRing, controller: SimulatedController, describe: Callable[[], dict[str, Any]] = dict
    ) -> None:
        self._ring, self._controller, self._describe = ring, controller, describe
        n = ring.n
        dtype = cycle_dtype(n, complete=True, playout=True)
        assert dtype.fields is not None
        self._memory, self._size = ring.memory, dtype.itemsize
        self._offsets = {name: int(field[1]) for name, field in dtype.fields.items()}
        self._stamps = self._offsets["received_ns"]
        self._number = self._offsets["command_number"]
        self._count = 0
        self._motion = 0  # Number of the last motion.
        self._is_moving = False
        self._client = ""
        self._lost_client = ""
        self._reason = Remark("")  # Why the arm stops, also if that is over before it has stopped.
        self._rows: dict[int, int] = {}  # Row of each recent message id since the end of the last motion.
        self._commands: dict[int, int] = {}  # Row of each queued command, by its identity.
        self._waiting: deque[_Arrival] = deque(maxlen=_LONGEST_QUEUE)  # For rows to come; drops the oldest.
        self._fields_of = attrgetter(*_FIELDS)
        self._no_joints = np.full(n, math.nan).tobytes()
        self._no_answer = np.full(17 + n, math.nan).tobytes()
        self._no_rates = np.full(6 + 2 * n, math.nan).tobytes()
        self._answers = self._find_answers(controller.arm.mode)
        self._modes: tuple[object, ...] = ()
        self._status = b""  # Faults and modes, packed: they rarely change.
        self._counters = ring.counters
        self._arm, self._playout = controller.arm, controller.arm.playout
        self._lowest = sys.maxsize  # First row with a command of this motion.
        self._has_played = False
        self._last_played = 0  # Row with the last played command.
        self._guests: set[int] = set()  # Rows with a late command that is not the answer to their state.
        self._taken = 0, -1  # First and last of some rows that all have a command.
        self._offset: int | None = None  # From a number of the client's own counting to its row.
        self._received = self._unrecorded = self._late = self._lost = 0  # Of this motion.
        controller.arm.on_command = self._take

    @property
    def has_room(self) -> bool:
        """Whether the recorder, if there is one, has read what the next rows overwrite."""
        read = self._counters[RingCounter.READ]
        return not read or self._count - read < CAPACITY - _RESERVE

    @property
    def is_crowded(self) -> bool:
        """Whether the recorder, if there is one, has still to read half of the rows."""
        read = self._counters[RingCounter.READ]
        return read > 0 and self._count - read > CAPACITY // 2

    def connect(self, client: str) -> None:
        """Stores the address of the client."""
        self._client = client

    def disconnect(self, reason: str) -> None:
        """Stores why the connection ended, if a motion is in progress."""
        if self._is_moving:
            self._lost_client = f"the client {reason}"

    def write(self) -> None:
        """Writes the row of this cycle; call it after its state was sent."""
        state, playback, playout = self._controller.state, self._arm.playback, self._playout
        is_following = playback is not None or self._arm.is_following
        is_between = is_following and self._controller.is_between_motions
        if is_between:
            playback, is_following = None, False
        if is_following is not self._is_moving:
            self._follow_motion(state, is_following)
        if is_between:
            self._forget_commands()
        count, number = self._count, state.message_id
        played = age = missed = 0
        arrival: _Arrival | None = None
        if playback is not None:
            lost, self._lost = self._lost, playout.lost
            missed = self._lost != lost
            if not playback.is_lost and playback.command is not None:
                played = 1
                self._has_played, self._last_played = True, count
                row = self._commands.pop(id(playback.command), -1)
                if row < 0:
                    arrival = self._pop_waiting(playback.command)
                age = count - row if row >= 0 else 0 if arrival else NOT_RECORDED
        motion = self._motion if self._is_moving else 0
        start = count % CAPACITY * self._size
        self._memory[start : start + self._size] = self._pack(
            state, motion, played, age, len(playout), missed, playout.late, number
        )
        self._rows.setdefault(number, count)
        self._rows.pop(number - _FARTHEST, None)
        self._count = count + 1
        if arrival is not None:
            self._add(count, *arrival)
            self._commands.pop(id(arrival.command), None)
        elif self._waiting and (due := self._pop_due(count)) is not None:
            self._add(count, *due)
        self._counters[_ROWS] = count + 1
        if playout.is_finished and not self._arm.is_following:  # The next motion may begin before the next cycle.
            self._follow_motion(state, is_following=False)

    def _take(self, command: ArmCommand) -> None:
        """Adds a command to the row of the state that it answers, or to the next one without a command."""
        now = monotonic_ns()
        if not self._received:
            self._answers = self._find_answers(self._arm.mode)
        self._received += 1
        late, self._late = self._late, self._playout.late
        row, lateness = self._rows.get(command.number), _NAN
        if row is not None and row < self._lowest and self._has_played:
            row = None  # It has begun to count again: the number is that of a state before the motion.
        if row is not None:
            start = row % CAPACITY * self._size
            sent, answered = _STAMPS.unpack_from(self._memory, start + self._stamps)
            lateness = 1e-9 * (now - sent)
            if not (answered or self._waiting):
                self._store(row, start, now, lateness, command)
                return
        is_late = self._late > late
        if row in self._guests and not is_late:  # It is played, the other one not.
            self._guests.remove(row)
            self._unrecorded += 1
            self._add(row, now, lateness, command)
            return
        if is_late or not self._waiting:
            free = self._find_free(self._find_row(command.number) if row is None else row)
            if free < self._count:
                self._add(free, now, lateness, command)
                if is_late and free != row:
                    self._guests.add(free)
                return
        self._commands.pop(id(command), None)  # Of an earlier command that was dropped.
        if is_late:
            self._unrecorded += 1
        else:
            self._waiting.append(_Arrival(now, lateness, command))

    def _find_free(self, row: int) -> int:
        """Returns the first row from here on that has no command; the next one to come if all have one."""
        first, last = self._taken
        is_known = first <= row <= last
        free = last + 1 if is_known else row
        while free < self._count and _STAMPS.unpack_from(self._memory, free % CAPACITY * self._size + self._stamps)[1]:
            free += 1
        self._taken = (first if is_known else row), free - 1
        return free

    def _find_row(self, number: int) -> int:
        """Returns the row of a client's own number: it counts on from its first command; at first the newest row."""
        newest = max(self._count - 1, 0)
        row = newest if self._offset is None else number + self._offset
        if not newest - _FARTHEST < row <= newest + _LONGEST_QUEUE:
            row = newest  # It has begun to count again.
        self._offset = row - number
        return max(row, 0)

    def _add(self, row: int, time_ns: int, lateness: float, command: ArmCommand) -> None:
        """Adds a command to a row without one."""
        start = row % CAPACITY * self._size
        _NUMBER.pack_into(self._memory, start + self._number, command.number)
        self._store(row, start, time_ns, lateness, command)

    def _store(self, row: int, start: int, time_ns: int, lateness: float, command: ArmCommand) -> None:
        """Stores a command that has the number of its row, which begins at `start` in the memory."""
        _ANSWERED.pack_into(self._memory, start + self._stamps + 8, time_ns, lateness)
        for pack, offset, numbers_of in self._answers:
            pack(self._memory, start + offset, *numbers_of(command))
        self._commands[id(command)] = row
        if row < self._lowest:
            self._lowest = row

    def _pop_due(self, row: int) -> _Arrival | None:
        """Removes the first command that waits for this row or an earlier one by its number, and returns it."""
        offset = self._offset
        for k, arrival in enumerate(self._waiting):
            if offset is None or arrival.command.number + offset <= row:
                del self._waiting[k]
                return arrival
        return None

    def _pop_waiting(self, command: ArmCommand) -> _Arrival | None:
        """Removes a command from those that wait for a row, and returns it; None if it is not among them.

        Older ones are removed, too: they were skipped or dropped, and are not played any more.
        """
        waiting = list(self._waiting)
        for k, arrival in enumerate(waiting):
            if arrival.command is command:
                kept = [other for other in waiting[:k] if other.command.number > command.number]
                self._unrecorded += k - len(kept)
                self._waiting = deque([*kept, *waiting[k + 1 :]], maxlen=_LONGEST_QUEUE)
                return arrival
        return None

    def _find_answers(self, mode: MotionMode) -> tuple[_Answer, ...]:
        """Returns how a command of this mode is stored: its torques, and the parallel motion."""
        kinds = [CommandKind.TORQUES] if mode.law is ControlLaw.TORQUE else []
        if mode.kind not in kinds:
            kinds.append(mode.kind)
        columns = [_COLUMNS[kind] for kind in kinds]
        return tuple(
            (struct.Struct(f"<{count or self._ring.n}d").pack_into, self._offsets[name], numbers_of)
            for name, count, numbers_of in columns
        )

    def _follow_motion(self, state: RobotState, is_following: bool) -> None:
        """Writes the event of a motion that begins or has ended."""
        if self._is_moving and (self._controller.faults or self._controller.button != "none"):
            self._reason = self._controller.reason
        is_moving = is_following or (self._is_moving and self._controller.is_moving)
        if is_moving is self._is_moving:
            return
        self._is_moving = is_moving
        if is_moving:
            self._begin_motion(state)
        else:
            self._end_motion()

    def _begin_motion(self, state: RobotState) -> None:
        self._motion += 1
        self._lost_client, self._reason = "", Remark("")
        arm, load = self._arm, self._arm.model.load
        self._ring.add_event(
            {
                "event": "begin",
                "motion": self._motion,
                "row": self._count,
                "mode": state.controller_mode.name.lower(),
                "commands": _KIND_NAMES[arm.mode.kind],
                "client": self._client,
                "wall_ns": time_ns(),
                "tool": arm.model.T_flange_tool.as_row_major(),
                "load": [load.mass, load.center_of_mass.tolist(), load.inertia.tolist()],
                "settings": {**arm.parameters.describe(), **self._describe()},
            }
        )

    def _end_motion(self) -> None:
        playout = self._playout
        reason = self._reason or Remark(self._lost_client) or self._describe_break()
        self._ring.add_event(
            {
                "event": "end",
                "motion": self._motion,
                "row": self._count,
                "stopped": reason.as_dict() if reason else None,
                "received": self._received,
                "unrecorded": self._unrecorded + len(self._waiting),
                "lost": playout.lost,
                "most_lost": playout.max_consecutive_lost,
                "late": playout.late,
                "dropped": playout.dropped,
                "duplicates": playout.duplicates,
            }
        )
        self._forget_commands()

    def _forget_commands(self) -> None:
        """Begins anew for the next motion, whose first commands may arrive before its first row, for earlier states."""
        self._received = self._unrecorded = self._late = self._lost = 0
        self._offset = None
        self._lowest, self._has_played = sys.maxsize, False
        self._guests.clear()
        self._rows.clear()
        self._commands.clear()
        self._waiting.clear()

    def _describe_break(self) -> Remark:
        """Returns that the client stopped the motion before its end; "" if it did not.

        Where requests end motions, too, those stopped it before its end that came while joints moved. Torques may end
        at any speed there.
        """
        if self._playout.is_finished or not self._has_played:
            return Remark("")
        n, row = self._ring.n, self._last_played % CAPACITY * self._size
        dq_c = np.frombuffer(self._memory, count=n, offset=row + self._offsets["dq_c"])
        joint = int(np.abs(dq_c).argmax())
        speed = abs(float(dq_c[joint]))
        is_streamed = self._playout.is_streamed
        is_too_fast = is_streamed and self._arm.mode.kind is not CommandKind.TORQUES and speed >= _STANDSTILL
        if not (self._arm.ends_by_command or is_too_fast):
            return Remark("")
        if not (is_streamed and speed > _ROUNDING):
            return Remark("the client stopped the motion without a last command", "client_stopped_early")
        sentence = f"the client stopped the motion while joint {joint + 1} moved at {speed:.3g} rad/s"
        return Remark(sentence, "client_stopped", joint=joint + 1, speed=speed)

    def _pack(self, state: RobotState, *playout: int) -> bytes:
        modes = state.faults, state.robot_mode, state.controller_mode, state.motion_generator_mode
        if modes != self._modes:
            self._modes = modes
            self._status = _FAULTS.pack(sum(1 << fault for fault in state.faults), 0, *modes[1:], 0)
        (
            number, success_rate, q, q_c, dq, tau, ext, ext_stiff, theta, dq_c, ddq_c, velocity_c, acceleration_c,
            tau_filtered, tau_c, dtau_c, dtheta, motor_tau, motor_tau_filtered, psi, psi_c, dpsi_c, ddpsi_c,
        ) = self._fields_of(state)  # fmt: skip
        tool, tool_c = self._arm.measured_state.tool, self._arm.tool_c  # Of this state, without its wrapping.
        parts: tuple[Any, ...] = (
            _HEAD.pack(number, _NAN, monotonic_ns(), 0, _NAN, success_rate),
            q, q_c, dq, self._no_joints, self._status, tau, self._no_answer,
            ext, ext_stiff, tool.matrix, theta, dq_c, ddq_c, tool_c.matrix, velocity_c, acceleration_c,
            tau_filtered, tau_c, dtau_c, dtheta, motor_tau, motor_tau_filtered,
            _TAIL.pack(psi, psi_c, dpsi_c, ddpsi_c, *playout), self._no_rates,
        )  # fmt: skip
        return b"".join(parts)


def _pose_of(command: ArmCommand) -> tuple[float, ...]:
    return (*command.T_base_tool, command.psi if command.has_psi else math.nan)


_KIND_NAMES = {
    CommandKind.JOINT_ANGLES: "joint_position",
    CommandKind.JOINT_VELOCITIES: "joint_velocity",
    CommandKind.POSES: "cartesian_position",
    CommandKind.TWISTS: "cartesian_velocity",
    CommandKind.JOINT_GOALS: "joint_goal",
    CommandKind.TORQUES: "torque",
}
"""As `Setup.commands` has them."""

_COLUMNS: dict[CommandKind, tuple[str, int, Callable[[ArmCommand], Any]]] = {
    CommandKind.JOINT_ANGLES: ("command", 0, attrgetter("q")),
    CommandKind.JOINT_VELOCITIES: ("command_dq", 0, attrgetter("dq")),
    CommandKind.POSES: ("command_pose", 17, _pose_of),
    CommandKind.TWISTS: ("command_twist", 6, attrgetter("twist")),
    CommandKind.JOINT_GOALS: ("command_goal", 0, attrgetter("q")),
    CommandKind.TORQUES: ("command_tau", 0, attrgetter("tau")),
}
"""The field of a row that has a kind of command, its numbers (0: one per joint), and what returns them."""
