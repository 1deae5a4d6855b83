"""The supervisor: the interface of the control process to the rest of the program."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.cell.cell import Cell
from rcilab.conformance.free_elbow import resulting_motion
from rcilab.conformance.speed_scaling_check import plan_start_with_override
from rcilab.control_process.configuration_sync import ConfigurationSync, standard_setup
from rcilab.control_process.jog_record import hold_jog, release_jog
from rcilab.control_process.layout import OPERATOR_TIMEOUT, ControlBlock, Counter
from rcilab.control_process.messages import (
    Configure,
    Execute,
    Jog,
    ReadInputs,
    Reboot,
    Recover,
    Request,
    SetOutput,
    SetPower,
    StartGuiding,
    Stop,
    StopGuiding,
    WorkerSettings,
)
from rcilab.control_process.motion_upload import SharedRows, require_admissible, require_ready
from rcilab.control_process.process_monitor import ProcessMonitor
from rcilab.control_process.requests import PendingRequest
from rcilab.control_process.snapshot import Snapshot
from rcilab.control_process.status import SupervisorStatus
from rcilab.control_process.status_reader import RoundTrip
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.closeable import Closeable
from rcilab.core.cycle_ring import RingReader
from rcilab.core.errors import UsageError
from rcilab.core.memory import memory_needed
from rcilab.core.state import Mode
from rcilab.execution.guiding import require_guidable
from rcilab.execution.jog import JogKind, build_jog
from rcilab.execution.speed_override import SpeedOverride
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import ExpectedArm, GuideKind, GuideSpace, parse_address, require_signal
from rcilab.makers.maker import capabilities_of, require_driver, require_feature, require_parts
from rcilab.model.robot_model import require_model
from rcilab.motion.motion_event import cycle_events
from rcilab.motion.speed_scaling import SpeedScaledMotion, require_speed_override
from rcilab.sim.controller_config import require_plant

if TYPE_CHECKING:
    from rcilab.conformance.certificate import Certificate
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

__all__ = ["PendingRequest", "Supervisor"]

VIRTUAL = "virtual"


class Supervisor(Closeable):
    """Runs motions in a separate process, so that the page cannot delay a cycle.

    All methods may be called from any thread. Requests return a `PendingRequest` at once; only `start()`, `restart()`
    and `close()` wait for the robot. A `ProcessMonitor` owns the processes and their shared memory.

    Args:
        model: The arm.
        target: "virtual" for a private virtual controller on loopback, or the address of a controller, rci://HOST:PORT.
        plant: Plant of the virtual controller: "ideal" or "mujoco".
        stop_without_operator: Whether a motion is stopped when no operator has been present for 2 s (see
            `set_operator_present`). False lets it finish; intended for the virtual controller.
        auto_restart: Whether a process that ended unexpectedly is restarted automatically (at most 3 times a minute).
        setup: The configuration to send at every connection. None: the model's tool and load to a virtual controller,
            nothing to a real one, which has its own.
        cell: Cell of the virtual controller, solid in "mujoco"; None without one.

    Raises:
        InvalidValueError: The target is not a valid address, the model is not a robot model, or the plant is unknown.
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
        cell: Cell | None = None,
    ) -> None:
        self.model = require_driver(require_model(model))
        require_plant(plant)
        self._target = VIRTUAL if target == VIRTUAL else str(parse_address(target, self.model))
        if setup is None:
            setup = standard_setup(self.model, is_virtual=self._target == VIRTUAL)
        self.model = require_parts(self.model, setup).applied_to(self.model)
        self._setup = ConfigurationSync(setup)
        address = None if self._target == VIRTUAL else self._target
        self._monitor = ProcessMonitor(plant, address, self._setup, auto_restart=auto_restart, cell=cell)
        self._lock = self._monitor.lock
        self._stop_without_operator = stop_without_operator
        self._executing: PendingRequest | None = None  # The last motion.
        self._jogging: PendingRequest | None = None

    def start(self, timeout: float = 20.0) -> None:
        """Starts the processes and returns once states arrive or the connection has failed.

        An unreachable robot is not an error: the phase is then "lost", and `reconnect()` tries again.

        Args:
            timeout: Timeout, [s].

        Raises:
            ConnectionLostError: A process could not be started; the message contains its output.
            UsageError: It was started before, or memory is short.
        """
        with self._lock:
            if self._monitor.block is not None:
                raise UsageError("the supervisor has been started already; use restart(), or create another one")
        try:
            with memory_needed():
                with self._lock:
                    self._open()
                    self._monitor.launch()
                self._monitor.await_connection(timeout)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stops a running motion, ends the processes and frees the shared memory. May be called twice."""
        self._monitor.close()

    def restart(self, timeout: float = 20.0) -> None:
        """Ends the processes in any state, starts them again and returns once states arrive.

        Args:
            timeout: Timeout, [s].

        Raises:
            ConnectionLostError: A process could not be started; the message contains its output.
            UsageError: It was never started.
        """
        self._monitor.restart()
        self._monitor.await_connection(timeout)

    def status(self) -> SupervisorStatus:
        """Returns a snapshot; cheap enough for the display's frame rate."""
        with self._lock:
            monitor = self._monitor
            if monitor.block is None:
                return SupervisorStatus(target=self._target, incident=monitor.incident)
            shown = monitor.reader.read_snapshot()
            phase, code, message = monitor.find_phase(shown)
            fields = monitor.reader.read_fields(shown)
            if phase in ("crashed", "lost", "starting"):
                fields |= {"rate_hz": 0.0, "robot_mode": None, "controller_mode": None}  # No longer reported.
            return SupervisorStatus(
                phase=phase,
                code=code,
                message=message,
                incident=monitor.incident,
                target=self._target,
                address=monitor.processes.address,
                world_address=monitor.processes.world_address,
                controller_pid=monitor.processes.controller_pid,
                worker_pid=monitor.processes.worker_pid,
                setup=self._setup.acknowledged,
                reported=self._setup.reported,
                setup_times=self._setup.connections,
                **fields,
                **self._read_override(shown),
                **self._round_trip.read_fields(),
            )

    def reconnect(self) -> PendingRequest:
        """Closes the connection to the controller and opens a new one.

        Raises:
            UsageError: There is no controller to connect to: the virtual one has ended; `restart()` restarts it.
        """
        return self._monitor.connect()

    def set_operator_present(self, present: bool) -> None:
        """Reports whether an operator is present; call it with True at least once a second while one is.

        Before the first call no operator is expected. From then on, a motion is stopped when the last True is more than
        2 s old (`stop_without_operator`), and `execute` is refused. False has no immediate effect, so that a page can
        be reloaded within 2 s.
        """
        with self._lock:
            block = self._monitor.block
            if block is None or not self._stop_without_operator:
                return
            counters = block.counters
            if present or counters[Counter.OPERATOR_HEARTBEAT] == 0:
                counters[Counter.OPERATOR_HEARTBEAT] = time.monotonic_ns()

    def drain(self) -> NDArray[np.void]:
        """Returns every cycle recorded since the last call, oldest first.

        Returns:
            Structured array, see `cycle_dtype`: message_id, t, q, q_c, dq, command, faults, ... Cycles that were
            overwritten because the last call was more than 30 s ago are missing; `lost` of the first row includes them.
        """
        with self._lock:
            self._require_block()
            return self._ring.drain()

    def open_reader(self) -> RingReader:
        """Returns a reader of the recorded cycles, independent of `drain`; valid until `close`."""
        with self._lock:
            return self._require_block().open_reader()

    def power_on(self) -> PendingRequest:
        """Requests motor power on."""
        return self._send("power on", SetPower(True))

    def power_off(self) -> PendingRequest:
        """Requests motor power off."""
        return self._send("power off", SetPower(False))

    @property
    def stops(self) -> int:
        """Number of calls of `stop` since `start`: a request for motion made before the last of them is refused."""
        with self._lock:
            block = self._monitor.block
            return 0 if block is None else block.counters[Counter.STOPS_REQUESTED]

    def execute(
        self,
        motion: Motion,
        certificate: Certificate,
        mode: Mode = "joint_position",
        *,
        speed_override: float = 1.0,
        stops: int | None = None,
    ) -> PendingRequest:
        """Streams a checked motion; the request is done when the arm is stationary again.

        The motion is verified again before it is sent, which takes up to 0.2 s; a `stop` during that time counts.

        Args:
            motion: The motion.
            certificate: From `check(motion, model, mode=mode).certificate`.
            mode: Command mode: the same motion as joint angles, as poses of the tool, or as torques; see
                `rcilab.execution.motion_executor`.
            speed_override: Initial speed override, 0.1 to 1; `set_speed_override` changes it.
            stops: Value of `stops` when the operator requested this; None: its value now.

        Raises:
            InvalidValueError: The speed override is out of range.
            PlanningError: At this speed override the motion would violate a condition, or take too long.
            CertificateError: The certificate is missing, or does not fit the motion, the model, or the position of the
                arm.
            UsageError: The arm is moving, no controller is connected, no operator is present, the motion takes more
                than 300 s, the controller has not accepted its last configuration, or a stop was requested meanwhile.
        """
        stops = self.stops if stops is None else stops
        require_admissible(
            motion,
            certificate,
            self.model,
            self.status(),
            is_operator_overdue=self._is_operator_overdue(),
            box=self._setup.requested.box,
            mode=mode,
        )
        motion = resulting_motion(motion, self.model, mode)
        scaled = plan_start_with_override(motion, speed_override, self.model, mode)
        with self._lock:
            self._require_unstopped(stops)
            self._setup.require_accepted()
            self._rows.begin(scaled)
            self._override.begin(scaled, self.model, mode)
            duration = scaled.duration if scaled.changed else motion.duration  # A plan may end within a cycle.
            events = cycle_events(scaled)
            self._executing = self._send(
                "execute", Execute(rows=len(scaled.q), duration=duration, mode=mode, events=events)
            )
            return self._executing

    def pause(self) -> PendingRequest:
        """Holds the motion in progress, on its path and within all limits; done once the control process has the rows.

        `resume` continues it; a motion that is held for more than 120 s is cancelled.

        Raises:
            UsageError: No motion of `execute` is in progress.
            PlanningError: It arrives before it could be held.
        """
        return self._override_of_motion().change(0.0)

    def resume(self, speed_override: float = 1.0) -> PendingRequest:
        """Continues a held motion; see `set_speed_override`."""
        return self.set_speed_override(speed_override)

    def set_speed_override(self, speed_override: float) -> PendingRequest:
        """Sets the speed override of the motion in progress; done once the control process has the rows.

        The change is planned here, on the path, and checked by the conditions of the motion's mode before it is sent;
        this takes 10 to 100 ms.

        Args:
            speed_override: 0.1 to 1.

        Raises:
            InvalidValueError: The speed override is out of range.
            UsageError: No motion of `execute` is in progress, or this machine is too busy.
            PlanningError: The change is not possible within the limits from here; the motion continues unchanged.
        """
        return self._override_of_motion().change(require_speed_override(speed_override))

    @property
    def scaled_motion(self) -> SpeedScaledMotion | None:
        """The motion of the last `execute` as commanded, with every change of speed; None before the first."""
        with self._lock:
            self._require_block()
            scaled, request = self._override.motion, self._executing
            return scaled if scaled is None or request is None else scaled.shifted(request.shifts)

    def _override_of_motion(self) -> SpeedOverride[PendingRequest]:
        with self._lock:
            self._require_block()
            return self._override

    def _require_cycle(self) -> int:
        cycle = self._motion_cycle()
        if cycle is None:
            raise UsageError("no motion is running whose speed override could change").coded("override_idle")
        return cycle

    def jog(
        self, kind: JogKind, values: ArrayLike, *, continues: PendingRequest | None = None, stops: int | None = None
    ) -> PendingRequest:
        """Jogs the arm: call it at least five times a second while a jog is held, and `release_jog` at the end.

        The first call starts a jog, further calls renew it, in the same or another direction: the motion is re-planned
        online within all limits of the joints. A jog that is not renewed for 0.3 s stops. It is a motion like any
        other, so the arm starts to move when the controller shows its mode, 0.2 to 1 s after the first call. It accepts
        another jog for 1 s after standstill.

        Args:
            kind: "joint", or "base" or "tool" for a twist of the tool in these axes.
            values: n joint velocities, [rad/s], or a twist of six numbers, linear first, [m/s, rad/s]; reduced to
                what the limits allow.
            continues: Request of the jog to continue: if it has ended, as after `stop`, no other one starts.
            stops: Value of `stops` when the operator requested the jog; None: its value now.

        Returns:
            The request of the jog; it is done when the arm is stationary and no jog is held.

        Raises:
            InvalidValueError: The kind is unknown, or the values are not the required number of finite numbers.
            UsageError: Another motion is in progress, no controller is connected, no operator is present, or a stop
                was requested meanwhile.
        """
        command = build_jog(kind, values, self.model.n)
        with self._lock:
            block = self._require_block()
            is_running = self._jogging is not None and not self._jogging.done
            if continues is not None and continues.done:
                raise UsageError("this jog has ended; start another one").coded("jog_ended")
            if not is_running:
                self._require_unstopped(stops)
                self._setup.require_accepted()
                require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            hold_jog(block.jog, block.counters, command)
            if self._jogging is None or not is_running:
                self._jogging = self._send("jog", Jog())
            return self._jogging

    def release_jog(self) -> None:
        """Stops a jog."""
        with self._lock:
            if self._monitor.block is not None:
                release_jog(self._monitor.block.counters)

    def start_guiding(
        self, space: GuideSpace = "joint", kind: GuideKind = "free", *, stops: int | None = None
    ) -> PendingRequest:
        """Starts hand guiding (startDrag), until `stop_guiding` or `stop`; done once the arm can be guided.

        The phase is "moving" meanwhile and the code "moving.guided". Like a motion, it ends when the operator is no
        longer present, and when the controller ends it, as on a fault.

        Args:
            space: In joint space every joint is free, and `kind` has no effect.
            kind: Free directions in Cartesian space.
            stops: Value of `stops` when the operator requested this; None: its value now.

        Raises:
            InvalidValueError: The space or the kind is unknown.
            ModelError: The arm has no hand guiding.
            UsageError: The arm is moving, no controller is connected, no operator is present, or a stop was requested
                meanwhile.
        """
        require_guidable(space, kind)
        require_feature(self.model, "guiding")
        with self._lock:
            self._require_unstopped(stops)
            require_ready(self.status(), is_operator_overdue=self._is_operator_overdue())
            self._setup.require_accepted()
            return self._send("start guiding", StartGuiding(space, kind))

    def stop_guiding(self) -> PendingRequest:
        """Ends hand guiding (stopDrag); done once the arm is stationary."""
        return self._send("stop guiding", StopGuiding())

    def stop(self) -> PendingRequest:
        """Stops a running motion within the limits, or ends guiding; done when the arm is stationary."""
        with self._lock:
            block = self._require_block()
            release_jog(block.counters)
            block.counters[Counter.STOPS_REQUESTED] += 1
            return self._send("stop", Stop(block.counters[Counter.STOPS_REQUESTED]))

    def _require_unstopped(self, stops: int | None) -> None:
        """Refuses a motion that was requested before the last stop; call it with the lock held."""
        self._require_block()
        if stops is not None and self.stops > stops:
            raise UsageError(
                "a stop was requested before the arm had started to move; repeat the request to move it"
            ).coded("stopped_before")

    def configure(self, setup: RobotConfiguration) -> PendingRequest:
        """Sends a configuration: tool, load, safety box, force-control frame; done once the controller has accepted it.

        From now on motions are checked with it, and it is sent again at every new connection.

        Args:
            setup: The configuration; parts that are None stay unchanged.

        Raises:
            InvalidValueError: It is not a configuration, or the load is heavier than the arm is rated for.
            ModelError: The arm lacks a part of it.
            UsageError: The arm is moving, or no controller is connected.
        """
        model = require_parts(self.model, setup).applied_to(self.model)
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            pending = self._send("set up", Configure(setup))
            self._setup.track(pending, setup)
            self.model = model
            return pending

    def set_output(self, signal: int, level: bool) -> PendingRequest:
        """Sets a digital output and reads the inputs again; the status shows both.

        Args:
            signal: Its number, from 0.
            level: Whether it is switched on.
        """
        outputs = capabilities_of(self.model).outputs
        return self._send("set output", SetOutput(require_signal(signal, outputs), bool(level)))

    def read_inputs(self) -> PendingRequest:
        """Reads the digital inputs; the status shows them."""
        return self._send("read inputs", ReadInputs())

    def reboot(self) -> PendingRequest:
        """Restarts the controller, which ends the connection; `reconnect` connects again and sends the configuration.

        Raises:
            UsageError: The arm is moving, or no controller is connected.
        """
        with self._lock:
            self._require_block()
            require_ready(self.status(), is_operator_overdue=False)
            return self._send("reboot", Reboot())

    def recover(self) -> PendingRequest:
        """Requests that the controller clears its faults (automatic error recovery)."""
        return self._send("recover", Recover())

    def __enter__(self) -> Supervisor:
        self.start()
        return self

    def _open(self) -> None:
        """Creates the shared block and what uses it here."""
        block = self._monitor.open(self.model, build_settings(self.model))
        self._rows = SharedRows(
            block, self._lock, self._require_cycle, lambda request: self._send("change of speed", request)
        )
        self._override, self._round_trip = SpeedOverride(self._rows), RoundTrip(block)
        self._ring = block.open_reader()

    def _send(self, what: str, request: Request) -> PendingRequest:
        return self._monitor.send(what, request)

    def _require_block(self) -> ControlBlock:
        return self._monitor.require_block()

    def _motion_cycle(self) -> int | None:
        with self._lock:
            self._require_block()
            reader = self._monitor.reader
            shown = reader.read_snapshot()
            if shown.phase != "moving" or shown.motion_duration is None or shown.code not in ("moving", "moving.held"):
                return None
            return reader.read_cycle()

    def _read_override(self, shown: Snapshot) -> dict[str, Any]:
        scaled = self._override.motion
        if scaled is None or shown.motion_time is None:
            return {}
        plan_time = scaled.plan_time_at(round(shown.motion_time / CYCLE_TIME))
        return {"motion_plan_time": plan_time, "speed_override": scaled.override, "mode": self._override.mode}

    def _is_operator_overdue(self) -> bool:
        with self._lock:
            block = self._monitor.block
            heartbeat = 0 if block is None else block.counters[Counter.OPERATOR_HEARTBEAT]
        return heartbeat != 0 and time.monotonic_ns() - heartbeat > OPERATOR_TIMEOUT * 1e9


def build_settings(model: RobotModel) -> WorkerSettings:
    """Returns the data of an arm that the control process needs at its start."""
    return WorkerSettings(
        arm=ExpectedArm.of(model),
        limits=replace(model.limits, sources={}),
        T_flange_tool=model.T_flange_tool,
    )
