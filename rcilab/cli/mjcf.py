"""`rcilab mjcf NAME`: an arm as MJCF, for MuJoCo."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command."""
    parser = subparsers.add_parser(
        "mjcf",
        help="print an arm as MJCF for MuJoCo, or write it with its meshes",
        description="Prints the arm as MJCF for MuJoCo: geometry and limits of its maker's manual, torque motors; a "
        "comment names every source. The printed links are capsules, without further files; with --output they have "
        "meshes, which are written too. Exit code: 0 done; 2 the name is unknown, or DIR cannot be written.",
        epilog="example: rcilab mjcf xMatePro7 --output robots && python -m mujoco.viewer --mjcf robots/xMatePro7.xml",
    )
    parser.add_argument("name", metavar="NAME", help="arm, such as xMatePro7 (any case); an unknown name lists all")
    parser.add_argument("--output", metavar="DIR", type=Path, help="write DIR/NAME.xml and DIR/meshes/NAME/*.stl")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints the MJCF with capsules, or writes it and its meshes to a directory."""
    from rcilab.robots import describe_robot
    from rcilab.robots.files import write_model
    from rcilab.robots.mjcf import build_mjcf

    description = describe_robot(args.name)
    if args.output is None:
        sys.stdout.write(build_mjcf(description))
        return 0
    text = build_mjcf(description, meshes=True)
    print(write_model(args.output, f"{description.name}.xml", text, description))
    return 0
