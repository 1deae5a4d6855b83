"""The status of the supervisor: one frozen snapshot of arm, processes and timing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointVector
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.fault import FaultCode
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, Mode, RobotMode
from rcilab.makers.configuration import RobotConfiguration

__all__ = ["MESSAGES", "PHASES", "Incident", "Lateness", "Phase", "SupervisorStatus", "cycle_dtype"]

Phase: TypeAlias = Literal["starting", "connecting", "idle", "moving", "stopping", "fault", "lost", "crashed", "closed"]

PHASES: tuple[Phase, ...] = (
    "starting",  # the processes are being started
    "connecting",  # the control process is trying to reach the controller
    "idle",  # states arrive; the arm is stationary and accepts requests
    "moving",  # a motion is being streamed, or the arm is guided by hand (code "moving.guided")
    "stopping",  # a motion is being stopped before its end
    "fault",  # the controller has error bits set; recover() clears them
    "lost",  # no states arrive, or the controller closed the connection; reconnect() tries again
    "crashed",  # a process has ended unexpectedly, or did not start; it is being restarted, or restart() does so
    "closed",  # before start() and after close()
)

MESSAGES: dict[str, str] = {
    "closed": "The supervisor is closed.",
    "starting": "Starting the control process.",
    "starting.controller": "Starting the virtual controller.",
    "connecting": "Connecting to {address}.",
    "idle": "Ready.",
    "idle.unpowered": "Ready; motor power is off.",
    "idle.arrived": "The motion is finished.",
    "idle.stopped": "The motion was stopped on request; the arm is stationary.",
    "idle.operator": "The motion was stopped: no operator was present for {seconds:g} s.",
    "idle.failed": "The last request failed: {error}",
    "idle.held": "The motion was cancelled: it was held for more than {seconds:g} s.",
    "idle.guided": "Hand guiding has ended; the arm is stationary.",
    "idle.jogged": "The jog has ended; the arm is stationary.",
    "moving": "The arm is moving.",
    "moving.held": "The motion is held; resume continues it.",
    "moving.jog": "The arm is jogged.",
    "moving.guided": "Hand guiding: the arm is weightless and moves where it is pushed.",
    "stopping": "The arm is stopping.",
    "stopping.operator": "No operator is present: the arm is stopping.",
    "fault": "The controller stopped the arm: {faults}. Use recover.",
    "fault.pressed": "An emergency stop or the safety gate holds the arm: release it, then power on.",
    "fault.released": "The emergency stop is released, or the gate closed; power_on() clears its error bit.",
    "lost.unreachable": "{error}",
    "lost.closed": "{error}",
    "lost.rebooted": "{address} restarts; reconnect once it is up.",
    "lost.other_arm": "{error}",
    "lost.silent": "{address} has stopped sending states; reconnect tries again.",
    "crashed.controller": "The virtual controller has ended unexpectedly ({how}); {next}. The arm is then at its "
    "initial pose{power}.",
    "crashed.worker": "The control process has ended unexpectedly ({how}); {next}.",
    "crashed.slow_start": "{error}",
    "crashed.no_start": "{error}",
    "crashed.frozen": "The control process has not responded for {seconds:.1f} s; {next}.",
}
"""Messages by code, for translation; names in braces are placeholders."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Incident:
    """A failure that remains relevant after the phase has changed."""

    number: int
    """Number of the incident since the start; a change shows a new one."""
    code: str
    """Key of `MESSAGES`."""
    message: str
    """One English sentence."""
    is_restarted: bool = False
    """Whether it is the end of a process of ours that is being started again."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lateness:
    """Lateness of cycles relative to the robot's 1 ms grid, since the connection was made, [us].

    Cycles without a motion are included, one in five: the control process waits for no more while the arm is
    stationary. They show what the machine is capable of before a motion. During a motion it waits for every cycle; that
    lateness is in the rows of `drain()` with a finite `t`.

    Percentiles come from a logarithmic histogram and are accurate to about 4 %; the maximum is exact.
    """

    p50: float = 0.0
    p99: float = 0.0
    p999: float = 0.0
    max: float = 0.0
    cycles: int = 0
    """Number of cycles."""
    edges: NDArray[np.float64] = field(default_factory=lambda: np.zeros(1))
    """Edges of the histogram's bins, shape (B + 1,), [us]."""
    histogram: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Cycles per bin, shape (B,)."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SupervisorStatus:
    """A snapshot of everything. Cheap enough for the display's frame rate."""

    phase: Phase = "closed"
    """See `PHASES`."""
    code: str = "closed"
    """Code of the message, a key of `MESSAGES`."""
    message: str = MESSAGES["closed"]
    """One English sentence for the status line."""
    incident: Incident | None = None
    """The latest failure, also after it was repaired; None without one."""
    target: str = "virtual"
    """"virtual", or the address it was started with."""
    address: str | None = None
    """Address of the controller, such as rci://127.0.0.2:40123; None while it has none."""
    world_address: str | None = None
    """Address of its simulation port, HOST:PORT (`execution.simulation_control`); None without one."""
    q: JointVector | None = None
    """Measured joint angles, shape (n,), [rad]; None before the first state."""
    q_c: JointVector | None = None
    """Commanded joint angles, shape (n,), [rad]; plan the next motion from here."""
    dq: JointVector | None = None
    """Measured joint velocities, shape (n,), [rad/s]."""
    tau_ext: Array | None = None
    """External wrench as estimated by the controller, base axes, shape (6,), [N, N m]."""
    T_flange_tool: Pose | None = None
    """The controller's tool, from the poses it reports at standstill; None while unknown."""
    setup: RobotConfiguration = field(default_factory=RobotConfiguration)
    """The configuration that the controller has accepted since it was connected."""
    reported: RobotConfiguration = field(default_factory=RobotConfiguration)
    """What it has reported of its configuration since; None for what its interface does not report."""
    setup_times: int = 0
    """Number of connections at which the controller has accepted a configuration."""
    robot_mode: RobotMode | None = None
    controller_mode: ControllerMode | None = None
    faults: tuple[FaultCode, ...] = ()
    """Error bits that are set."""
    powered: bool | None = None
    """Motor power; None while unknown."""
    inputs: tuple[bool, ...] | None = None
    """Levels of the digital inputs when last read; None: not read on this connection."""
    outputs: tuple[bool | None, ...] = ()
    """Levels of the digital outputs as set on this connection; None: not set (a controller does not report them)."""
    awaited: int | None = None
    """Number of the digital input that the motion waits for; None: none."""
    success_rate: float = 0.0
    """Share of commands that arrived in time, as the controller reports it, 0 to 1."""
    rate_hz: float = 0.0
    """States received over the last second, [1/s]."""
    message_id: int = 0
    """Number of the newest controller cycle."""
    scheduling: Literal["SCHED_FIFO", "normal"] = "normal"
    """How the control process is scheduled."""
    memory_locked: bool = False
    """Whether the memory of the control process is locked, so that it cannot be swapped out."""
    round_trip: float | None = None
    """Time from a command to the state that reports it as commanded, including the controller's jitter buffer, in the
    latest motion in joint angles, [s]; None before the first."""
    answer_time: float | None = None
    """Time from the arrival of a state to its answer, median over the last second of the latest motion, [s]."""
    late_cycles: int = 0
    """Cycles more than 1 ms late since the connection was made, with or without a motion; see `Lateness`."""
    lost_cycles: int = 0
    """Controller cycles whose state was not received, since the connection was made."""
    lateness: Lateness = field(default_factory=Lateness)
    motion_time: float | None = None
    """Time since the first command of the present or last motion, [s]; None before the first motion."""
    motion_duration: float | None = None
    """Planned duration of that motion at its speed override, [s]."""
    motion_plan_time: float | None = None
    """Time in the plan of that motion, [s]; less than `motion_time` if it ran slower or was held."""
    speed_override: float = 1.0
    """Speed override of that motion, present or requested; 0 if it is held."""
    mode: Mode = "joint_position"
    """Command mode of that motion."""
    controller_pid: int | None = None
    """Process id of the virtual controller; None without one or when it is not running."""
    worker_pid: int | None = None
    """Process id of the control process; None when it is not running."""

    @property
    def is_pressed(self) -> bool:
        """Whether an emergency stop or the safety gate holds the arm."""
        return self.robot_mode is RobotMode.USER_STOPPED
