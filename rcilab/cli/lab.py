"""`rcilab lab`: JupyterLab on the lessons."""

from __future__ import annotations

import argparse
from pathlib import Path

from rcilab.notebook.lessons import FOLDER


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds `rcilab lab`."""
    parser = subparsers.add_parser(
        "lab",
        help="open JupyterLab on the lessons",
        description=f"Opens JupyterLab on your own copies of the lessons, in {FOLDER} in your home directory, or on a "
        "directory of yours as it is. A copy that you have edited is never overwritten: a newer lesson is saved "
        "next to it. JupyterLab listens on this machine only and needs the token in the printed address. Ctrl-C twice "
        "ends it.",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "directory",
        nargs="?",
        type=Path,
        help=f"your own notebooks, as they are (default: ~/{FOLDER}, with the lessons)",
    )
    where.add_argument("--in-place", action="store_true", help="open the lessons themselves, for their authors")
    parser.add_argument("--port", type=int, help="TCP port (default: 8888 or the next free one)")
    parser.add_argument("--no-browser", action="store_true", help="only print the address")
    parser.add_argument("--allow-root", action="store_true", help="run as root, as in a container")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Replaces this process by JupyterLab."""
    from rcilab.notebook.lab import lab_command, open_lab, require_lab
    from rcilab.notebook.lessons import copy_lessons, find_lessons

    require_lab(allow_root=args.allow_root)  # Before the lessons are copied.
    if args.directory is not None:
        directory = args.directory
        print(f"notebooks: {directory}, as it is; without a directory the lessons in ~/{FOLDER} are opened")
    elif args.in_place:
        directory = find_lessons()
        print(f"lessons: {directory}, in place")
    else:
        copied = copy_lessons(Path.home() / FOLDER)
        directory = copied.folder
        print(copied)
    return open_lab(lab_command(directory, port=args.port, browser=not args.no_browser, allow_root=args.allow_root))
