"""The supervisor: the face of the control process to the rest of the program."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.conformance.speed_scaling_check import plan_start
from rcilab.control_process.configuration_sync import ConfigurationSync, standard_setup
from rcilab.control_process.jog_record import hold_jog, release_jog
from rcilab.control_process.launch import require_plant
from rcilab.control_process.layout import OPERATOR_TIMEOUT, ControlBlock, Counter
from rcilab.control_process.messages import (
    Configure,
    Connect,
    Execute,
    Jog,
    ReadInputs,
    Reboot,
    Recover,
    Request,
    SetOutput,
    SetPower,
    Settings,
    StartGuiding,
    Stop,
    StopGuiding,
)
from rcilab.control_process.motion_preconditions import require_admissible, require_ready
from rcilab.control_process.motion_rows import SharedRows
from rcilab.control_process.pending_request import PendingRequest
from rcilab.control_process.process_supervisor import ANSWER_TIMEOUT, ProcessSupervisor
from rcilab.control_process.request_client import RequestClient
from rcilab.control_process.ring import RingReader
from rcilab.control_process.round_trip import RoundTrip
from rcilab.control_process.snapshot import Snapshot
from rcilab.control_process.status import MESSAGES, Incident, Phase, SupervisorStatus
from rcilab.control_process.status_reader import StatusReader
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.closeable import Closeable
from rcilab.core.errors import ConnectionLostError, ControlError, ModelError, RcilabError, UsageError
from rcilab.core.memory import memory_needed
from rcilab.core.state import Mode
from rcilab.execution.guiding import require_guidable
from rcilab.execution.jog import JogKind, build_jog
from rcilab.execution.speed_override import SpeedOverride
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ExpectedArm, GuideKind, GuideSpace, parse_address, require_signal
from rcilab.makers.maker import capabilities_of, maker_of, require_driver, require_feature, require_parts
from rcilab.model.robot_model import require_model
from rcilab.motion.speed_scaling import SpeedScaledMotion, require_speed_override

if TYPE_CHECKING:
    from rcilab.conformance.certificate import Certificate
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

__all__ = ["PendingRequest", "Supervisor"]

VIRTUAL = "virtual"
_TICK = 0.02  # [s] between two looks of the watching thread.
_LOSS_LOOKS = 3  # Polls that have to find a connection lost before it is reported, 0.06 s.


class Supervisor(Closeable):
    """Runs motions in a process of its own, so that nothing the page does can disturb a cycle.

    All methods may be called from any thread. Requests return a
    `PendingRequest` at once; nothing here waits for the robot except `start()`, `restart()` and `close()`. The
    processes belong to a `ProcessSupervisor`, pending requests to a `RequestClient`; a thread of this object looks
    after both.

    Args:
        model: The arm.
        target: "virtual" for a private virtual controller on loopback, or the address of a controller, rci://HOST:PORT.
        plant: What the virtual controller moves: "ideal" or "mujoco".
        stop_without_operator: Whether a motion is stopped once no operator has been present for 2 s (see
            `set_operator_present`). False lets it finish; meant for the virtual controller.
        auto_restart: Whether a process of ours that died is started again by itself (at most 3 times a minute).
        setup: What the controller is sent at every connection. None: the virtual one the model's tool and load, a
            real one nothing, since it has its own.

    Raises:
        InvalidValueError: The target is no address, the model no model, or the plant unknown.
    """

    def __init__(
        self,
        model: RobotModel,
        target: str = VIRTUAL,
        plant: str = "ideal",
        *,
        stop_without_operator: bool = True,
        auto_restart: bool = True,
        setup: RobotConfiguration | None = None,
    ) -> None:
        self.model = require_driver(require_model(model))
        require_plant(plant)
        self._target = VIRTUAL if target == VIRTUAL else str(parse_address(target, self.model))
        if setup is None:
            setup = standard_setup(self.model, is_virtual=self._target == VIRTUAL)
        self.model = require_parts(self.model, setup).applied_to(self.model)
        self._setup = ConfigurationSync(setup)
        self._plant = plant
        self._stop_without_operator = stop_without_operator
        self._auto_restart = auto_restart
        self._lock = threading.RLock()  # Guards everything below; held for long only while our processes are ended.
        self._block: ControlBlock | None = None  # With it come and go the keeper, the desk and the readers.
        self._connecting: PendingRequest | None = None
        self._jogging: PendingRequest | None = None
        self._crash: tuple[str, str] | None = None
        self._incident: Incident | None = None
        self._lost_looks = 0  # So many looks have found the connection lost.
        self._watcher: threading.Thread | None = None
        self._is_closing = threading.Event()

    def start(self, timeout: float = 20.0) -> None:
        """Starts the processes and returns once states arrive or it is clear that they will not.

        An unreachable robot is no error here: the phase is then "lost" and `reconnect()` tries again.

        Args:
            timeout: How long to wait, [s].

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
            UsageError: It was started before, or memory is short.
        """
        with self._lock:
            if self._block is not None:
                raise UsageError("the supervisor has been started already; use restart(), or make a new one")
        try:
            with memory_needed():
                with self._lock:
                    self._open()
                    watcher = threading.Thread(target=self._watch, name="rcilab-supervisor", daemon=True)
                    watcher.start()
                    self._watcher = watcher
                self._await_connection(timeout)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Brings a running motion to rest, ends our processes and frees the shared memory. May be called twice."""
        self._is_closing.set()
        watcher, self._watcher = self._watcher, None
        if watcher is not None and watcher is not threading.current_thread():
            watcher.join()
        with self._lock:
            if self._block is not None:
                self._end_processes(ConnectionLostError("the supervisor was closed"))
                self._block.close()
                self._block = None

    def restart(self, timeout: float = 20.0) -> None:
        """Ends and starts our processes again, whatever state they are in, and returns once states arrive.

        Args:
            timeout: How long to wait, [s].

        Raises:
            ConnectionLostError: A process of ours could not be started; the message carries what it said.
            UsageError: It was never started.
        """
        with self._lock:
            self._require_block()
            self._end_processes(ConnectionLostError("the control process was restarted"))
            self._keeper.launch()
        self._await_connection(timeout)

    def status(self) -> SupervisorStatus:
        """Returns a snapshot; cheap enough to be taken at the display's rate."""
        with self._lock:
            if self._block is None:
                return SupervisorStatus(target=self._target, incident=self._incident)
            shown = self._reader.read_snapshot()
            phase, code, message = self._judge(shown)
            fields = self._reader.read_fields(shown)
            if phase in ("crashed", "lost", "starting"):
                fields |= {"rate_hz": 0.0, "robot_mode": None, "controller_mode": None}  # Not reported any more.
            return SupervisorStatus(
                phase=phase,
                code=code,
                message=message,
                incident=self._incident,
                target=self._target,
                address=self._keeper.address,
                world_address=self._keeper.world_address,
                controller_pid=self._keeper.controller_pid,
                worker_pid=self._keeper.worker_pid,
                setup=self._setup.acknowledged,
                setup_times=self._setup.times,
                **fields,
                **self._read_override(shown),
                **self._round_trip.read_fields(),
            )

    def reconnect(self) -> PendingRequest:
        """Drops the connection to the controller and makes a new one.

        Raises:
            UsageError: There is no controller to connect to: the virtual one has died; `restart()` starts it again.
        """
        with self._lock:
            self._require_block()
            address = self._keeper.address
            if address is None:
                raise UsageError("there is no controller to connect to; restart() starts the virtual one again").coded(
                    "not_connected"
                )
            wanted = self._setup.wanted
            pending = self._ask("reconnect", Connect(address=address, timeout=ANSWER_TIMEOUT, configuration=wanted))
            self._setup.follow(pending, wanted, is_new_connection=True)
            return pending

    def set_operator_present(self, present: bool) -> None:
        """Reports that an operator is present; call with True at least once a second while that is so.

        Until the first call no operator is expected. From then on, a motion is stopped when the last True is more
        than 2 s ago (`stop_without_operator`), and `execute` is refused meanwhile. False changes nothing at once: a
        page that is reloaded has those 2 s to come back.
        """
        with self._lock:
            if self._block is None or not self._stop_without_operator:
                return
            counters = self._block.counters
            if present or counters[Counter.OPERATOR_BEAT] == 0:
                counters[Counter.OPERATOR_BEAT] = time.monotonic_ns()

    def drain(self) -> NDArray[np.void]:
        """Returns every cycle recorded since the last call, oldest first.

        Returns:
            Structured array, see `cycle_dtype`: message_id, t, q, q_c, dq, command, faults, ... Cycles that were
            overwritten because nothing was drained for 30 s are missing; `lost` of the first row counts them.
        """
        with self._lock:
            self._require_block()
            return self._ring.drain()

    def open_reader(self) -> RingReader:
        """Returns a reader of the recorded cycles with a place of its own, beside `drain`; good until `close`."""
        with self._lock:
            return RingReader(self._require_block())

    def power_on(self) -> PendingRequest:
        """Asks for motor power."""
        return self._ask("power on", SetPower(True))

    def power_off(self) -> PendingRequest:
        """Asks for motor power to be taken away."""
        return self._ask("power off", SetPower(False))

    @property
    def stops(self) -> int:
        """How often `stop` has been called since `start`; what was wanted before the last one moves nothing."""
        with self._lock:
            return 0 if self._block is None else self._block.counters[Counter.STOPS_ASKED]

    def execute(
        self,
        motion: Motion,
        certificate: Certificate,
        mode: Mode = "joint_position",
        *,
        speed_override: float = 1.0,
        stops: int | None = None,
    ) -> PendingRequest:
        """Streams a checked motion; the request is done when the arm stands still again.

        It is checked once more before it is handed over, which takes up to some 0.2 s; a `stop` meanwhile counts.

        Args:
            motion: The motion.
            certificate: From `check(motion, model, mode=mode).certificate`.
            mode: How the arm is commanded: the same way as joint angles, as poses of the tool, or as torques; see
                `rcilab.execution.command_builder`.
            speed_override: Part of its planned speed that it begins with, 0.1 to 1; `set_speed_override` changes it.
            stops: What `stops` was when this was asked for; None: it is asked for now.

        Raises:
            InvalidValueError: The speed override is out of range.
            PlanningError: At this speed override it would break a condition, or last too long.
            CertificateError: The certificate is missing, or does not fit the motion, the model, or where the arm is.
            UsageError: The arm is moving, no controller is connected, no operator is present, the motion takes more
                than 300 s, the controller has not accepted its last configuration, or a stop has come meanwhile.
        """
        stops = self.stops if stops is None else stops
        require_admissible(
            motion,
            certificate,
            self.model,
            self.status(),
            is_operator_overdue=self._is_operator_overdue(),
            box=self._setup.wanted.box,
            mode=mode,
        )
        paced = plan_start(motion, speed_override, self.model, mode)
        with self._lock:
            self._require_unstopped(stops)
            self._setup.require_given()
            self._rows.begin(paced)
            self._override.begin(paced, self.model, mode)
            duration = paced.duration if paced.changed else motion.duration  # As planned it may end within a cycle.
            return self._ask("execute", Execute(rows=len(paced.q), duration=duration, mode=mode))

    def pause(self) -> PendingRequest:
        """Holds the motion in progress, along its path and within all limits; done once that is handed over.

        `resume` goes on; a motion that is held for more than 120 s is given up.

        Raises:
            UsageError: No motion of `execute` is in progress.
            PlanningError: It arrives before it could be held.
        """
        return self._override_of_motion().change(0.0)

    def resume(self, speed_override: float = 1.0) -> PendingRequest:
        """Goes on with a motion that is held; see `set_speed_override`."""
        return self.set_speed_override(speed_override)

    def set_speed_override(self, speed_override: float) -> PendingRequest:
        """Runs the motion in progress at part of its planned speed; done once that is handed over.

        The change is planned here, along the path, and checked by the conditions of the motion's mode before any of it
        is sent; that takes some 10 to 100 ms.

        Args:
            speed_override: 0.1 to 1.

        Raises:
            InvalidValueError: The speed override is out of range.
            UsageError: No motion of `execute` is in progress, or this machine is too busy.
            PlanningError: There is no way within the limits to change from here; the motion goes on as it is.
        """
        return self._override_of_motion().change(require_speed_override(speed_override))

    @property
    def paced(self) -> SpeedScaledMotion | None:
        """The motion of the last `execute` as it was really commanded, with every change of speed; None before."""
        with self._lock:
            self._require_block()
            return self._override.motion

    def _override_of_motion(self) -> SpeedOverride[PendingRequest]:
        with self._lock:
            self._require_block()
            return self._override

    def _require_cycle(self) -> int:
        cycle = self._motion_cycle()
        if cycle is None:
            raise UsageError("no motion runs whose speed override could change").coded("no_pace")
        return cycle

    def jog(
        self, kind: JogKind, values: ArrayLike, *, goes_on: PendingRequest | None = None, stops: int | None = None
    ) -> PendingRequest:
        """Moves the arm as long as it is held: call it at least five times a second, and `release_jog` at the end.

        The first call begins a jog, the next ones go on with it, whatever direction they ask for: on-line re-planning
        inside every limit of the joints. A jog that is not renewed for 0.3 s stops. It is a motion like any
        other, so the first movement comes when the controller shows its mode, 0.2 to 1 s after the first call; at rest
        it listens for another second.

        Args:
            kind: "joint", or "base" or "tool" for a twist of the tool in these axes.
            values: n joint velocities, [rad/s], or a twist of six numbers, linear first, [m/s, rad/s]; lowered to
                what the limits allow.
            goes_on: Request of the jog to go on with: where that has ended meanwhile, as by `stop`, none is begun.
            stops: What `stops` was when the jog was asked for; None: it is asked for now.

        Returns:
            The request of the jog; it is done when the arm stands still and no jog is held any more.

        Raises:
            InvalidValueError: The kind is unknown, or the values are not as many finite numbers as it needs.
            UsageError: Another motion is in progress, no controller is connected, no operator is present, or a stop
                has come meanwhile.
        """
        command = build_jog(kind, values, self.model.n)
        with self._lock:
            block = self._require_block()
            is_under_way = self._jogging is not None and not self._jogging.done
            if goes_on is not None and goes_on.done:
                raise UsageError("this jog has ended; begin another one").coded("jog_ended")
            if not is_under_way:
                self._require_unstopped(stops)
                self._setup.require_given()
                require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            hold_jog(block.jog, block.counters, command)
            if self._jogging is None or not is_under_way:
                self._jogging = self._ask("jog", Jog())
            return self._jogging

    def release_jog(self) -> None:
        """Brings a jog to rest at once."""
        with self._lock:
            if self._block is not None:
                release_jog(self._block.counters)

    def start_guiding(
        self, space: GuideSpace = "joint", kind: GuideKind = "free", *, stops: int | None = None
    ) -> PendingRequest:
        """Frees the arm for a hand to guide it (startDrag), until `stop_guiding` or `stop`; done once it is free.

        The phase is "moving" meanwhile and the code "moving.guided". It ends like a motion when no operator is at the
        controls any more, and by itself when the controller leaves it, as on a fault.

        Args:
            space: In joint space every joint is free, and `kind` has no effect.
            kind: What stays free in Cartesian space.
            stops: What `stops` was when this was asked for; None: it is asked for now.

        Raises:
            InvalidValueError: There is no such space or kind.
            ModelError: The arm has no hand guiding.
            UsageError: The arm is moving, no controller is connected, no operator is present, or a stop has come
                meanwhile.
        """
        require_guidable(space, kind)
        require_feature(self.model, "guiding")
        with self._lock:
            self._require_unstopped(stops)
            require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            self._setup.require_given()
            return self._ask("start guiding", StartGuiding(space, kind))

    def stop_guiding(self) -> PendingRequest:
        """Ends hand guiding (stopDrag); done once the arm stands still."""
        return self._ask("stop guiding", StopGuiding())

    def stop(self) -> PendingRequest:
        """Brings a running motion to rest within the limits, or ends guiding; done when the arm stands still."""
        with self._lock:
            block = self._require_block()
            release_jog(block.counters)
            block.counters[Counter.STOPS_ASKED] += 1
            return self._ask("stop", Stop(block.counters[Counter.STOPS_ASKED]))

    def _require_unstopped(self, stops: int | None) -> None:
        """Refuses what was wanted before the last stop, and all while not running; call with the lock."""
        self._require_block()
        if stops is not None and self.stops > stops:
            raise UsageError("a stop came before the arm had begun to move; ask again if it is to move").coded(
                "stopped_before"
            )

    def set_up(self, setup: RobotConfiguration) -> PendingRequest:
        """Sends a tool, a load, a safety box, a force-control frame; done once the controller has accepted all of it.

        From now on motions are checked with it, and it is sent again at every new connection.

        Args:
            setup: What to tell; parts that are None stay.

        Raises:
            InvalidValueError: It is not a configuration, or the load is heavier than the arm is rated for.
            ModelError: The arm lacks a part of it.
            UsageError: The arm is moving, or no controller is connected.
        """
        model = require_parts(self.model, setup).applied_to(self.model)
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            pending = self._ask("set up", Configure(setup))
            self._setup.follow(pending, setup)
            self.model = model
            return pending

    def set_output(self, signal: int, level: bool) -> PendingRequest:
        """Sets a digital output and reads the inputs again; the status shows both.

        Args:
            signal: Its number, from 0.
            level: Whether it is switched on.
        """
        outputs = capabilities_of(self.model).outputs
        return self._ask("set output", SetOutput(require_signal(signal, outputs), bool(level)))

    def read_inputs(self) -> PendingRequest:
        """Reads the digital inputs; the status shows them."""
        return self._ask("read inputs", ReadInputs())

    def reboot(self) -> PendingRequest:
        """Restarts the controller, which ends the connection; `reconnect` makes the next one, and sets all up again.

        Raises:
            UsageError: The arm is moving, or no controller is connected.
        """
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            return self._ask("reboot", Reboot())

    def recover(self) -> PendingRequest:
        """Asks the controller to clear its faults (automatic error recovery)."""
        return self._ask("recover", Recover())

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def _ask(self, what: str, request: Request) -> PendingRequest:
        """Sends a request to the control process."""
        with self._lock:
            self._require_block()
            if self._keeper.worker_pid is None:
                raise UsageError(
                    f"the control process is not running; restart() starts it again (asked: {what})"
                ).coded("not_connected")
            return self._client.send(what, request)

    def _open(self) -> None:
        """Makes the shared block and what works on it, and starts the processes."""
        block = ControlBlock.create(self.model.n, build_settings(self.model))
        address = None if self._target == VIRTUAL else self._target
        maker = maker_of(self.model)
        assert maker is not None  # It has a driver.
        try:
            self._keeper = ProcessSupervisor(
                block, self.model.name, self._plant, address, auto_restart=self._auto_restart
            )
            self._client = RequestClient(block)
            self._rows = SharedRows(
                block, self._lock, self._require_cycle, lambda request: self._ask("change of speed", request)
            )
            self._override, self._round_trip = SpeedOverride(self._rows), RoundTrip(block)
            self._reader, self._ring = StatusReader(block, maker), RingReader(block)
        except BaseException:
            block.close()
            raise
        self._is_closing.clear()
        self._block = block
        try:
            self._keeper.launch()
        except BaseException:
            self.close()
            raise

    def _await_connection(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while (status := self.status()).phase in ("starting", "connecting"):
            if time.monotonic() > deadline:
                raise ConnectionLostError(
                    f"not ready after {timeout:g} s ({status.message}); try again when the machine is less busy"
                ).coded("slow_start", seconds=f"{timeout:g}")
            time.sleep(_TICK / 2)
        if status.phase == "crashed":
            raise ConnectionLostError(status.message)

    def _watch(self) -> None:
        """The watching thread: heartbeats, replies, processes that ended. It never blocks."""
        while not self._is_closing.wait(_TICK):
            with self._lock:
                if self._block is None:
                    return
                self._block.counters[Counter.SUPERVISOR_BEAT] = time.monotonic_ns()
                self._collect_replies()
                self._bear_deaths()
                self._look_for_loss()
                if self._connecting is None and self._keeper.is_ready:
                    with suppress(UsageError):  # It died just now; the next look will tell.
                        self._connecting = self.reconnect()

    def _collect_replies(self) -> None:
        errors = self._client.collect()
        self._setup.look()
        for error in errors:
            if self._crash is None and isinstance(error, ConnectionLostError | ControlError | ModelError):
                shown = self._reader.read_snapshot()
                if shown.phase in ("lost", "fault"):
                    self._note(shown.code, str(error))

    def _bear_deaths(self) -> None:
        for death in self._keeper.look():
            self._connecting = None
            self._crash = death.code, death.message
            self._note(*self._crash)
            if death.is_worker:
                self._client.fail_all(ConnectionLostError(death.message))

    def _look_for_loss(self) -> None:
        """Notes a connection lost while no request was pending, unless the end of a process of ours explains it.

        A controller's death is known a little later than the end of its connection: hence more looks than one.
        """
        shown = self._reader.read_snapshot()
        is_lost = (
            shown.code in ("lost.unreachable", "lost.closed") and self._crash is None and self._connecting is not None
        )
        self._lost_looks = self._lost_looks + 1 if is_lost else 0
        if self._lost_looks == _LOSS_LOOKS:
            self._note(shown.code, shown.message)

    def _judge(self, shown: Snapshot) -> tuple[Phase, str, str]:
        """Returns phase, code and message: what we know of the processes goes before what one of them says."""
        if self._is_closing.is_set():
            return "closed", "closed", MESSAGES["closed"]
        if self._connecting is not None and self._connecting.done:
            self._crash = None
            return shown.phase, shown.code, shown.message
        if self._crash is not None:
            return "crashed", *self._crash
        if self._keeper.address is None:
            return "starting", "starting.controller", MESSAGES["starting.controller"]
        if self._connecting is None:
            return "starting", "starting", MESSAGES["starting"]
        return "connecting", "connecting", MESSAGES["connecting"].format(address=self._keeper.address)

    def _note(self, code: str, message: str) -> None:
        number = 1 if self._incident is None else self._incident.number + 1
        self._incident = Incident(number=number, code=code, message=message)
        self._lost_looks = _LOSS_LOOKS  # Once is enough.

    def _end_processes(self, reason: RcilabError) -> None:
        """Has the arm stopped, ends our processes, and fails what was in progress."""
        if self._keeper.worker_pid is not None:
            self._client.send_end()
        self._keeper.end()
        self._client.fail_all(reason)
        self._connecting, self._crash = None, None

    def _motion_cycle(self) -> int | None:
        with self._lock:
            self._require_block()
            shown = self._reader.read_snapshot()
            if shown.phase != "moving" or shown.motion_duration is None or shown.code not in ("moving", "moving.held"):
                return None
            return self._reader.read_cycle()

    def _read_override(self, shown: Snapshot) -> dict[str, Any]:
        paced = self._override.motion
        if paced is None or shown.motion_time is None:
            return {}
        place = paced.place_at(round(shown.motion_time / CYCLE_TIME))
        return {"motion_place": place, "speed_override": paced.override, "mode": self._override.mode}

    def _is_operator_overdue(self) -> bool:
        with self._lock:
            beat = self._block.counters[Counter.OPERATOR_BEAT] if self._block is not None else 0
        return beat != 0 and time.monotonic_ns() - beat > OPERATOR_TIMEOUT * 1e9

    def _require_block(self) -> ControlBlock:
        if self._block is None:
            raise UsageError("the supervisor is not running: start() it first").coded("not_connected")
        return self._block


def build_settings(model: RobotModel) -> Settings:
    """Returns what the control process needs to know of an arm when it starts."""
    return Settings(
        arm=ExpectedArm.of(model),
        limits=replace(model.limits, sources={}),
        T_flange_tool=model.T_flange_tool,
    )
