"""Motion files of the commands: a motion saved with `Motion.save`, or a program in JSON, which is planned."""

from __future__ import annotations

import os
from argparse import ArgumentParser
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.core.atomic_file import read_limited
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion, Program

HELP = "motion (.npz or .csv, from Motion.save) or program (.json, from Program.save)"


def add_max_rows(parser: ArgumentParser) -> None:
    """Adds the option `--max-rows`, for large files."""
    parser.add_argument(
        "--max-rows",
        type=int,
        default=DEFAULT_MAX_ROWS,
        metavar="N",
        help="largest number of 1 ms cycles in the file, of 1 KiB each, unpacked (default: %(default)s, 17 minutes)",
    )


def read_file(file: Path, max_rows: int = DEFAULT_MAX_ROWS) -> Motion | Program:
    """Returns the motion or, if the name ends in .json, the program in a file.

    Args:
        file: Path of the file.
        max_rows: Largest number of 1 ms cycles of a motion.

    Raises:
        InvalidValueError: The file does not exist, is neither, or is too large.
        VersionMismatchError: It was written by another version of its format.
    """
    from rcilab.motion import Motion, Program

    if file.suffix.lower() == ".rcirun" and os.path.isfile(file):
        raise InvalidValueError("motion file", file.name, f"is a recorded run: open it with `rcilab replay {file}`")
    return Program.load(file) if file.suffix.lower() == ".json" else Motion.load(file, max_rows=max_rows)


def resolved(found: Motion | Program, cell: Cell | None, file: Path) -> Motion | Program:
    """Returns a program with all waypoints in base, and a motion as it is.

    Args:
        found: Result of `read_file`.
        cell: The cell that has the frames of waypoints.
        file: Its file, for the line of a waypoint in an error.

    Raises:
        UsageError: Waypoints are in frames, and there is no cell.
        InvalidValueError: A waypoint is in a frame that the cell does not have.
    """
    from rcilab.motion import Program

    if not isinstance(found, Program) or not found.needs_cell:
        return found
    if cell is None:
        raise UsageError(f"{file.name} needs its cell ({_needs(found)}): add --cell CELL, the cell that has them")
    try:
        return cell.resolve(found)
    except InvalidValueError as error:
        number = error.facts["number"]
        assert isinstance(number, int)  # The error names a waypoint.
        line = _line_of(number, file)
        raise InvalidValueError(f"{file.name}, line {line}, {error.name}", error.value, error.requirement) from error


def _needs(program: Program) -> str:
    """Returns what a program takes from its cell."""
    signals = [step.signal for step in program.waypoints if isinstance(step.signal, str)]
    kinds = {step.type for step in program.waypoints}
    others = [name for kind, name in (("tool", "jaws"), ("free", "obstacles")) if kind in kinds]
    return ", ".join(dict.fromkeys((*program.frames, *signals, *others)))


def as_motion(
    found: Motion | Program,
    model: RobotModel,
    file: Path,
    show: Callable[[str], None] = print,
    max_rows: int = DEFAULT_MAX_ROWS,
    cell: Cell | None = None,
) -> Motion:
    """Returns the motion and shows its notes; a program is planned.

    Args:
        found: Result of `read_file`.
        model: The arm.
        file: Its file, for the line of a waypoint that cannot be planned.
        show: Called with every line of text.
        max_rows: Largest number of 1 ms cycles.
        cell: The cell that motions lead around.

    Raises:
        PlanningError: The program cannot be planned.
        InvalidValueError: It is for another arm.
    """
    from rcilab.cell.plan_free import plan_free
    from rcilab.core.errors import PlanningError
    from rcilab.motion import Program, plan_program

    if isinstance(found, Program):
        try:
            free = None if cell is None else partial(plan_free, cell=cell)
            motion = plan_program(model, found, law="torque_rate_limited", max_rows=max_rows, free=free)
        except PlanningError as error:
            if error.waypoint is None:
                raise
            line = _line_of(error.waypoint, file)
            raise PlanningError(f"{file.name}, line {line}, {error}", waypoint=error.waypoint) from error
    else:
        motion = found
    for note in motion.notes:
        show(f"note: {note}")
    return motion


def _line_of(waypoint: int, file: Path) -> int:
    """Returns the line, from 1, of a waypoint in a valid program file."""
    from rcilab.motion.located_json import read_json, require_length

    text = read_limited(file, "program file", lambda size: require_length(size, file.name))
    content: Any = read_json(text, file.name).value
    return content["waypoints"].value[waypoint - 1].line
