"""`rcilab urdf NAME`: an arm as URDF."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command."""
    parser = subparsers.add_parser(
        "urdf",
        help="print an arm as URDF, or write it with its meshes",
        description="Prints the arm as URDF: geometry and limits of its maker's manual, shapes made by rcilab (no "
        "meshes of the vendor); a comment names every source. Lengths in m, angles in rad. Without --output the text "
        "is printed, without meshes. Exit code: 0 done; 2 the name is unknown, or DIR cannot be written.",
        epilog="example: rcilab urdf xMatePro7 --output robots --mesh-dir package://my_robots/meshes/xMatePro7",
    )
    parser.add_argument("name", metavar="NAME", help="arm, such as xMatePro7 (any case); an unknown name lists all")
    parser.add_argument("--output", metavar="DIR", type=Path, help="write DIR/NAME.urdf and DIR/meshes/NAME/*.stl")
    parser.add_argument("--mesh-dir", metavar="PREFIX", help="prefix of mesh names, such as package://...")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints the URDF, or writes it and its meshes to a directory."""
    from rcilab.robots import describe_robot
    from rcilab.robots.files import write_model
    from rcilab.robots.urdf import build_urdf

    description = describe_robot(args.name)
    text = build_urdf(description, mesh_dir=args.mesh_dir)
    if args.output is None:
        sys.stdout.write(text)
        return 0
    print(write_model(args.output, f"{description.name}.urdf", text, description))
    return 0
