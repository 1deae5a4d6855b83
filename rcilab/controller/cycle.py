"""One millisecond of the controller: requests and commands in, one state out. No sockets, no clock.

Each `step` plays one command (or goes on coming to rest), judges it, moves the plant and reports. A command that
breaks a necessary condition is never given to the arm: its fault is raised in the same cycle, and the stop begins
from the last good command. Whatever ends a motion, the arm comes to rest on one path: `CommandedMotion.come_to_rest`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from rcilab.arrays import JointVector, frozen
from rcilab.conformance.monitor import JointMonitor
from rcilab.controller.commanded import CommandedMotion
from rcilab.controller.model_download import model_response
from rcilab.controller.plant import Drive, Plant, Setpoint
from rcilab.controller.playout import Playback, Playout
from rcilab.controller.reporter import StateReporter
from rcilab.controller.settings import SIGNAL_COUNT, apply_request, default_settings
from rcilab.controller.state_machine import GROUNDED, POWER_OFF, Action, Event, Phase, Transition, When, transition
from rcilab.faults import Fault
from rcilab.limits import JointLimits
from rcilab.model import RobotModel
from rcilab.protocols import rci
from rcilab.state import ControllerMode, MotionGeneratorMode, RobotState

MODE_DELAY = 200  # [cycles] After StartMove; by then the vendor client's buffer is full of idle states, which it skips.
PREFILL = 10  # [cycles] Pauses of client and network that a motion survives unharmed, and its delay. Both ends on one
# busy machine, even under SCHED_FIFO, were measured to pause for 5 to 10 ms now and then.
LOST_LIMIT = 20  # [cycles] Lost commands in a row that are an instability (manual 4.6: usually 10 to 20).
RECOVERY_TIME = 50  # [cycles] How long an error recovery takes at least; a choice.
DRAIN_LIMIT = 300  # [cycles] How long queued commands are played after StopMove; longer than any queue.
_BLURRED = 3  # [cycles] A third difference reaches this far back: after lost cycles it judges our bridge, too.

MODES = {
    (ControllerMode.JOINT_POSITION, rci.StartMotionMode.JOINT): Drive.POSITION,
    (ControllerMode.JOINT_IMPEDANCE, rci.StartMotionMode.JOINT): Drive.IMPEDANCE,
}
"""The modes that this controller can run, and the drive each needs. All others are refused as not possible."""


class Reply(NamedTuple):
    """What to answer, and when."""

    response: rci.Response
    when: When = When.NOW
    ends_connection: bool = False


class ControlCycle:
    """The controller without its sockets. Owned by the loop that calls `step`, once a millisecond.

    Attributes:
        phase: What the robot is doing.
        faults: The error bits that are set, in wire order.
        reason: Why the last fault was raised, in words and numbers.
        state: The last reported state.
        playout: The queue of commands, with its counts.
        ignored: Commands that came while none was wanted.

    Args:
        model: The arm.
        plant: What moves.
        mode_delay: Cycles from StartMove to the requested modes in the state.
        prefill: Cycles between the first command of a motion and its play-out.
        lost_limit: Lost cycles in a row that raise INSTABILITY_DETECTION; None never does.
        recovery_time: Cycles that an error recovery takes at least.
    """

    def __init__(
        self,
        model: RobotModel,
        plant: Plant,
        *,
        mode_delay: int = MODE_DELAY,
        prefill: int = PREFILL,
        lost_limit: int | None = LOST_LIMIT,
        recovery_time: int = RECOVERY_TIME,
    ) -> None:
        self.model = model
        self._plant = plant
        self._mode_delay = mode_delay
        self._lost_limit = lost_limit
        self._recovery_time = recovery_time
        self.playout = Playout(prefill)
        self.settings = default_settings(model.description)
        self.safety_stop = rci.SafetyStop.NONE
        self.phase = Phase.OFF
        self.faults: tuple[Fault, ...] = ()
        self.reason = ""
        self.ignored = 0
        self._measured = plant.reset(model.home)
        self._commanded = CommandedMotion(model.limits.joint, self._measured.q.tolist())
        self._monitor = JointMonitor(model.limits.joint)
        self._reporter = StateReporter(model, self.settings)
        self._model_response = model_response(model.description)  # Now: it takes longer than a cycle.
        self._countdown = 0
        self._drain = 0
        self._followed = -1
        self._blurred_until = -1
        self._requested = (ControllerMode.OTHER, MotionGeneratorMode.IDLE)
        self._shown = (ControllerMode.OTHER, MotionGeneratorMode.IDLE)
        self._drive = Drive.POSITION
        self._message_id = 0
        self.state = self._report()

    @property
    def is_settled(self) -> bool:
        """Whether the arm rests and no phase is under way that ends by itself: deferred replies are due."""
        return self._commanded.is_at_rest and self.phase not in (Phase.STOPPING, Phase.RECOVERING)

    @property
    def is_moving(self) -> bool:
        """Whether the arm is commanded to move, or listens for commands that would."""
        return self.phase in (Phase.MOVING, Phase.STOPPING) or not self._commanded.is_at_rest

    @property
    def wants_commands(self) -> bool:
        """Whether a client's motion is under way."""
        return self.phase is Phase.MOVING and not self.playout.is_finished

    def reset(self, q: JointVector) -> None:
        """Puts the resting arm somewhere else: what a virtual robot can do and a real one cannot."""
        self._measured = self._plant.reset(frozen(q))
        self._commanded.place(self._measured.q.tolist())

    def receive(self, packet: rci.CommandPacket) -> None:
        """Takes a command that came from the network; it is kept while a motion is under way."""
        if self.phase is Phase.MOVING or self._drain > 0:
            self.playout.push(packet)
        else:
            self.ignored += 1

    def handle(self, request: rci.Request) -> Reply:
        """Takes a request and returns the answer to it."""
        cell = transition(self.phase, request.code)
        match request:
            case rci.SetMotorPower(power=power):
                if power not in (0, 1):
                    return _reply(rci.SettingStatus.INVALID_ARGUMENT)
                cell = cell if power else POWER_OFF[self.phase]
            case rci.StartMove():
                refusal = self._judge_start(request)
                if refusal is not None and cell.status is rci.StartStatus.SUCCESS:
                    return _reply(refusal)
            case rci.StartDrag(space=space, type=kind):
                if space not in tuple(rci.DragSpace) or kind not in tuple(rci.DragType):
                    return _reply(rci.SettingStatus.INVALID_ARGUMENT)
                if Drive.GUIDED not in self._plant.drives:
                    return _reply(rci.SettingStatus.NOT_POSSIBLE)
            case rci.GetMotorState():
                is_on = self.phase not in (Phase.OFF, Phase.USER_STOPPED)
                return Reply(rci.MotorStateResponse(int(is_on)))
            case rci.GetSafetyStopState():
                return Reply(rci.SafetyStopResponse(self.safety_stop))
            case rci.GetDIState(signal=signal):
                return Reply(self._digital_input(signal))
            case rci.LoadRobotModel():
                return Reply(self._model_response)
            case _:
                pass
        if Action.APPLY in cell.actions:
            if request.code in GROUNDED and not self._commanded.is_at_rest:
                return _reply(rci.SettingStatus.NOT_POSSIBLE)
            if not self._apply(request):
                return _reply(rci.SettingStatus.INVALID_ARGUMENT)
        self._enter(cell)
        assert cell.status is not None
        return Reply(rci.StatusResponse(cell.status), cell.when, Action.REBOOT in cell.actions)

    def happen(self, event: Event, *faults: Fault) -> None:
        """Takes an event that is not a client's request; `faults` are the bits that it may set."""
        self._enter(transition(self.phase, event), *faults)

    def press_safety_stop(self, kind: rci.SafetyStop) -> None:
        """Presses an emergency stop, or releases it with NONE. Pressed in mid-motion it also sets an error bit."""
        if kind is not self.safety_stop:
            self.safety_stop = kind
            self.reason = "an emergency stop was pressed"
            event = Event.SAFETY_RELEASE if kind is rci.SafetyStop.NONE else Event.SAFETY_STOP
            self.happen(event, Fault.INSTABILITY_DETECTION)

    def step(self) -> RobotState:
        """Lives through one millisecond and returns the state at its end."""
        self._message_id += 1
        self._count_down()
        faults = self._follow()
        if faults:
            self.happen(Event.FAULT, *faults)
        if not self._commanded.is_at_rest and not self._is_following:
            self._commanded.come_to_rest()
        self._move_plant()
        if self.phase is Phase.STOPPING and self._commanded.is_at_rest and self._drain == 0:
            self.happen(Event.AT_REST)
        self.state = self._report()
        return self.state

    @property
    def _is_following(self) -> bool:
        """Whether this cycle's angles came from the play-out already."""
        return self._followed == self._message_id

    def _count_down(self) -> None:
        if self._countdown > 0:
            self._countdown -= 1
        if self._countdown == 0 and self.phase is Phase.STARTING:
            self.happen(Event.MODES_SHOWN)
        if self._countdown == 0 and self.phase is Phase.RECOVERING and self._commanded.is_at_rest:
            self.happen(Event.RECOVERED)

    def _follow(self) -> tuple[Fault, ...]:
        """Plays what is due in this cycle and returns the faults it raises; a faulty command is not followed."""
        if self._drain > 0:
            self._drain = self._drain - 1 if len(self.playout) else 0
        if self.phase is not Phase.MOVING and self._drain == 0:
            return ()
        playback = self.playout.take(self._is_next)
        if playback.packet is None and not playback.is_lost:
            return ()
        q = self._position(playback)
        faults = self._judge(q, playback)
        if not faults:
            self._commanded.move(q)
            self._followed = self._message_id
        return faults

    def _position(self, playback: Playback) -> list[float]:
        packet, steps, is_lost = playback
        if packet is None:
            return self._commanded.predict(1)
        q = list(packet.q_c[: self.model.n])
        return self._commanded.predict(1, q, steps) if is_lost else q

    def _judge(self, q: list[float], playback: Playback) -> tuple[Fault, ...]:
        lost = self.playout.lost_in_row
        if playback.is_lost:
            self._blurred_until = self._message_id + _BLURRED
            if self._lost_limit is not None and lost >= self._lost_limit:
                self.reason = f"{lost} commands in a row were lost"
                return (Fault.INSTABILITY_DETECTION,)
        if not math.isfinite(sum(q)):  # Not a number is in no range; the derivatives say nothing then.
            self.reason = f"commanded positions {q} rad are not all finite numbers"
            return (Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,)
        faults = self._monitor.step(q)
        if faults:
            self.reason = "; ".join(
                f"joint {joint}: {row.quantity} {value:.6g} {row.unit} passes {bound:.6g} {row.unit}"
                for row, joint, value, bound in self._monitor.broken()
            )
            if self._message_id <= self._blurred_until:
                self.reason = f"lost commands broke the motion ({self.playout.lost} lost so far): {self.reason}"
                return (Fault.INSTABILITY_DETECTION,)
        return faults

    def _is_next(self, packet: rci.CommandPacket, steps: int) -> bool:
        q = packet.q_c
        near, far = self._commanded.predict(1), self._commanded.predict(steps)
        off_near = sum(abs(a - b) for a, b in zip(q, near, strict=False))
        off_far = sum(abs(a - b) for a, b in zip(q, far, strict=False))
        return off_near <= off_far

    def _move_plant(self) -> None:
        commanded, drive = self._commanded, self._current_drive()
        setpoint = Setpoint(drive, commanded.q, commanded.dq, commanded.ddq, stiffness=self.settings.joint_stiffness)
        self._measured = self._plant.step(setpoint)
        if drive in (Drive.BRAKED, Drive.GUIDED):
            q = self._measured.q.tolist()
            if q != commanded.q:
                commanded.place(q)
        elif self.phase in (Phase.MOVING, Phase.STOPPING) and self._collides():
            self.happen(Event.FAULT, Fault.COLLISION)

    def _current_drive(self) -> Drive:
        if self.phase is Phase.GUIDING:
            return Drive.GUIDED
        if self.phase in (Phase.MOVING, Phase.STOPPING):
            return self._drive
        is_braked = self.phase in (Phase.OFF, Phase.REFLEX, Phase.USER_STOPPED, Phase.RECOVERING)
        return Drive.BRAKED if is_braked and self._commanded.is_at_rest else Drive.POSITION

    def _collides(self) -> bool:
        pairs = zip(self._measured.tau_ext.tolist(), self.settings.collision_thresholds, strict=True)
        for joint, (torque, threshold) in enumerate(pairs, start=1):
            if abs(torque) > threshold:
                self.reason = (
                    f"joint {joint}: external torque {torque:.3g} N m is above its threshold {threshold:g} N m"
                )
                return True
        return False

    def _report(self) -> RobotState:
        controller_mode, motion_mode = self._shown
        return self._reporter.report(
            self._message_id,
            self._commanded,
            self._measured,
            faults=self.faults,
            success_rate=self.playout.success_rate,
            motion_generator_mode=motion_mode,
            controller_mode=controller_mode,
            robot_mode=self.phase.robot_mode,
        )

    def _enter(self, cell: Transition, *faults: Fault) -> None:
        for action in cell.actions:
            self._act(action, faults)
        if cell.phase is Phase.RECOVERING and self.phase is not Phase.RECOVERING:
            self._countdown = self._recovery_time
        self.phase = cell.phase

    def _act(self, action: Action, faults: tuple[Fault, ...]) -> None:
        match action:
            case Action.BEGIN:
                self._countdown = self._mode_delay
                self.playout.begin()
            case Action.SHOW_MODES:
                self._shown = self._requested
                self._monitor = JointMonitor(self._soft_limits())
                self._monitor.reset(self._commanded.q)
                self._blurred_until = -1
            case Action.HIDE_MODES:
                self._shown = (ControllerMode.OTHER, MotionGeneratorMode.IDLE)
            case Action.DRAIN:
                self._drain = DRAIN_LIMIT
            case Action.DISCARD:
                self._drain = 0
                self.playout.clear()
            case Action.SET_FAULTS:
                self.faults = tuple(sorted({*self.faults, *faults}))
            case Action.CLEAR_FAULTS:
                self.faults = ()
            case Action.REBOOT:
                self.settings = default_settings(self.model.description)
                self._configure()
            case Action.APPLY:
                pass  # Done before, because it may fail.

    def _apply(self, request: rci.Request) -> bool:
        settings = apply_request(self.settings, request, self.model.description)
        if settings is None:
            return False
        is_changed = settings is not self.settings
        self.settings = settings
        if is_changed and request.code in _RECONFIGURING:
            self._configure()
        return True

    def _configure(self) -> None:
        """Hands tool, load and filters on to whatever computes with them."""
        tool, load = self.settings.T_flange_tool, self.settings.load
        if tool is not self.model.T_flange_tool or load is not self.model.load:
            self.model = self.model.with_tool(tool).with_load(load)
            self._plant.configure(self.model)
        self._reporter.configure(self.model, self.settings)

    def _soft_limits(self) -> JointLimits:
        joint = self.model.limits.joint
        return replace(joint, lower=frozen(self.settings.joint_lower), upper=frozen(self.settings.joint_upper))

    def _judge_start(self, request: rci.StartMove) -> rci.StartStatus | None:
        """Returns why these modes cannot be started, or remembers them and returns None."""
        controller_mode, motion_mode = request.controller_mode, request.motion_mode
        if controller_mode >= ControllerMode.OTHER or motion_mode not in tuple(rci.StartMotionMode):
            return rci.StartStatus.INVALID_ARGUMENT
        modes = ControllerMode(controller_mode), rci.StartMotionMode(motion_mode)
        drive = MODES.get(modes)
        if drive is None or drive not in self._plant.drives:
            return rci.StartStatus.NOT_POSSIBLE
        if self.phase is Phase.IDLE:
            self._requested = (modes[0], modes[1].shown_as)
            self._drive = drive
        return None

    def _digital_input(self, signal: int) -> rci.DigitalInputResponse:
        if signal >= SIGNAL_COUNT:
            return rci.DigitalInputResponse(rci.SettingStatus.INVALID_ARGUMENT, False)
        return rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, self.settings.inputs[signal])


_RECONFIGURING = (
    rci.CommandCode.SET_COOR,
    rci.CommandCode.SET_LOAD,
    rci.CommandCode.SET_FC_COOR,
    rci.CommandCode.SET_TORQUE_FILTER_CUT_OFF_FREQUENCY,
)


def _reply(status: rci.Status) -> Reply:
    return Reply(rci.StatusResponse(status))
