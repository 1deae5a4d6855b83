"""`rcilab lab`: JupyterLab on the lessons."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab lab`."""
    parser = subparsers.add_parser(
        "lab",
        help="open JupyterLab on the lessons",
        description="Opens JupyterLab on the lessons, or on a directory of yours, in the browser. It listens on this "
        "machine only and asks for the token in the address it prints. Ctrl-C twice ends it.",
    )
    parser.add_argument("directory", nargs="?", type=Path, help="where your notebooks are (default: the lessons)")
    parser.add_argument("--port", type=int, help="TCP port (default: 8888 or the next free one)")
    parser.add_argument("--no-browser", action="store_true", help="only print the address")
    parser.add_argument("--allow-root", action="store_true", help="run as root, as in a container")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Becomes JupyterLab."""
    from rcilab.notebook.lab import find_notebooks, lab_command, open_lab

    directory = args.directory or find_notebooks()
    return open_lab(lab_command(directory, port=args.port, browser=not args.no_browser, allow_root=args.allow_root))
