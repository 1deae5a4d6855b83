"""`rcilab mjcf NAME`: an arm as MJCF, for MuJoCo."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rcilab.cli.arm_options import add_cell_option, read_cell

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell


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
    add_cell_option(
        parser, "obstacles and floor, tool and held part are added, with the load; of meshes their convex parts"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Prints the MJCF with capsules, or writes it and its meshes to a directory."""
    from rcilab.robots import describe_robot
    from rcilab.robots.files import write_model
    from rcilab.robots.mjcf import build_mjcf

    description, cell = describe_robot(args.name), read_cell(args.cell)
    is_written = args.output is not None
    text = build_mjcf(description, meshes=is_written) if cell is None else _in_cell(description.name, cell, is_written)
    if not is_written:
        sys.stdout.write(text)
        return 0
    print(write_model(args.output, f"{description.name}.xml", text, description))
    return 0


def _in_cell(name: str, cell: Cell, has_meshes: bool) -> str:
    from rcilab.model.robot_model import load_model
    from rcilab.robots.mjcf import build_mjcf
    from rcilab.sim.mujoco_cell import cell_elements

    model = cell.applied_to(load_model(name))
    return build_mjcf(
        model.description,
        meshes=has_meshes,
        T_flange_tool=model.T_flange_tool,
        load=model.load,
        surroundings=cell_elements(cell, model.T_flange_tool, has_floor=True).surroundings,
    )
