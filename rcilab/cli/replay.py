"""`rcilab replay FILE`: opens the page on a recorded run."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rcilab.cli.motion_file import add_max_rows
from rcilab.cli.workbench import add_page_options, find_page_token, page_config, serve


def add_parser(subparsers: Any) -> None:
    """Adds the command and its options."""
    parser = subparsers.add_parser(
        "replay",
        help="open the page on a recorded run",
        description="Opens the page with a run recorded by the page or saved by run.save('….rcirun'); its timeline "
        "shows plan and actual. Nothing is connected until you connect on the Run tab.",
    )
    parser.add_argument("file", type=Path, help="the run, .rcirun, also one truncated by a crash")
    add_max_rows(parser)
    add_page_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serves the page until Ctrl-C or a termination signal."""
    from rcilab.recording.run import load_run

    token = find_page_token(args)
    found = load_run(args.file, max_rows=args.max_rows)
    print(f"{args.file}: {found!r}")
    return serve(page_config(args, token, replay=found), browser=not args.no_browser)
