"""The command line: `rcilab [COMMAND]`, the workbench when no command is named."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from rcilab.cli.output import drop_output, is_unwritable, one_line_each, prepare_streams
from rcilab.core.errors import RcilabError
from rcilab.core.memory import OUT_OF_MEMORY, is_out_of_memory

COMMANDS = ("workbench", "controller", "world", "run", "replay", "check", "urdf", "mjcf", "lab", "doctor", "bench")
"""Each is a module here with `add_parser(subparsers)` and `run(args) -> int`."""

_USAGE = 2  # Exit status of a request that cannot be served, as argparse uses it.
_TOO_FEW_FILES = "fewer files may be open than this needs; close other programs or raise the limit: ulimit -n 256"
_INTERRUPTED = 130  # Exit status after Ctrl-C, as shells use it.
_CLOSED_PIPE = 141  # Exit status of a command that ended early because its output was no longer read, as shells use it.


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status; an error of ours is one line on stderr."""
    prepare_streams()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or (arguments[0].startswith("-") and arguments[0] not in ("-h", "--help", "--version")):
        arguments.insert(0, "workbench")
    if "_ARGCOMPLETE" in os.environ:  # The shell asks how to go on: this prints the answers and ends the process.
        import argcomplete

        argcomplete.autocomplete(_build_parser())
    try:
        # A named command loads that one only; a wrong name is answered with all of them.
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
    except KeyboardInterrupt:
        return _INTERRUPTED


def _flush() -> None:
    """Writes what stdout has kept; what a reader that has gone does not take changes nothing about the exit status."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        drop_output()


def _build_parser(commands: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    from rcilab import __version__

    parser = argparse.ArgumentParser(
        prog="rcilab",
        description="A lab for ROKAE xMate arms. Without a command it opens the workbench in the browser.",
    )
    parser.add_argument("--version", action="version", version=f"rcilab {__version__}")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True)
    for command in commands:
        module = import_module(f"rcilab.cli.{command}")
        module.add_parser(subparsers)
    return parser
