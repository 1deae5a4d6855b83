"""The phases of the robot, and the effect of each event: one table, pure.

    OFF <-> IDLE -> STARTING -> MOVING -> STOPPING -> IDLE
    IDLE <-> GUIDING            any of them -> REFLEX -> RECOVERING -> IDLE
                                MOVING, STOPPING -> CUT_OFF -> OFF
                                any of them <-> USER_STOPPED

In every phase except for MOVING and GUIDING the arm stops if it still moves, and stays at standstill. This is the only
stop path, and no event requests it explicitly. A reply with `AT_REST` is sent at standstill.
`print(state_machine.as_text())` shows the table.
"""

from __future__ import annotations

from enum import Enum
from typing import Final, NamedTuple, TypeAlias

from rcilab.core.state import RobotMode
from rcilab.makers.rokae.wire import (
    CommandCode,
    GuideStatus,
    RecoveryStatus,
    SettingStatus,
    StartStatus,
    Status,
    StopStatus,
)


class Phase(Enum):
    """The phase of the robot; the value is the robot mode in its state."""

    OFF = (RobotMode.OTHER, 0)
    """Motors off, brakes closed."""
    IDLE = (RobotMode.IDLE, 0)
    """Motors on, arm at standstill."""
    STARTING = (RobotMode.IDLE, 1)
    """StartMove was answered; states do not yet show the requested modes."""
    MOVING = (RobotMode.MOVE, 0)
    """Commands are followed."""
    STOPPING = (RobotMode.MOVE, 1)
    """The motion was ended; queued commands are followed, then the arm stops."""
    GUIDING = (RobotMode.GUIDING, 0)
    """Hand guiding."""
    REFLEX = (RobotMode.REFLEX, 0)
    """A fault stopped the arm; the brakes engage at standstill."""
    CUT_OFF = (RobotMode.REFLEX, 1)
    """As REFLEX, and without motor power: a joint exceeded its range without `auto_limit` (manual 3.1.15)."""
    USER_STOPPED = (RobotMode.USER_STOPPED, 0)
    """An emergency stop is pressed or the safety gate is open."""
    RECOVERING = (RobotMode.AUTOMATIC_ERROR_RECOVERY, 0)
    """Faults are being cleared."""

    def __init__(self, robot_mode: RobotMode, _number: int) -> None:
        self.robot_mode: Final = robot_mode
        """The modes in the state in this phase."""


class Event(Enum):
    """Events inside the controller, in addition to the client's commands."""

    MODES_SHOWN = "the delay after StartMove is over"
    FAULT = "a condition was violated"
    JOINT_LIMIT = "a joint is beyond its range, and auto_limit is off"
    AT_REST = "the arm has stopped"
    RECOVERED = "the recovery time is over and the arm is at standstill"
    CLIENT_LOST = "the client's connection ended"
    SAFETY_STOP = "an emergency stop was pressed or the safety gate opened"
    SAFETY_RELEASE = "the emergency stop and the safety gate are released"


class Action(Enum):
    """Actions of a transition."""

    APPLY = "apply the request's values to the settings"
    BEGIN = "prepare the jitter buffer and start the countdown to the modes"
    SHOW_MODES = "show the requested modes and follow commands"
    REVEAL_MODES = "show the requested modes without following commands"
    HIDE_MODES = "show idle modes"
    DRAIN = "play the queued commands, then stop"
    DISCARD = "discard the queued commands and stop"
    SET_FAULTS = "set the error bits"
    CLEAR_FAULTS = "clear the error bits"
    GUIDE = "store the pose at which guiding begins"
    REBOOT = "reset all settings and end the connection"


class When(Enum):
    """When a reply is sent."""

    NOW = "now"
    SHOWN = "after the next state"
    AT_REST = "at standstill"
    """In RECOVERING and STOPPING also only after the phase has ended."""


Trigger: TypeAlias = CommandCode | Event


class Transition(NamedTuple):
    """The effect of one event in one phase."""

    phase: Phase
    """The phase afterwards."""
    actions: tuple[Action, ...] = ()
    """In this order."""
    status: Status | None = None
    """The answer to a command; None for events and queries."""
    when: When = When.NOW


C, P, E, A = CommandCode, Phase, Event, Action

QUERIES: Final = (C.GET_MOTOR_STATE, C.LOAD_ROBOT_MODEL, C.GET_DI_STATE, C.GET_SAFETY_STOP_STATE)
"""Always answered with content."""

ANYTIME: Final = (C.CONNECT, C.SET_DO, C.SET_CART_IMP_DESIRED_TAU)
"""Setters that are allowed while the arm moves: they do not affect the motion."""

GROUNDED: Final = (
    C.SET_CARTESIAN_LIMIT,
    C.SET_JOINT_LIMIT,
    C.SET_COLLISION_BEHAVIOR,
    C.SET_JOINT_IMPEDANCE,
    C.SET_CARTESIAN_IMPEDANCE,
    C.SET_COOR,
    C.SET_LOAD,
    C.SET_FILTERS,
    C.SET_TORQUE_FILTER_CUT_OFF_FREQUENCY,
    C.SET_FC_COOR,
    C.ENABLE_VIRTUAL_GUIDE,
)
"""Setters for an arm at standstill without faults. The manual gives no list: this one is conservative."""

REMEDIES: Final = (C.SET_COLLISION_BEHAVIOR, C.SET_LOAD)
"""Setters that a stopped arm accepts, too: the manual's remedy for a collision without contact is to raise the
thresholds (4.6), and an error recovery is refused while a torque is above them."""

_IN_MOTION = (P.STARTING, P.MOVING, P.STOPPING)
"""Phases in which a client assumes that its motion is active: only an error bit ends it.

In STARTING the vendor's client waits for the modes, without a timeout, so a stop there shows them with the bit; they
are hidden again when the client ends the motion.
"""

_BUSY = (P.STARTING, P.MOVING, P.STOPPING, P.GUIDING, P.RECOVERING)
_START_REFUSED = dict.fromkeys((P.OFF, *_BUSY), StartStatus.NOT_POSSIBLE) | {
    P.REFLEX: StartStatus.REFLEX,
    P.CUT_OFF: StartStatus.REFLEX,
    P.USER_STOPPED: StartStatus.USER_STOP,
}


def _modes_after(phase: Phase) -> Action:
    """Returns the action for the reported modes when the arm is stopped in a phase."""
    return A.REVEAL_MODES if phase is P.STARTING else A.HIDE_MODES


def _refusal(command: CommandCode) -> Status:
    return GuideStatus.FAILED if command == C.ENABLE_VIRTUAL_GUIDE else SettingStatus.NOT_POSSIBLE


def _success(command: CommandCode) -> Status:
    return GuideStatus.SUCCESS if command == C.ENABLE_VIRTUAL_GUIDE else SettingStatus.SUCCESS


def _setters(phase: Phase) -> dict[Trigger, Transition]:
    rows: dict[Trigger, Transition] = {command: Transition(phase) for command in QUERIES}
    for command in ANYTIME:
        rows[command] = Transition(phase, (A.APPLY,), _success(command))
    for command in GROUNDED:
        if phase in (P.OFF, P.IDLE) or (phase in (P.REFLEX, P.CUT_OFF) and command in REMEDIES):
            rows[command] = Transition(phase, (A.APPLY,), _success(command))
        else:
            rows[command] = Transition(phase, (), _refusal(command))
    return rows


def _motion(phase: Phase) -> dict[Trigger, Transition]:
    stopped = StopStatus.SUCCESS  # Always: the vendor's client aborts on any other answer.
    rows: dict[Trigger, Transition] = {}
    if phase is P.IDLE:
        rows[C.START_MOVE] = Transition(P.STARTING, (A.BEGIN,), StartStatus.SUCCESS)
    else:
        rows[C.START_MOVE] = Transition(phase, (), _START_REFUSED[phase])
    if phase is P.STARTING:
        rows[C.STOP_MOVE] = Transition(P.IDLE, (A.HIDE_MODES, A.DISCARD), stopped, When.AT_REST)
    elif phase is P.MOVING:
        rows[C.STOP_MOVE] = Transition(P.STOPPING, (A.HIDE_MODES, A.DRAIN), stopped, When.AT_REST)
    else:  # A guided arm does not have to stop.
        when = When.NOW if phase is P.GUIDING else When.AT_REST
        rows[C.STOP_MOVE] = Transition(phase, (A.HIDE_MODES,), stopped, when)
    if phase is P.IDLE:
        rows[C.START_DRAG] = Transition(P.GUIDING, (A.GUIDE,), SettingStatus.SUCCESS, When.SHOWN)
    else:
        rows[C.START_DRAG] = Transition(phase, (), SettingStatus.NOT_POSSIBLE)
    if phase is P.GUIDING:
        rows[C.STOP_DRAG] = Transition(P.IDLE, (), SettingStatus.SUCCESS, When.AT_REST)
    else:
        rows[C.STOP_DRAG] = Transition(phase, (), SettingStatus.SUCCESS)
    return rows


def _power(phase: Phase) -> dict[Trigger, Transition]:
    """SetMotorPower combines two commands: these are the rows for "on"; `POWER_OFF` contains those for "off"."""
    rows: dict[Trigger, Transition] = {}
    if phase is P.OFF:
        rows[C.SET_MOTOR_POWER] = Transition(P.IDLE, (A.HIDE_MODES, A.CLEAR_FAULTS), SettingStatus.SUCCESS, When.SHOWN)
    elif phase in (P.USER_STOPPED, P.CUT_OFF):
        rows[C.SET_MOTOR_POWER] = Transition(phase, (), SettingStatus.NOT_POSSIBLE)
    else:
        rows[C.SET_MOTOR_POWER] = Transition(phase, (), SettingStatus.SUCCESS)
    if phase in (P.OFF, P.IDLE, P.REFLEX, P.CUT_OFF, P.USER_STOPPED):
        after = phase if phase is P.USER_STOPPED else P.OFF
        actions = (A.HIDE_MODES, A.DISCARD, A.CLEAR_FAULTS, A.REBOOT)
        rows[C.REBOOT_ROBOT] = Transition(after, actions, SettingStatus.SUCCESS, When.AT_REST)
    else:
        rows[C.REBOOT_ROBOT] = Transition(phase, (), SettingStatus.NOT_POSSIBLE)
    return rows


def _recovery(phase: Phase) -> dict[Trigger, Transition]:
    command = C.AUTOMATIC_ERROR_RECOVERY
    if phase is P.REFLEX:
        return {command: Transition(P.RECOVERING, (), RecoveryStatus.SUCCESS, When.AT_REST)}
    if phase is P.CUT_OFF:
        return {command: Transition(P.OFF, (A.HIDE_MODES, A.CLEAR_FAULTS), RecoveryStatus.SUCCESS, When.AT_REST)}
    if phase in (P.OFF, P.IDLE):  # Only the bit of a motion that a stop or power-off ended can be set.
        return {command: Transition(phase, (A.HIDE_MODES, A.CLEAR_FAULTS), RecoveryStatus.SUCCESS)}
    status = RecoveryStatus.USER_STOP if phase is P.USER_STOPPED else RecoveryStatus.NOT_POSSIBLE
    return {command: Transition(phase, (), status)}


def _events(phase: Phase) -> dict[Trigger, Transition]:
    rows: dict[Trigger, Transition] = {event: Transition(phase) for event in Event}
    if phase is P.STARTING:
        rows[E.MODES_SHOWN] = Transition(P.MOVING, (A.SHOW_MODES,))
    if phase is P.STOPPING:
        rows[E.AT_REST] = Transition(P.IDLE, (A.DISCARD,))
    if phase is P.RECOVERING:
        rows[E.RECOVERED] = Transition(P.IDLE, (A.HIDE_MODES, A.CLEAR_FAULTS))
    if phase is P.USER_STOPPED:  # Of a stop that is released before the next state, only the error bit shows the stop.
        rows[E.SAFETY_RELEASE] = Transition(P.OFF)
        rows[E.FAULT] = rows[E.JOINT_LIMIT] = Transition(phase, (A.SET_FAULTS,))
    elif phase is not P.OFF:
        actions = (A.SET_FAULTS, _modes_after(phase), A.DISCARD)
        rows[E.FAULT] = Transition(phase if phase is P.CUT_OFF else P.REFLEX, actions)
        rows[E.JOINT_LIMIT] = Transition(P.CUT_OFF, actions)
    faults = (A.SET_FAULTS,) if phase in _IN_MOTION else ()
    rows[E.SAFETY_STOP] = Transition(P.USER_STOPPED, (*faults, _modes_after(phase), A.DISCARD))
    if phase in (P.STARTING, P.GUIDING):
        rows[E.CLIENT_LOST] = Transition(P.IDLE, (A.HIDE_MODES, A.DISCARD))
    elif phase is P.MOVING:  # After StopMove the queued commands are played: the vendor's client may leave at once.
        rows[E.CLIENT_LOST] = Transition(P.STOPPING, (A.HIDE_MODES, A.DISCARD))
    return rows


def _row(phase: Phase) -> dict[Trigger, Transition]:
    return _setters(phase) | _motion(phase) | _power(phase) | _recovery(phase) | _events(phase)


TABLE: Final = {(phase, trigger): cell for phase in Phase for trigger, cell in _row(phase).items()}
"""Every phase with every command and every event."""


def _power_off(phase: Phase) -> Transition:
    after = phase if phase is P.USER_STOPPED else P.OFF
    faults = A.SET_FAULTS if phase in _IN_MOTION else A.CLEAR_FAULTS
    actions = () if phase in (P.OFF, P.USER_STOPPED) else (_modes_after(phase), A.DISCARD, faults)
    return Transition(after, actions, SettingStatus.SUCCESS, When.AT_REST)


POWER_OFF: Final = {phase: _power_off(phase) for phase in Phase}
"""SetMotorPower(0): executed in every phase; a moving arm stops first, then the brakes engage."""


def transition(phase: Phase, trigger: Trigger) -> Transition:
    """Returns the effect of a command or an event in a phase."""
    return TABLE[phase, trigger]


def as_text() -> str:
    """Returns the table as text, one line per pair."""
    lines: list[str] = []
    for (phase, trigger), cell in TABLE.items():
        actions = ", ".join(action.name for action in cell.actions)
        status = "" if cell.status is None else f"{cell.status.name} {cell.when.value}"
        lines.append(f"{phase.name:13}{trigger.name:37}-> {cell.phase.name:13}{status:32}{actions}".rstrip())
    return "\n".join(lines)
