"""`rcilab controller`: a virtual RCI controller on this machine."""

from __future__ import annotations

import argparse
import os
import signal
import sys

DESCRIPTION = """\
Runs a virtual RCI controller. Any RCI client can connect to it: this package, or a C++ program that uses the vendor's
client library. It prints one line when it is ready and ends on Ctrl-C.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the command line."""
    parser = subparsers.add_parser("controller", help="run a virtual RCI controller", description=DESCRIPTION)
    parser.add_argument("--model", required=True, metavar="NAME", help="arm, such as xMatePro7")
    parser.add_argument("--host", default="127.0.0.2", metavar="ADDR", help="address to listen on (%(default)s)")
    parser.add_argument("--port", type=int, default=1337, metavar="N", help="TCP port (%(default)s); 0: any free one")
    parser.add_argument("--udp-port", type=int, metavar="N", help="UDP port for commands (as --port); 0: any free one")
    parser.add_argument(
        "--client", metavar="HOST[:PORT]", help="where states go from power-up on (whoever connects, at --port)"
    )
    parser.add_argument("--plant", default="ideal", metavar="KIND", help="what moves: ideal or mujoco (%(default)s)")
    parser.add_argument("--lockstep", action="store_true", help="advance a motion only as its commands come")
    parser.add_argument(
        "--prefill", type=int, metavar="N", help="play commands N cycles late, which absorbs jitter (10; lock-step: 0)"
    )
    parser.add_argument(
        "--lost-limit",
        type=int,
        default=20,
        metavar="N",
        help="lost commands in a row that stop a motion, 10 to 20; 0: none do (%(default)s)",
    )
    parser.add_argument("--exit-with-parent", nargs="?", type=int, const=0, metavar="PID", help=argparse.SUPPRESS)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Runs the controller until it is told to end."""
    from rcilab.controller.config import ControllerConfig
    from rcilab.controller.server import ControllerServer

    client_host, client_port = _client(args.client)
    config = ControllerConfig(
        model=args.model,
        host=args.host,
        port=args.port,
        udp_port=args.udp_port,
        client_host=client_host,
        client_port=client_port,
        plant=args.plant,
        lockstep=args.lockstep,
        prefill=args.prefill,
        lost_limit=args.lost_limit or None,  # 0 switches it off.
        # Without a number: whoever started us, as long as that one is still there to be asked for.
        parent_pid=os.getppid() if args.exit_with_parent == 0 else args.exit_with_parent,
    )
    server = ControllerServer(config)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.request_stop())
    if not args.host.startswith("127.") and args.host != "localhost":
        print(
            f"rcilab controller: warning: {args.host} is reachable from outside this machine; anyone there can move "
            "this virtual arm",
            file=sys.stderr,
            flush=True,
        )
    print(server.description, flush=True)
    server.run()
    return 0


def _client(text: str | None) -> tuple[str | None, int | None]:
    from rcilab.errors import InvalidValueError

    if text is None:
        return None, None
    host, colon, port = text.partition(":")
    if not host or (colon and not port.isascii()) or (colon and not port.isdigit()):
        raise InvalidValueError("--client", text, "needs HOST or HOST:PORT, such as 127.0.0.1:1337")
    return host, int(port) if colon else None
