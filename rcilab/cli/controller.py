"""`rcilab controller`: a virtual controller on this machine."""

from __future__ import annotations

import argparse
import os
import signal
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from rcilab.cli.output import print_interruptibly

if TYPE_CHECKING:
    from rcilab.core.errors import InvalidValueError
    from rcilab.sim.api import NetworkFaults, Stall
    from rcilab.sim.arm_server import ArmServer
    from rcilab.sim.controller_config import ControllerConfig

DESCRIPTION = """\
Runs the virtual controller of an arm. Any client of the maker's interface can connect to it: this package, or a C++
program that uses the vendor's client library. It prints one line when it is ready, a second one with the address of its
simulation port, and ends on Ctrl-C.
"""

_OPTIONS = {"limit table": "--limits", "client_host": "--client", "client_port": "--client"}
"""Options whose names differ from those of their settings."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser("controller", help="run a virtual controller", description=DESCRIPTION)
    parser.add_argument("--model", required=True, metavar="NAME", help="arm, such as xMatePro7")
    parser.add_argument("--host", default="127.0.0.2", metavar="ADDR", help="address to listen on (%(default)s)")
    parser.add_argument(
        "--port", type=int, metavar="N", help="TCP port (default: that of the interface, RCI: 1337); 0: any free one"
    )
    parser.add_argument("--udp-port", type=int, metavar="N", help="UDP port for commands (as --port); 0: any free one")
    parser.add_argument(
        "--client",
        metavar="HOST[:PORT]",
        help="destination of the states from the start on, also without a connection (port: as --port)",
    )
    parser.add_argument("--plant", default="ideal", metavar="KIND", help="simulated arm: ideal or mujoco (%(default)s)")
    parser.add_argument("--lockstep", action="store_true", help="advance a motion only when its commands arrive")
    parser.add_argument(
        "--mode-delay",
        type=float,
        metavar="S",
        help="delay from StartMove to the new mode (1.05, for any client; lock-step: 0.02; 0.2 is enough for most)",
    )
    parser.add_argument(
        "--prefill",
        type=int,
        metavar="N",
        help="delay commands by N cycles, which absorbs jitter (10, torques 2; lock-step: 0)",
    )
    parser.add_argument(
        "--patience",
        type=float,
        metavar="S",
        help="lock-step: timeout for a command (60; 0.05 with --corrupt)",
    )
    parser.add_argument(
        "--lost-limit",
        type=int,
        default=20,
        metavar="N",
        help="number of consecutive lost commands that stops a motion, 10 to 20; 0: none (%(default)s). Fewer stop it "
        "if the next command could only be reached with a jump: --prefill helps there",
    )
    parser.add_argument(
        "--auto-limit",
        action="store_true",
        help="stop commands inside the soft joint limits, each joint by itself: with commanded poses the tool then "
        "leaves the commanded pose",
    )
    parser.add_argument("--loop-back", action="store_true", help="connect digital outputs to the inputs")
    parser.add_argument(
        "--limits", default="manual", metavar="TABLE", help="Cartesian limits: manual or sdk (%(default)s)"
    )
    parser.add_argument(
        "--force-sign",
        default="on-arm",
        metavar="SIGN",
        help="sign of reported external forces: on-arm, as exerted on the arm, or by-arm, as exerted by it "
        "(%(default)s; that of a real arm is not verified)",
    )
    parser.add_argument(
        "--log-format",
        default="text",
        metavar="FORMAT",
        help="lines of the log on stderr: text, or json for one object each (%(default)s)",
    )
    parser.add_argument(
        "--record",
        type=Path,
        metavar="FOLDER",
        help="write each motion of any client to FOLDER: a run (.rcirun, for rcilab replay and check) with every state "
        "and command, a report (.txt), and a line on stderr",
    )
    _add_world_options(parser)
    _add_network_options(parser)
    parser.add_argument("--exit-with-parent", nargs="?", type=int, const=0, metavar="PID", help=argparse.SUPPRESS)
    parser.set_defaults(run=run)


def _add_world_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("simulation port", "control of the simulated environment of the robot")
    choice = group.add_mutually_exclusive_group()
    choice.add_argument("--world-port", type=int, default=0, metavar="N", help="TCP port, on loopback (any free one)")
    choice.add_argument("--no-world", action="store_true", help="no simulation port")


def _add_network_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("faults", "faults of the network and of the controller's clock")
    for name, meaning in (
        ("loss", "lost datagrams"),
        ("reorder", "datagrams overtaken by later ones"),
        ("duplicate", "datagrams that arrive twice"),
        ("corrupt", "datagrams with a flipped bit"),
    ):
        group.add_argument(f"--{name}", type=float, default=0.0, metavar="SHARE", help=f"share of {meaning}, 0 to 1")
    group.add_argument("--delay", type=float, default=0.0, metavar="S", help="delay of every datagram")
    group.add_argument("--jitter", type=float, default=0.0, metavar="S", help="largest random delay in addition")
    group.add_argument(
        "--faults-on", default="both", metavar="WAY", help="affected datagrams: commands, states or both (%(default)s)"
    )
    group.add_argument("--tcp-delay", type=float, default=0.0, metavar="S", help="delay of every TCP reply")
    group.add_argument(
        "--tcp-split", nargs="?", type=int, const=1, default=0, metavar="N", help="send replies N bytes at a time (1)"
    )
    group.add_argument("--tcp-break", type=int, metavar="N", help="close TCP after N bytes of replies")
    group.add_argument("--seed", type=int, default=0, metavar="N", help="seed of random faults (%(default)s)")
    group.add_argument(
        "--stall",
        action="append",
        default=[],
        metavar="S[@T][/P]",
        help="stop the clock for S seconds, first after T, then every P, such as 0.05@2.0 or 0.02/1.0",
    )


def run(args: argparse.Namespace) -> int:
    """Runs the controller until it receives a signal to end."""
    from rcilab.core.errors import InvalidValueError
    from rcilab.makers.virtual_controller import build_virtual_controller

    try:
        server = build_virtual_controller(_config(args))
    except InvalidValueError as error:
        raise _with_option_name(error, args) from error
    signal.signal(signal.SIGTERM, lambda *_: server.request_stop())
    if args.exit_with_parent is None:
        signal.signal(signal.SIGINT, lambda *_: server.request_stop())
    else:  # The parent handles interrupts; VS Code sends the interrupt of a kernel to all its child processes.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    # In one write, so that a reader that waits for the first line also gets the second one.
    world = "" if server.world_address is None else f"\nworld {server.world_address}"

    with _recording(args, server):
        server.run(lambda: print_interruptibly(f"{server.description}{world}"))
    return 0


def _recording(args: argparse.Namespace, server: ArmServer) -> AbstractContextManager[None]:
    """Returns the recorder of --record; without it nothing."""
    if args.record is None or server.ring is None:
        return nullcontext()
    from rcilab.cli.motion_recorder import recorder_process

    return recorder_process(args.record, server.ring, server.config.log_format, lambda: server.controller.cycle_number)


def _config(args: argparse.Namespace) -> ControllerConfig:
    from rcilab.sim.controller_config import VENDOR_MODE_DELAY, ControllerConfig

    client_host, client_port = _client(args.client)
    network, states_network = _networks(args)
    return ControllerConfig(
        model=args.model,
        host=args.host,
        port=args.port,
        udp_port=args.udp_port,
        client_host=client_host,
        client_port=client_port,
        plant=args.plant,
        lockstep=args.lockstep,
        mode_delay=VENDOR_MODE_DELAY if args.mode_delay is None and not args.lockstep else args.mode_delay,
        prefill=args.prefill,
        patience=args.patience,
        lost_limit=args.lost_limit or None,  # 0 switches it off.
        auto_limit=args.auto_limit,
        loop_back=args.loop_back,
        limit_table=args.limits,
        force_sign=args.force_sign,
        network=network,
        states_network=states_network,
        stalls=tuple(map(parse_stall, args.stall)),
        log_format=args.log_format,
        world_port=None if args.no_world else args.world_port,
        is_recorded=args.exit_with_parent is None or args.record is not None,
        # Without a number: the parent process, while it still exists.
        parent_pid=os.getppid() if args.exit_with_parent == 0 else args.exit_with_parent,
    )


def _with_option_name(error: InvalidValueError, args: argparse.Namespace) -> InvalidValueError:
    """Returns an error with the name of the option instead of that of the setting."""
    if error.name not in _OPTIONS and error.name not in vars(args):
        return error
    option = _OPTIONS.get(error.name, "--" + error.name.replace("_", "-"))
    return type(error)(option, error.value, error.requirement)


def _client(text: str | None) -> tuple[str | None, int | None]:
    from rcilab.core.errors import InvalidValueError

    if text is None:
        return None, None
    host, colon, port = text.partition(":")
    if not host or (colon and not port.isascii()) or (colon and not port.isdigit()):
        raise InvalidValueError("--client", text, "needs HOST or HOST:PORT, such as 127.0.0.1:1337")
    return host, int(port) if colon else None


def _networks(args: argparse.Namespace) -> tuple[NetworkFaults, NetworkFaults]:
    """Returns the network faults towards the controller, and towards the client."""
    from rcilab.core.errors import InvalidValueError
    from rcilab.sim.api import DIRECTIONS, NetworkFaults

    if args.faults_on not in DIRECTIONS:
        raise InvalidValueError("--faults-on", args.faults_on, f"is unknown; known: {', '.join(DIRECTIONS)}")
    tcp = {"tcp_delay": args.tcp_delay, "tcp_split": args.tcp_split, "tcp_break": args.tcp_break, "seed": args.seed}
    names = ("loss", "delay", "jitter", "reorder", "duplicate", "corrupt")
    bad = NetworkFaults(**{name: getattr(args, name) for name in names}, **tcp)
    good = NetworkFaults(**tcp)
    return (good if args.faults_on == "states" else bad), (good if args.faults_on == "commands" else bad)


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
