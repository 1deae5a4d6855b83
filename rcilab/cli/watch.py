"""`rcilab watch HOST:PORT`: opens the page on a virtual controller that another program drives."""

from __future__ import annotations

import argparse
from typing import Any

from rcilab.cli.workbench import add_page_options, find_page_token, page_config, serve


def add_parser(subparsers: Any) -> None:
    """Adds the command and its options."""
    parser = subparsers.add_parser(
        "watch",
        help="watch a virtual controller that another program drives",
        description="Opens the page on a virtual controller on this machine and follows the program that drives it: "
        "the arm, its commands with their limits, measured values and timing. Nothing is sent; the emergency stop on "
        "the Run tab works. With rcilab controller --record FOLDER each motion is also written to a file.",
    )
    parser.add_argument(
        "address", metavar="ADDRESS", help="simulation port, HOST:PORT, as the controller prints it after 'world'"
    )
    add_page_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serves the page until Ctrl-C or a termination signal."""
    return serve(page_config(args, find_page_token(args), watch=args.address), browser=not args.no_browser)
