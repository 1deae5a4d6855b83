"""`rcilab [workbench]`: serves the page."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.cli.output import print_interruptibly
from rcilab.cli.signal_handlers import Handler, handled_signals
from rcilab.core.errors import ConnectionLostError, UsageError
from rcilab.core.memory import OUT_OF_MEMORY, is_out_of_memory

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus
    from rcilab.workbench.app import WorkbenchConfig

_FIRST_ARM = "xMatePro7"
_TIMEOUT = 3.0  # [s] For the controller's answer; as for a session.


def add_parser(subparsers: Any) -> None:
    """Adds the command and its options."""
    parser = subparsers.add_parser("workbench", help="open the page: pose an arm, plan, check, run")
    add_options(parser)
    parser.set_defaults(run=run)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options, for `rcilab workbench` and for a bare `rcilab`."""
    parser.add_argument("--model", help=f"initial arm (default: that of the robot; without one {_FIRST_ARM})")
    parser.add_argument(
        "--robot",
        default="virtual",
        metavar="ADDRESS",
        help="controller to connect to: rci://HOST:PORT, fci://HOST, xarm://HOST, realman://HOST",
    )
    add_page_options(parser)


def add_page_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of every page."""
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on; with any other than loopback, every page needs a token",
    )
    parser.add_argument("--port", type=_port, default=None, help="port of the page (default: 8080; 0: any free one)")
    parser.add_argument(
        "--private",
        action="store_true",
        help="require a token on loopback too: excludes other accounts of this machine",
    )
    parser.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        help="file with the token, at least 16 characters; default: $RCILAB_TOKEN, else a new token",
    )
    parser.add_argument("--no-browser", action="store_true", help="do not open a browser")
    parser.add_argument(
        "--runs",
        type=Path,
        metavar="FOLDER",
        default=Path.home() / "rcilab-runs",
        help="folder for the recordings of all motions, cycle by cycle (default: %(default)s)",
    )
    parser.add_argument("--language", choices=("en", "zh"), help="language of the page (default: the last one chosen)")
    parser.add_argument(
        "--quality",
        choices=("full", "light"),
        help="light: for software rendering; default: full, or light if the browser has no graphics card",
    )


def run(args: argparse.Namespace) -> int:
    """Serves the page until Ctrl-C or a termination signal."""
    from rcilab.workbench.security import require_openable

    token = find_page_token(args)
    model = _FIRST_ARM if args.model is None else args.model
    if args.model is None and args.robot != "virtual":
        model = _arm_at(args.robot)
    require_openable(args.host, token, args.robot, model)  # Before the libraries of the page are loaded.
    return serve(page_config(args, token, model=model, target=args.robot), browser=not args.no_browser)


def _arm_at(address: str) -> str:
    """Returns the name of the arm that a controller reports.

    Raises:
        ConnectionLostError: The controller does not answer.
        ModelError: It does not report an arm that is known.
        InvalidValueError: The address is not valid.
    """
    from rcilab.makers.driver import open_driver

    try:
        driver = open_driver(address, _TIMEOUT, None)
    except ConnectionLostError as error:
        raise ConnectionLostError(
            f"{error}; to open the page before the controller answers, add --model NAME"
        ) from error
    driver.close()
    return driver.arm_name


def find_page_token(args: argparse.Namespace) -> str | None:
    """Returns the token of the page from the options of `add_page_options`; None if none is needed."""
    from rcilab.workbench.access import VARIABLE, find_token

    token = find_token(args.host, is_private=args.private, file=args.token_file)
    is_new = token is not None and args.token_file is None and not os.environ.get(VARIABLE)
    if is_new and args.no_browser and not sys.stdout.isatty():
        raise UsageError(
            f"the new token would be unknown: it is printed only on a terminal; set one in ${VARIABLE} or with "
            "--token-file FILE"
        )
    return token


def page_config(args: argparse.Namespace, token: str | None, **options: Any) -> WorkbenchConfig:
    """Returns the configuration of the page from the options of `add_page_options` and further ones."""
    from rcilab.workbench.app import WorkbenchConfig
    from rcilab.workbench.security import DEFAULT_PORT

    return WorkbenchConfig(
        host=args.host,
        port=DEFAULT_PORT if args.port is None else args.port,
        token=token,
        language=args.language,
        quality=args.quality,
        runs=args.runs,
        **options,
    )


def serve(config: WorkbenchConfig, *, browser: bool) -> int:
    """Serves a page until Ctrl-C or a termination signal."""
    from rcilab.workbench.app import Workbench

    ending = threading.Event()
    handlers: dict[int, Handler] = dict.fromkeys((signal.SIGINT, signal.SIGTERM), lambda *_: ending.set())
    with handled_signals(handlers), _ended_by_memory_error(ending), Workbench(config) as bench:
        is_secret = config.token is not None and not sys.stdout.isatty()
        address = f"{bench.url.partition('?')[0]} with its token" if is_secret else bench.url
        print_interruptibly(f"rcilab workbench: {address}  (Ctrl-C ends it)", unless=ending.is_set)
        problem = ""
        with _browser(bench.url if browser else None, is_private=config.token is not None):
            while not ending.wait(0.5):
                problem = _print_problem(bench.session.status(), problem)
    return 0


@contextmanager
def _ended_by_memory_error(ending: threading.Event) -> Iterator[None]:
    """Ends the page when a thread has ended for lack of memory: the page would not work without it.

    Raises:
        UsageError: A thread has ended for lack of memory.
    """
    before, died = threading.excepthook, threading.Event()

    def on_exception(args: threading.ExceptHookArgs) -> None:
        if args.exc_value is None or not is_out_of_memory(args.exc_value):
            before(args)
            return
        died.set()
        ending.set()

    threading.excepthook = on_exception
    try:
        yield
    finally:
        threading.excepthook = before
    if died.is_set():
        raise UsageError(OUT_OF_MEMORY)


@contextmanager
def _browser(url: str | None, *, is_private: bool) -> Iterator[None]:
    """Opens an address in a browser, unless it is None; a token in it is not visible in the list of processes."""
    if url is None:
        yield
        return
    import webbrowser

    from rcilab.workbench.access import private_address

    with private_address(url) if is_private else nullcontext(url) as address:
        webbrowser.open(address)
        yield


def _print_problem(status: SupervisorStatus, printed: str) -> str:
    """Prints why the robot is not connected, once until it is connected again; returns the last printed message."""
    if status.phase not in ("lost", "crashed"):
        return "" if status.phase in ("idle", "moving") else printed
    if status.message != printed:
        print_interruptibly(f"rcilab workbench: {status.message}", sys.stderr)
    return status.message


def _port(text: str) -> int:
    try:
        port = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port number; use 0 to 65535") from None
    if not 0 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"{port} is not a port number; use 0 to 65535")
    return port
