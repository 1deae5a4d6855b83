"""The files that commands take for a motion: one saved with `Motion.save`, or a program in JSON that is planned."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion, Program

HELP = "motion (.npz or .csv, from Motion.save) or program (.json, from Program.save)"


def add_max_rows(parser: ArgumentParser) -> None:
    """Adds the option that lets a large file in."""
    parser.add_argument(
        "--max-rows",
        type=int,
        default=DEFAULT_MAX_ROWS,
        metavar="N",
        help="cycles of 1 ms that the file may hold, with 1 KiB each, unpacked (default: %(default)s, 17 minutes)",
    )


def read_file(file: Path, max_rows: int = DEFAULT_MAX_ROWS) -> Motion | Program:
    """Returns the motion or, where the name ends in .json, the program in a file.

    Args:
        file: Its name.
        max_rows: How many cycles of 1 ms a motion may have.

    Raises:
        InvalidValueError: There is no such file, it holds neither, or too much.
        VersionMismatchError: It was written by another version of its format.
    """
    from rcilab.motion import Motion, Program

    if file.suffix.lower() == ".rcirun" and file.is_file():
        raise InvalidValueError("motion file", file.name, f"is a recorded run: look at it with `rcilab replay {file}`")
    return Program.load(file) if file.suffix.lower() == ".json" else Motion.load(file, max_rows=max_rows)


def as_motion(
    found: Motion | Program,
    model: RobotModel,
    file: Path,
    show: Callable[[str], None] = print,
    max_rows: int = DEFAULT_MAX_ROWS,
) -> Motion:
    """Returns the motion; a program is planned, and the notes of its planner are shown.

    Args:
        found: What `read_file` has returned.
        model: The arm.
        file: What it was read from, to name the line of a waypoint that cannot be planned.
        show: Called with every line of text.
        max_rows: How many cycles of 1 ms it may take.

    Raises:
        PlanningError: The program cannot be planned.
        InvalidValueError: It is for another arm.
    """
    from rcilab.core.errors import PlanningError
    from rcilab.motion import Program, plan_program

    if not isinstance(found, Program):
        return found
    try:
        motion = plan_program(model, found, law="torque_rate_limited", max_rows=max_rows)
    except PlanningError as error:
        if error.waypoint is None:
            raise
        line = _line_of(error.waypoint, file)
        raise PlanningError(f"{file.name}, line {line}, {error}", waypoint=error.waypoint) from error
    for note in motion.notes:
        show(f"note: {note}")
    return motion


def _line_of(waypoint: int, file: Path) -> int:
    """Returns the line of a waypoint, from 1, in the file of a program that was read before."""
    from rcilab.motion.located_json import read_json

    content: Any = read_json(file.read_bytes(), file.name).value
    return content["waypoints"].value[waypoint - 1].line
