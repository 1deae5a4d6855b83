"""`rcilab controller`: a virtual controller on this machine."""

from __future__ import annotations

import argparse
import os
import signal
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.arm_options import (
    JOINTS_FORM,
    SOFT_LIMITS_FORM,
    add_arm_options,
    add_cell_option,
    parse_box,
    parse_joints,
    parse_load,
    parse_soft_limits,
    parse_tool_and_load,
    read_cell,
)
from rcilab.cli.output import print_interruptibly
from rcilab.cli.signal_handlers import Handler, handled_signals

if TYPE_CHECKING:
    from rcilab.core.errors import InvalidValueError
    from rcilab.sim.api import NetworkFaults, Stall
    from rcilab.sim.arm_server import ArmServer
    from rcilab.sim.controller_config import ControllerConfig

DESCRIPTION = """\
Runs the virtual controller of an arm of ROKAE, Franka, UFACTORY or RealMan. Any client of the maker's interface can
connect to it: this package, or a program in C++ or Python that uses the maker's client library. It prints one line when
it is ready, a second one with the address of its simulation port, and ends on Ctrl-C.

--lockstep runs your unmodified program at the speed of the machine, several times real time, and loses no command at a
breakpoint or on a busy machine. FILE, or the options below, start the arm where yours stands.
"""

EPILOG = """A configuration file holds the settings of your arm's teach pendant and options of this command; options of
the command line take precedence over it. Numbers are in SI units; a text is as on the command line:

  [arm]
  model = "xMatePro7"
  start = "0,30,0,60,0,90,0deg"     # or a list of angles in rad
  di = [0, 3]                       # digital inputs that are high
  [tool]
  position = [0, 0, 0.12]           # in the flange frame
  rpy = "0,0,90deg"                 # turns about the fixed x, y and z axes
  [load]
  mass = 2.0                        # kg; also inertia: 9 numbers, kg m^2
  center_of_mass = [0, 0, 0.05]
  [box]
  size = [1.2, 1.2, 1.0]
  center = [0.4, 0, 0.5]            # in the base frame; also rpy
  [soft_limits]
  lower = "-160,-110,-160,-110,-160,-110,-350deg"
  upper = "160,110,160,110,160,110,350deg"
  [controller]
  plant = "mujoco"                  # every option of the first list but --model, with _ for -
  mode_delay = 0.2
"""

_OPTIONS = {
    "limit table": "limits",
    "client_host": "client",
    "client_port": "client",
    "joint angles": "start",
    "safety box": "box",
    "soft limits": "soft_limits",
    "digital input": "di",
}
"""Options whose names differ from those of their settings."""
_HOST = "127.0.0.2"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser(
        "controller",
        help="run a virtual controller",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        argument_default=argparse.SUPPRESS,  # An option that is not given may be in the file.
    )
    parser.add_argument(
        "file", nargs="?", type=Path, default=None, metavar="FILE", help="configuration of the arm, such as my_arm.toml"
    )
    parser.add_argument(
        "--model", metavar="NAME", help="arm, such as xMatePro7, FR3, xArm6 or RM65; required here or in the file"
    )
    parser.add_argument("--host", metavar="ADDR", help=f"address to listen on ({_HOST})")
    parser.add_argument(
        "--port", type=int, metavar="N", help="TCP port (default: that of the interface, RCI: 1337); 0: any free one"
    )
    parser.add_argument("--udp-port", type=int, metavar="N", help="UDP port for commands (as --port); 0: any free one")
    parser.add_argument(
        "--client",
        metavar="HOST[:PORT]",
        help="destination of the states from the start on, also without a connection (port: as --port)",
    )
    parser.add_argument("--plant", metavar="KIND", help="simulated arm: ideal or mujoco (ideal)")
    parser.add_argument(
        "--realism",
        metavar="KIND",
        help="real: friction, noise and steps of the torque readings as on a real arm (off; xMate and mujoco only)",
    )
    add_cell_option(
        parser,
        "its tool and load, in place of --tool and --load; with --plant mujoco its floor and obstacles, the tool and "
        "the held part are solid",
    )
    parser.add_argument(
        "--lockstep",
        action="store_true",
        help="advance a motion only when its commands arrive: your unmodified client runs as fast as this machine",
    )
    parser.add_argument(
        "--mode-delay",
        type=float,
        metavar="S",
        help="delay from StartMove to the new mode (xMate only: 1.05, for any client; lock-step: 0.02; 0.2 is enough "
        "for most)",
    )
    parser.add_argument(
        "--prefill",
        type=int,
        metavar="N",
        help="delay commands by N cycles, which absorbs jitter (xMate: 10, lock-step: 0, torques 2 in both; Franka: 0, "
        "it waits for commands, see --patience; the controllers of UFACTORY and RealMan delay nothing)",
    )
    parser.add_argument(
        "--patience",
        type=float,
        metavar="S",
        help="wait up to S for the command of a cycle before it counts as lost (by the clock: 0 for xMate, 0.02 for "
        "Franka; lock-step: 60, 0.05 with --corrupt); time then slips instead",
    )
    parser.add_argument(
        "--lost-limit",
        type=int,
        metavar="N",
        help="number of consecutive lost commands that stops a motion, 10 to 20; 0: none (20). With --on-loss "
        "hold, a command is lost when it is more than 30 ms late; with bridge, fewer stop a motion if the next command "
        "could only be reached with a jump: --prefill helps there",
    )
    parser.add_argument(
        "--on-loss",
        metavar="NAME",
        help="while commands are missing: hold the last one, as a real arm does, or bridge the gap (xMate only: hold)",
    )
    parser.add_argument(
        "--auto-limit",
        action="store_true",
        help="stop commands inside the soft joint limits, each joint by itself: with commanded poses the tool then "
        "leaves the commanded pose",
    )
    parser.add_argument(
        "--fresh", action="store_true", help="forget what a client has stored in the controller, as joint parameters"
    )
    parser.add_argument(
        "--generation",
        type=int,
        metavar="N",
        help="generation of the controller, where its maker has several: 3 or 4 (3)",
    )
    parser.add_argument("--loop-back", action="store_true", help="connect digital outputs to the inputs")
    parser.add_argument("--limits", metavar="TABLE", help="Cartesian limits: manual or sdk (RCI: manual; FCI: sdk)")
    parser.add_argument(
        "--force-sign",
        metavar="SIGN",
        help="sign of reported external forces: on-arm, as exerted on the arm, or by-arm, as exerted by it "
        "(xMate only: on-arm; that of a real arm is not verified)",
    )
    parser.add_argument(
        "--log-format", metavar="FORMAT", help="lines of the log on stderr: text, or json for one object each (text)"
    )
    parser.add_argument(
        "--record",
        metavar="FOLDER",
        help="write each motion of any client to FOLDER: a run (.rcirun, for rcilab replay and check) with every state "
        "and command, a report (.txt), and a line on stderr",
    )
    _add_arm_options(parser)
    _add_world_options(parser)
    _add_network_options(parser)
    parser.add_argument("--exit-with-parent", nargs="?", type=int, const=0, metavar="PID", help=argparse.SUPPRESS)
    parser.set_defaults(run=run)


def _add_arm_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(
        "configuration of the arm",
        "what its teach pendant holds, kept by a reboot; a value that begins with - follows =, as --tool=-10,0,120mm",
    )
    group.add_argument(
        "--start",
        metavar=JOINTS_FORM,
        help="joint angles at power-up, in rad without a unit: 0,30,0,60,0,90,0deg (home)",
    )
    add_arm_options(group)
    group.add_argument(
        "--soft-limits",
        metavar=SOFT_LIMITS_FORM,
        help="range of each joint, as --soft-limits=-160:160,-110:110,...deg (those of the arm)",
    )
    group.add_argument("--di", metavar="N,N,...", help="digital inputs that are high: 0,3")


def _add_world_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("simulation port", "control of the simulated environment of the robot")
    choice = group.add_mutually_exclusive_group()
    choice.add_argument("--world-port", type=int, metavar="N", help="TCP port, on loopback (any free one)")
    choice.add_argument("--no-world", action="store_true", help="no simulation port")


def _add_network_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("faults", "faults of the network and of the controller's clock")
    for name, meaning in (
        ("loss", "lost datagrams"),
        ("reorder", "datagrams overtaken by later ones"),
        ("duplicate", "datagrams that arrive twice"),
        ("corrupt", "datagrams with a flipped bit"),
    ):
        group.add_argument(f"--{name}", type=float, metavar="SHARE", help=f"share of {meaning}, 0 to 1")
    group.add_argument("--delay", type=float, metavar="S", help="delay of every datagram")
    group.add_argument("--jitter", type=float, metavar="S", help="largest random delay in addition")
    group.add_argument("--faults-on", metavar="DIRECTION", help="affected datagrams: commands, states or both (both)")
    group.add_argument("--tcp-delay", type=float, metavar="S", help="delay of every TCP reply")
    group.add_argument(
        "--tcp-split", nargs="?", type=int, const=1, metavar="N", help="send replies N bytes at a time (1)"
    )
    group.add_argument("--tcp-break", type=int, metavar="N", help="close TCP after N bytes of replies")
    group.add_argument("--seed", type=int, metavar="N", help="seed of random faults (0)")
    group.add_argument(
        "--stall",
        action="append",
        metavar="S[@T][/P]",
        help="stop the clock for S seconds, first after T, then every P, such as 0.05@2.0 or 0.02/1.0",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the controller until it receives a signal to end."""
    from rcilab.cli.arm_file import ArmFile, read_arm_file
    from rcilab.core.errors import InvalidValueError
    from rcilab.makers.virtual_controller import build_virtual_controller

    given = vars(args)
    file = ArmFile({}, {}) if args.file is None else read_arm_file(args.file)
    options = {**file.options, **given}
    try:
        _serve(build_virtual_controller(_config(options)), options)
    except InvalidValueError as error:
        raise _with_option_name(error, given, file.keys) from error
    return 0


def _serve(server: ArmServer, options: Mapping[str, Any]) -> None:
    handlers: dict[int, Handler] = dict.fromkeys((signal.SIGINT, signal.SIGTERM), lambda *_: server.request_stop())
    if "exit_with_parent" in options:  # It handles interrupts; VS Code sends that of a kernel to all its children.
        handlers[signal.SIGINT] = signal.SIG_IGN
    # In one write, so that a reader that waits for the first line also gets the second one.
    world = "" if server.world_address is None else f"\nworld {server.world_address}"
    with handled_signals(handlers), closing(server), _recording(options.get("record"), server):
        server.run(lambda: print_interruptibly(f"{server.description}{world}"))


def _recording(folder: str | None, server: ArmServer) -> AbstractContextManager[None]:
    """Returns the recorder of --record; without it nothing."""
    if folder is None or server.ring is None:
        return nullcontext()
    from rcilab.cli.motion_recorder import recorder_process
    from rcilab.core.errors import InvalidValueError

    if not folder:  # As a path it would be the working folder.
        raise InvalidValueError("record", folder, "needs the name of a folder, such as recordings")
    return recorder_process(Path(folder), server.ring, server.config.log_format, lambda: server.controller.cycle_number)


def _config(options: Mapping[str, Any]) -> ControllerConfig:
    """Returns the configuration from options of the command line and the file: texts, or values of their types."""
    from rcilab.core.errors import UsageError
    from rcilab.makers.maker import find_maker
    from rcilab.robots import describe_robot
    from rcilab.sim.controller_config import MOST_LOST, VENDOR_MODE_DELAY, ControllerConfig

    option = options.get
    cell = read_cell(option("cell"), option("tool"), option("load"))
    if cell is not None:
        options = {"model": cell.model, **options}
    elif "model" not in options:
        raise UsageError(
            "the arm is not named; add --model NAME, such as --model xMatePro7, or a file with its configuration"
        )
    n = describe_robot(options["model"]).n
    maker = find_maker(options["model"])
    has_delay = maker is not None and "mode_delay" in maker.capabilities.options
    client_host, client_port = _client(option("client"))
    network, states_network = _networks(options)
    parent, is_lockstep = option("exit_with_parent"), option("lockstep", False)
    tool, load = option("tool"), option("load")
    if isinstance(tool, str):
        tool, named = parse_tool_and_load(tool, None, options["model"])
        load = named if load is None else load
    load = _parsed(load, parse_load)
    return ControllerConfig(
        model=options["model"],
        host=option("host", _HOST),
        port=option("port"),
        udp_port=option("udp_port"),
        client_host=client_host,
        client_port=client_port,
        plant=option("plant", "ideal"),
        realism=option("realism", "off"),
        lockstep=is_lockstep,
        mode_delay=option("mode_delay", VENDOR_MODE_DELAY if has_delay and not is_lockstep else None),
        prefill=option("prefill"),
        patience=option("patience"),
        lost_limit=option("lost_limit", MOST_LOST) or None,  # 0 switches it off.
        on_loss=option("on_loss"),
        auto_limit=option("auto_limit", False),
        loop_back=option("loop_back", False),
        fresh=option("fresh", False),
        generation=option("generation"),
        limit_table=option("limits"),
        force_sign=option("force_sign"),
        start=_parsed(option("start"), lambda text: parse_joints(text, n)),
        tool=tool,
        load=load,
        cell=cell,
        safety_box=_parsed(option("box"), parse_box),
        soft_limits=_parsed(option("soft_limits"), lambda text: _soft_limits(text, n)),
        inputs=_parsed(option("di", ()), _signals),
        network=network,
        states_network=states_network,
        stalls=tuple(map(parse_stall, option("stall", ()))),
        log_format=option("log_format", "text"),
        world_port=None if option("no_world") else option("world_port", 0),
        is_recorded="record" in options or "exit_with_parent" not in options,
        # Without a number: the parent process, while it still exists.
        parent_pid=os.getppid() if parent == 0 else parent,
    )


def _parsed(value: Any, parse: Callable[[str], Any]) -> Any:
    """Returns a value of its type; from the command line it is a text."""
    return parse(value) if isinstance(value, str) else value


def _soft_limits(text: str, n: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    limits = parse_soft_limits(text, n)
    return tuple(limits.lower), tuple(limits.upper)


def _signals(text: str) -> tuple[int, ...]:
    from rcilab.core.errors import InvalidValueError

    numbers = [part.strip() for part in text.split(",")]
    if not all(number.isascii() and number.isdigit() and len(number) < 10 for number in numbers):
        raise InvalidValueError("--di", text, "needs numbers of digital inputs, such as 0,3")
    return tuple(map(int, numbers))


def _with_option_name(
    error: InvalidValueError, given: Mapping[str, object], keys: Mapping[str, str]
) -> InvalidValueError:
    """Returns an error with the name of the option, or its key in the file, instead of that of the setting."""
    setting, colon, rest = error.name.partition(": ")
    option = _OPTIONS.get(setting, setting)
    if option == "start" and not (option in keys or option in given):
        requirement = f"{error.requirement}; that is its home pose, choose another with --start"
        return type(error)("the arm", error.value, requirement)
    if option in keys and option not in given:
        name = keys[option]
    elif option in given or setting in _OPTIONS:
        name = "--" + option.replace("_", "-")
    else:
        return error
    return type(error)(name + colon + rest, error.value, error.requirement)


def _client(text: str | None) -> tuple[str | None, int | None]:
    from rcilab.core.errors import InvalidValueError

    if text is None:
        return None, None
    host, colon, port = text.partition(":")
    if not host or (colon and not port.isascii()) or (colon and not port.isdigit()):
        raise InvalidValueError("--client", text, "needs HOST or HOST:PORT, such as 127.0.0.1:1337")
    return host, int(port) if colon else None


def _networks(options: Mapping[str, Any]) -> tuple[NetworkFaults, NetworkFaults]:
    """Returns the network faults towards the controller, and towards the client."""
    from rcilab.core.errors import InvalidValueError
    from rcilab.sim.api import DIRECTIONS, NetworkFaults

    direction = options.get("faults_on", "both")
    if direction not in DIRECTIONS:
        raise InvalidValueError("--faults-on", direction, f"is unknown; known: {', '.join(DIRECTIONS)}")

    def given(*names: str) -> dict[str, Any]:
        return {name: options[name] for name in names if name in options}

    tcp = given("tcp_delay", "tcp_split", "tcp_break", "seed")
    bad = NetworkFaults(**given("loss", "delay", "jitter", "reorder", "duplicate", "corrupt"), **tcp)
    good = NetworkFaults(**tcp)
    return (good if direction == "states" else bad), (good if direction == "commands" else bad)


def parse_stall(text: str) -> Stall:
    """Parses a stall of the clock, `S[@T][/P]`: S seconds, first after T, then every P.

    Raises:
        InvalidValueError: The text is not valid.
    """
    from rcilab.core.errors import InvalidValueError
    from rcilab.sim.api import Stall

    rest, slash, period = text.partition("/")
    duration, at, after = rest.partition("@")
    try:
        numbers = float(duration), float(after) if at else 0.0, float(period) if slash else None
    except ValueError:
        raise InvalidValueError(
            "--stall", text, "needs seconds, as 0.05@2.0 (once, after 2 s), 0.02/1.0 (every second) or 0.02@5/1.0"
        ) from None
    return Stall(duration=numbers[0], after=numbers[1], period=numbers[2])
