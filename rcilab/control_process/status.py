"""What the supervisor reports to the rest of the program: one frozen snapshot of arm, processes and timing."""

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
    "starting",  # our processes are being started
    "connecting",  # the control process is trying to reach the controller
    "idle",  # states arrive; the arm stands still and takes requests
    "moving",  # a motion is being streamed, or the arm is free for a hand to guide it (code "moving.guided")
    "stopping",  # a motion is being stopped before its end
    "fault",  # the controller has error bits set; recover() leads out
    "lost",  # no states arrive, or the controller closed the connection; reconnect() tries again
    "crashed",  # a process of ours has died; it is started again, or restart() does it
    "closed",  # close() was called, or start() never was
)

MESSAGES: dict[str, str] = {
    "closed": "The supervisor is closed.",
    "starting": "Starting the control process.",
    "starting.controller": "Starting the virtual controller.",
    "connecting": "Connecting to {address}.",
    "idle": "Ready.",
    "idle.unpowered": "Ready; motor power is off.",
    "idle.arrived": "The motion is finished.",
    "idle.stopped": "The motion was stopped on request; the arm stands still.",
    "idle.operator": "The motion was stopped: nobody was at the controls for {seconds:g} s.",
    "idle.failed": "The last request failed: {error}",
    "idle.held": "The motion was given up: it was held for more than {seconds:g} s.",
    "idle.guided": "Hand guiding has ended; the arm stands still.",
    "idle.jogged": "The arm stands where it was jogged to.",
    "moving": "The arm is moving.",
    "moving.held": "The motion is held; it can go on.",
    "moving.jog": "The arm is moved by hand: it follows what is held.",
    "moving.guided": "Hand guiding: the arm is weightless and goes where it is pushed.",
    "stopping": "The arm is being brought to rest.",
    "stopping.operator": "Nobody is at the controls: the arm is being brought to rest.",
    "fault": "The controller stopped the arm: {faults}. Recover leads out.",
    "fault.pressed": "An emergency stop or the safety gate holds the arm: release it, then power on.",
    "fault.released": "The emergency stop is released, or the gate closed; power_on() clears its error bit.",
    "lost.unreachable": "{error}",
    "lost.closed": "{error}",
    "lost.rebooted": "{address} restarts; reconnect once it is up.",
    "lost.other_arm": "{error}",
    "lost.silent": "{address} has stopped sending states; reconnect tries again.",
    "crashed.controller": "The virtual controller has died ({how}); {next}. The arm is then at its wake-up pose, "
    "motor power off.",
    "crashed.worker": "The control process has died ({how}); {next}.",
    "crashed.frozen": "The control process has not answered for {seconds:.1f} s; {next}.",
}
"""Every message by its code, for translation; names in braces are filled in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Incident:
    """Something that went wrong and stays worth saying after the phase has moved on."""

    number: int
    """Counts up by one for every incident since the start; compare it to notice a new one."""
    code: str
    """Key of `MESSAGES`."""
    message: str
    """One English sentence."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lateness:
    """How late cycles were handled against the robot's own 1 ms grid, since the connection was made, [us].

    Cycles without a motion count, too, one in five: for so many the control process waits while the arm rests, and
    they show what the machine is capable of before anything moves. What a motion met, where it waits for every single
    one, is in its rows: `drain()`, where `t` is finite.

    Percentiles come from a logarithmic histogram and are right to about 4 %; the maximum is exact.
    """

    p50: float = 0.0
    p99: float = 0.0
    p999: float = 0.0
    max: float = 0.0
    cycles: int = 0
    """Cycles counted."""
    edges: NDArray[np.float64] = field(default_factory=lambda: np.zeros(1))
    """Edges of the histogram's bins, shape (B + 1,), [us]."""
    histogram: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Cycles a bin, shape (B,)."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SupervisorStatus:
    """One look at everything. Cheap: meant to be taken at the display's rate."""

    phase: Phase = "closed"
    """What is going on, see `PHASES`."""
    code: str = "closed"
    """Stable id of the message, a key of `MESSAGES`."""
    message: str = MESSAGES["closed"]
    """One English sentence for the status line."""
    incident: Incident | None = None
    """The latest thing that went wrong, also after it was repaired; None when nothing did."""
    target: str = "virtual"
    """"virtual", or the address it was started with."""
    address: str | None = None
    """Where the controller really is, such as rci://127.0.0.2:40123; None while it has none."""
    world_address: str | None = None
    """Address of its simulation port, HOST:PORT (`execution.simulation_control`); None: it is not ours, or has none."""
    q: JointVector | None = None
    """Measured joint angles, shape (n,), [rad]; None as long as no state has arrived."""
    q_c: JointVector | None = None
    """Commanded joint angles, shape (n,), [rad]; plan the next motion from here."""
    dq: JointVector | None = None
    """Measured joint velocities, shape (n,), [rad/s]."""
    tau_ext: Array | None = None
    """Force and moment from outside as the controller estimates them, base axes, shape (6,), [N, N m]."""
    T_flange_tool: Pose | None = None
    """The tool that the controller has, by the poses it reports at rest; None while unknown."""
    setup: RobotConfiguration = field(default_factory=RobotConfiguration)
    """What the controller has acknowledged of its configuration since it was connected; it cannot be read back."""
    setup_times: int = 0
    """At how many connections it has accepted a configuration."""
    robot_mode: RobotMode | None = None
    controller_mode: ControllerMode | None = None
    faults: tuple[FaultCode, ...] = ()
    """Error bits that are set."""
    powered: bool | None = None
    """Motor power; None while unknown."""
    inputs: tuple[bool, ...] | None = None
    """Levels of the digital inputs when they were read last; None: not read on this connection."""
    outputs: tuple[bool | None, ...] = ()
    """Levels of the digital outputs as set on this connection; None: not set (a controller cannot be asked)."""
    success_rate: float = 0.0
    """Share of commands that arrived in time, as the controller reports it, 0 to 1."""
    rate_hz: float = 0.0
    """States received over the last second, [1/s]."""
    message_id: int = 0
    """Number of the newest controller cycle."""
    scheduling: Literal["SCHED_FIFO", "normal"] = "normal"
    """How the control process is scheduled."""
    memory_locked: bool = False
    """Whether the control process's memory is kept from being paged out."""
    round_trip: float | None = None
    """From a command to the state that shows it as commanded, the controller's play-out included, as the newest motion
    of joint angles had it, [s]; None before the first."""
    answer_time: float | None = None
    """From a state's arrival to the answer, median of the newest motion's last second, [s]."""
    late_cycles: int = 0
    """Cycles handled more than 1 ms late since the connection was made, with or without a motion; see `Lateness`."""
    lost_cycles: int = 0
    """Controller cycles of which no state reached us, since the connection was made."""
    lateness: Lateness = field(default_factory=Lateness)
    motion_time: float | None = None
    """Time since the first command of the running (or last) motion, [s]; None before the first one."""
    motion_duration: float | None = None
    """How long that motion is planned to take, at the speed override it has, [s]."""
    motion_place: float | None = None
    """Where in its plan that motion is, [s]; behind `motion_time` when it ran slower or was held."""
    speed_override: float = 1.0
    """Part of its planned speed that it runs at, or comes to; 0 when it is held."""
    mode: Mode = "joint_position"
    """How the arm is commanded in it."""
    controller_pid: int | None = None
    """Process id of the virtual controller; None when it is not ours or not running."""
    worker_pid: int | None = None
    """Process id of the control process."""

    @property
    def is_pressed(self) -> bool:
        """Whether an emergency stop or the safety gate holds the arm."""
        return self.robot_mode is RobotMode.USER_STOPPED
