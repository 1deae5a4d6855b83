"""Configuration of a virtual controller."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, fields, replace
from typing import Literal, TypeAlias, get_args

from rcilab.cell.cell import Cell
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import RobotModel
from rcilab.sim.api import NetworkFaults, Stall
from rcilab.sim.arm_parameters import Floats
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.log_entry import LOG_FORMATS, LogFormat
from rcilab.sim.plants import REALISMS, Realism
from rcilab.sim.streamed_motion import PREFILL, TORQUE_PREFILL, LossBehaviour, require_loss_behaviour

PlantKind: TypeAlias = Literal["ideal", "mujoco"]
PLANT_KINDS: tuple[PlantKind, ...] = get_args(PlantKind)
ForceSign: TypeAlias = Literal["on-arm", "by-arm"]
"""Sign of reported external forces: exerted by the environment on the arm, or by the arm on the environment."""
FORCE_SIGNS: tuple[ForceSign, ...] = get_args(ForceSign)

ControllerOption: TypeAlias = Literal["auto_limit", "loop_back", "on_loss", "force_sign", "mode_delay", "lockstep"]
"""Options that the controllers of some makers lack."""
CONTROLLER_OPTIONS: tuple[ControllerOption, ...] = get_args(ControllerOption)

DEFAULT_HOST = "127.0.0.2"
"""Loopback, but not the client's own address: a vendor's client may bind the UDP port of every address of its machine,
as that of the RCI does, and would otherwise receive its own commands as states."""

SUPERVISED_PREFILL = 40
"""`prefill` of the page's own controller, [cycles]: an open browser causes pauses of tens of ms. `PREFILL` and
`TORQUE_PREFILL` are for a client without one."""
MODE_DELAY = 0.2
"""From StartMove to the requested modes, [s]; by then a vendor client's buffer is full of idle states, which it
skips."""
LOCKSTEP_MODE_DELAY = 0.02  # [s]
VENDOR_MODE_DELAY = 1.05
"""For a vendor's client with any buffer, [s]: it sleeps for 1 s after StartMove, then answers the states in it."""

FEWEST_LOST, MOST_LOST = 10, 20  # Manual 4.6: the packet-loss threshold is usually 10 to 20.


def require_option(name: str, value: object, options: Collection[str], model: str) -> None:
    """Requires that the controller of an arm has an option.

    Args:
        name: One of `CONTROLLER_OPTIONS`.
        value: Its requested value.
        options: Those that the controller has.
        model: Name of the arm.

    Raises:
        InvalidValueError: It has not.
    """
    if name not in options:
        raise InvalidValueError(name, value, f"cannot be set: the controller of {model} has no such option")


def require_plant(plant: object, realism: object = "off") -> None:
    """Requires a plant of the virtual controller, and that it has joints of this realism.

    Raises:
        InvalidValueError: One is unknown, and the message lists the known ones; or they do not go together.
    """
    if plant not in PLANT_KINDS:
        raise InvalidValueError("plant", plant, f"is unknown; known: {', '.join(PLANT_KINDS)}")
    if realism not in REALISMS:
        raise InvalidValueError("realism", realism, f"is unknown; known: {', '.join(REALISMS)}")
    if realism != "off" and plant != "mujoco":
        raise InvalidValueError("realism", realism, "needs the plant mujoco: the ideal one has no friction")


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerConfig:
    """All options of a virtual controller.

    Raises:
        InvalidValueError: A value is out of range; the message says which and why.
    """

    model: str
    """Name of the arm, such as xMatePro7."""
    host: str = DEFAULT_HOST
    """Address to listen on."""
    port: int | None = None
    """TCP port; 0 takes any free one; None: the one that the maker's clients expect."""
    udp_port: int | None = None
    """UDP port for commands; None: the same number as the TCP port, as the vendor's client expects it; 0: any."""
    client_host: str | None = None
    """Destination of states from power-up on; None: the client that connects, from then on."""
    client_port: int | None = None
    """UDP port for states; None: the number of the TCP port, as the vendor's client expects it."""
    plant: PlantKind = "ideal"
    """Kind of plant: an arm that follows exactly, or a simulated one."""
    realism: Realism = "off"
    """"real": the joints of the MuJoCo plant have the friction and torque sensors of real ones."""
    lockstep: bool = False
    """Whether a motion advances only when the command for the current state has arrived, instead of at 1 kHz."""
    mode_delay: float | None = None
    """From StartMove to the requested modes, [s]; None: 0.2, or 0.02 in lock-step."""
    prefill: int | None = None
    """Cycles by which the playback of commands is delayed, to absorb jitter; None: 10, or 0 in lock-step, and
    2 for torques."""
    patience: float | None = None
    """Timeout for a command before it counts as lost, [s]. None: in lock-step 60, so that a client may be paused in a
    debugger, or 0.05 while corruption is simulated; by the clock that of the maker; 0: none."""
    lost_limit: int | None = MOST_LOST
    """Lost commands in a row that are an instability, 10 to 20; None: no number is. While commands are held, one counts
    as lost when it is more than 30 cycles late."""
    on_loss: LossBehaviour | None = None
    """What the arm does while commands are missing: it holds the last one, with the response of its servo, as a real
    xMatePro3 does; or the motion is bridged, with the acceleration of the last commands. None: as the maker's arms."""
    auto_limit: bool = False
    """Whether commanded joint angles are stopped inside the soft limits, instead of raising a fault beyond them."""
    loop_back: bool = False
    """Whether every digital output is wired to the input of the same number."""
    limit_table: str | None = None
    """Whose Cartesian limits commands are checked against: "manual", or "sdk" for those of the vendor's library; None:
    the maker's default."""
    force_sign: ForceSign | None = None
    """Sign of `tau_ext_in_base` and `tau_ext_in_stiff`; None: on-arm. That of a real arm is not verified: the manual
    does not say."""
    start: Floats | None = None
    """Joint angles at power-up, shape (n,), [rad]; None: the home pose of the arm."""
    tool: Pose | None = None
    """Pose of the tool in the flange frame, as set on the teach pendant; None: the flange."""
    load: Payload | None = None
    """Load at the flange, as set on the teach pendant; None: none."""
    cell: Cell | None = None
    """What the arm carries and what stands around it, in place of `tool` and `load`; solid in the MuJoCo plant. None:
    neither."""
    safety_box: SafetyBox | None = None
    """Safety box, as set on the teach pendant; None: none."""
    soft_limits: tuple[Floats, Floats] | None = None
    """Lower and upper soft limits of the joints, as set on the teach pendant, shape (n,) each, [rad]; None: the arm's
    own."""
    inputs: tuple[int, ...] = ()
    """Numbers of the digital inputs that are high, from 0."""
    fresh: bool = False
    """Whether to forget what a client has stored in the controller, for makers whose controllers keep settings."""
    generation: int | None = None
    """Generation of the controller that clients see, for makers with several; None: the maker's default."""
    network: NetworkFaults = field(default_factory=NetworkFaults)
    """Simulated network faults, from power-up on."""
    states_network: NetworkFaults | None = None
    """The same for the direction to the client alone, states and TCP; None: as `network`. `network` then applies to
    commands only."""
    stalls: tuple[Stall, ...] = ()
    """Pauses of the controller's clock; their `after` counts from the start of `run`."""
    world_port: int | None = 0
    """TCP port of the simulation port, on loopback; 0: any free one; None: no simulation port."""
    log_format: LogFormat = "text"
    """Lines of the log on stderr: text, or one JSON object each."""
    is_recorded: bool = False
    """Whether every cycle is written to shared memory, for recorders and pages that watch."""
    realtime: bool = True
    """Whether to request SCHED_FIFO and locked memory; in lock-step, too, because a client may wait only briefly."""
    parent_pid: int | None = None
    """Id of the parent process, with which this one ends; None: it has no parent."""

    def __post_init__(self) -> None:
        """Checks every value."""
        for name in ("port", "udp_port", "client_port", "world_port"):
            port = getattr(self, name)
            lowest = 1 if name == "client_port" else 0
            if port is not None and not lowest <= port <= 65535:
                raise InvalidValueError(name, port, f"is not a valid port; must be {lowest} to 65535")
        if not self.host:
            raise InvalidValueError("host", self.host, "is not a valid address; use 127.0.0.2 for this machine only")
        require_plant(self.plant, self.realism)
        if self.force_sign is not None and self.force_sign not in FORCE_SIGNS:
            raise InvalidValueError("force_sign", self.force_sign, f"is unknown; known: {', '.join(FORCE_SIGNS)}")
        if self.log_format not in LOG_FORMATS:
            raise InvalidValueError("log_format", self.log_format, f"is unknown; known: {', '.join(LOG_FORMATS)}")
        if self.on_loss is not None:
            require_loss_behaviour(self.on_loss)
        if self.mode_delay is not None and not 0.0 <= self.mode_delay <= 5.0:
            raise InvalidValueError("mode_delay", self.mode_delay, "needs 0 to 5 s")
        by_clock = not self.lockstep and self.patience == 0.0
        if not (self.patience is None or by_clock or 0.01 <= self.patience <= 3600.0):
            raise InvalidValueError("patience", self.patience, "needs 0.01 to 3600 s, or 0 without lock-step")
        if self.prefill is not None and not 0 <= self.prefill <= 100:
            raise InvalidValueError("prefill", self.prefill, "needs 0 to 100 cycles")
        if self.cell is not None and not (self.tool is None and self.load is None):
            raise InvalidValueError(
                "cell", self.cell.name or "it", "has the tool and the load of the arm: leave out other ones"
            )
        if self.lost_limit is not None and not FEWEST_LOST <= self.lost_limit <= MOST_LOST:
            raise InvalidValueError(
                "lost_limit",
                self.lost_limit,
                f"needs {FEWEST_LOST} to {MOST_LOST} cycles; 0 on the command line or in a file is no limit",
            )

    def require_options(self, options: Collection[str]) -> None:
        """Requires that only options are set that the arm's controller has.

        Args:
            options: Those of `CONTROLLER_OPTIONS` that it has.

        Raises:
            InvalidValueError: Another one is set; the message names it.
        """
        defaults = {option.name: option.default for option in fields(self)}
        for name in CONTROLLER_OPTIONS:
            value = getattr(self, name)
            if value != defaults[name]:
                require_option(name, value, options, self.model)

    def setup(self, model: RobotModel) -> ArmSetup | None:
        """Returns the configuration of the arm; None if it is that after delivery.

        Args:
            model: The arm, whose home pose stands for `start` of None, so that it is checked, too.

        Raises:
            InvalidValueError: The cell is that of another arm, or its load is too heavy.
        """
        carried = None if self.cell is None else self.cell.applied_to(model)
        parts = ArmSetup(
            q=self.start,
            T_flange_tool=self.tool if carried is None else carried.T_flange_tool,
            load=self.load if carried is None else carried.load,
            safety_box=self.safety_box,
            soft_limits=self.soft_limits,
        )
        home = tuple(model.home.tolist())
        return None if parts.is_empty else replace(parts, q=home if self.start is None else self.start)

    @property
    def mode_delay_cycles(self) -> int:
        """Cycles from StartMove to the requested modes."""
        delay = self.mode_delay if self.mode_delay is not None else LOCKSTEP_MODE_DELAY if self.lockstep else MODE_DELAY
        return round(delay / CYCLE_TIME)

    @property
    def prefill_cycles(self) -> int:
        """Cycles by which the playback of commands is delayed."""
        return self.prefill if self.prefill is not None else 0 if self.lockstep else PREFILL

    @property
    def torque_prefill_cycles(self) -> int:
        """Cycles by which the playback of torques is delayed, in lock-step as by the clock."""
        return TORQUE_PREFILL if self.prefill is None else self.prefill
