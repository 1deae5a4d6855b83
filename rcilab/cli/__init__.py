"""The command line: `rcilab [COMMAND]`; without a command it starts the workbench."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from rcilab.cli.output import drop_output, drop_unread_output, is_unwritable, one_line_each, prepare_streams
from rcilab.core.errors import RcilabError
from rcilab.core.memory import OUT_OF_MEMORY, is_out_of_memory

COMMANDS = (
    "workbench",
    "controller",
    "world",
    "watch",
    "run",
    "replay",
    "check",
    "urdf",
    "mjcf",
    "lab",
    "doctor",
    "bench",
)
"""Each command is a module of this package with `add_parser(subparsers)` and `run(args) -> int`."""

_USAGE = 2  # Exit status for a usage error, as in argparse.
_TOO_FEW_FILES = "the limit of open files is too low; close other programs or raise it: ulimit -n 256"
_INTERRUPTED = 130  # Exit status after Ctrl-C, as in shells.
_CLOSED_PIPE = 141  # Exit status after a closed output pipe, as in shells.


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status; an `RcilabError` is printed on stderr without a traceback."""
    prepare_streams()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or (arguments[0].startswith("-") and arguments[0] not in ("-h", "--help", "--version")):
        arguments.insert(0, "workbench")
    if "_ARGCOMPLETE" in os.environ:  # A request for completions: prints them and ends the process.
        import argcomplete

        argcomplete.autocomplete(_build_parser())
    try:
        return _run_command(arguments)
    except KeyboardInterrupt:  # Also while an error is printed.
        drop_unread_output()
        return _INTERRUPTED


def _run_command(arguments: Sequence[str]) -> int:
    try:
        # Loads only the module of the named command; the error for an unknown command lists all of them.
        args = _build_parser(arguments[:1] if arguments[0] in COMMANDS else COMMANDS).parse_args(arguments)
        code = int(args.run(args) or 0)
        _flush()
        return code
    except BrokenPipeError:
        drop_output()
        return _CLOSED_PIPE
    except RcilabError as error:
        print(f"rcilab: {one_line_each(str(error))}", file=sys.stderr)
        return _USAGE
    except (MemoryError, ImportError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        print(f"rcilab: {OUT_OF_MEMORY}", file=sys.stderr)
        return _USAGE
    except OSError as error:
        if is_out_of_memory(error):
            print(f"rcilab: {OUT_OF_MEMORY}", file=sys.stderr)
            return _USAGE
        if error.errno in (errno.EMFILE, errno.ENFILE):
            print(f"rcilab: {_TOO_FEW_FILES}", file=sys.stderr)
            return _USAGE
        if not is_unwritable(error):
            raise
        drop_output()
        print(f"rcilab: the output could not be written: {error.strerror}", file=sys.stderr)
        return _USAGE


def _flush() -> None:
    """Flushes stdout; a closed pipe does not change the exit status."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        drop_output()


def _build_parser(commands: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    from rcilab import __version__

    parser = argparse.ArgumentParser(
        prog="rcilab",
        description="A lab for robot arms. Without a command it opens the workbench in the browser.",
    )
    parser.add_argument("--version", action="version", version=f"rcilab {__version__}")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in commands:
        module = import_module(f"rcilab.cli.{command}")
        module.add_parser(subparsers)
    return parser
