"""Options that describe an arm's configuration: joint angles, tool, load, safety box, soft joint limits.

Numbers are separated by commas. They are in SI units, or have a unit: after the last number of a group it is that of
the whole group, as in "0,30,0,60,0,90,0deg"; else each number of the group has one.
"""

from __future__ import annotations

import math
import re
from argparse import ArgumentParser, _ArgumentGroup
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rcilab.core.errors import InvalidValueError, UsageError

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.core.safety_box import SafetyBox
    from rcilab.core.spatial import Pose
    from rcilab.makers.configuration import SoftJointLimits
    from rcilab.model.dynamics.payload import Payload
    from rcilab.model.robot_model import RobotModel

JOINTS_FORM = "Q1,Q2,...[deg]"
TOOL_FORM = "X,Y,Z[mm][,RX,RY,RZ[deg]]"
LOAD_FORM = "MASS[@X,Y,Z[mm]]"
BOX_FORM = "SX,SY,SZ[mm]@X,Y,Z[mm][,RX,RY,RZ[deg]]"
SOFT_LIMITS_FORM = "LOW:HIGH,LOW:HIGH,...[deg]"

_LENGTH = {"": 1.0, "m": 1.0, "mm": 1e-3}  # [m]
_ANGLE = {"": 1.0, "rad": 1.0, "deg": math.radians(1.0)}  # [rad]
_MASS = {"": 1.0, "kg": 1.0, "g": 1e-3}  # [kg]
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([a-z]*)", re.ASCII | re.IGNORECASE)


def add_arm_options(parser: ArgumentParser | _ArgumentGroup) -> None:
    """Adds `--tool`, `--load` and `--box`; a value that begins with "-" is written after "=": `--tool=-0.1,0,0`."""
    parser.add_argument(
        "--tool",
        metavar=TOOL_FORM,
        help="tool in the flange frame, with turns about the fixed x, y and z axes: 0,0,120mm or 0,0,0.12,0,0,90deg; "
        "or the name of a tool of the maker, with its mass: hand (Franka)",
    )
    parser.add_argument(
        "--load", metavar=LOAD_FORM, help="load and its centre of mass in the flange frame: 2 or 2@0,0,50mm"
    )
    parser.add_argument(
        "--box", metavar=BOX_FORM, help="safety box: edges, and its centre in the base frame: 1,1,1@0.4,0,0.5"
    )


def add_cell_option(parser: ArgumentParser | _ArgumentGroup, text: str) -> None:
    """Adds `--cell`, with its help."""
    parser.add_argument("--cell", metavar="CELL", help=f"file of the arm's cell (.json or .zip): {text}")


def describe_arm(model: RobotModel, box: SafetyBox | None) -> str:
    """Returns tool, load, soft limits and safety box of an arm in one line; "" without any of them."""
    from rcilab.core.spatial import IDENTITY

    parts: list[str] = []
    tool, load = model.T_flange_tool, model.load
    if not tool.is_close(IDENTITY):
        turns = [math.degrees(turn) for turn in tool.rpy]
        turned = f" turned by {_listed(turns)} deg" if any(abs(turn) > 1e-6 for turn in turns) else ""
        parts.append(f"tool {_listed(1e3 * tool.position)} mm{turned}")
    if load.mass > 0.0:
        parts.append(f"load {load.mass:g} kg at {_listed(1e3 * load.center_of_mass)} mm")
    limits = model.limits.joint
    if limits.own is not None:
        bounds = zip(limits.lower, limits.upper, limits.own.lower, limits.own.upper, strict=True)
        changed = [
            f"joint {number} {math.degrees(lower):g} to {math.degrees(upper):g}"
            for number, (lower, upper, *own) in enumerate(bounds, 1)
            if [lower, upper] != own
        ]
        parts.append(f"soft limits {', '.join(changed)} deg")
    if box is not None:
        edges = " x ".join(f"{1e3 * edge:g}" for edge in box.size)
        parts.append(f"safety box {edges} mm around {_listed(1e3 * box.T_base_box.position)} mm")
    return f"with {', '.join(parts)}" if parts else ""


def parse_joints(text: str, count: int, option: str = "--start") -> tuple[float, ...]:
    """Parses joint angles, such as `0,30,0,60,0,90,0deg`.

    Args:
        text: The angles.
        count: Number of joints.
        option: Name of the option in errors.

    Returns:
        n angles, [rad].

    Raises:
        InvalidValueError: The text is not valid.
    """
    return _quantities(text, text.split(","), count, _ANGLE, option, f"{JOINTS_FORM} with {count} joint angles")


def parse_angles(text: str, option: str) -> tuple[float, ...]:
    """Parses any number of angles, [rad]; `option` is their name in errors.

    Raises:
        InvalidValueError: The text is not valid.
    """
    return _quantities(text, text.split(","), text.count(",") + 1, _ANGLE, option, JOINTS_FORM)


def parse_lengths(text: str, option: str) -> tuple[float, ...]:
    """Parses three lengths, [m]; `option` is their name in errors.

    Raises:
        InvalidValueError: The text is not valid.
    """
    return _quantities(text, text.split(","), 3, _LENGTH, option, "X,Y,Z[mm]")


def parse_mass(text: str, option: str) -> float:
    """Parses a mass, such as `2000g`, [kg]; `option` is its name in errors.

    Raises:
        InvalidValueError: The text is not valid.
    """
    (mass,) = _quantities(text, [text], 1, _MASS, option, "MASS[g]")
    return mass


def parse_tool(text: str, option: str = "--tool") -> Pose:
    """Parses the pose of a tool in the flange frame, such as `0,0,120mm,0,0,90deg`.

    Raises:
        InvalidValueError: The text is not valid.
    """
    from rcilab.makers.maker import Capabilities

    tool = _pose(text, text, option, TOOL_FORM)
    distance, longest = math.hypot(*tool.position.tolist()), Capabilities().longest_tool
    if distance > longest:
        problem = f"is {distance:g} m from the flange, at most {longest:g} m; lengths without a unit are in m"
        raise InvalidValueError(option, text, problem)
    return tool


def parse_tool_and_load(tool: str | None, load: str | None, model: str | None) -> tuple[Pose | None, Payload | None]:
    """Parses `--tool` and `--load`; a tool may be given by name, and its mass is then the load unless one is given.

    Args:
        tool: The pose, or a name such as `hand`; None: not given.
        load: The load; None: not given.
        model: Name of the arm, for tools by name; None: there are none.

    Raises:
        InvalidValueError: A text is not valid, or the arm has no tool of this name.
    """
    from rcilab.model.robot_model import find_tool
    from rcilab.robots import describe_robot

    body = None if load is None else parse_load(load)
    if tool is None:
        return None, body
    if model is None or not tool[:1].isalpha():
        return parse_tool(tool), body
    try:
        pose, own = find_tool(describe_robot(model), tool)
    except InvalidValueError as error:
        raise _named(error, "--tool") from error
    return pose, own if body is None else body


def parse_load(text: str, option: str = "--load") -> Payload:
    """Parses the load at the flange, such as `2@0,0,50mm`: a point mass.

    Raises:
        InvalidValueError: The text is not valid.
    """
    from rcilab.model.dynamics.payload import Payload

    mass, at, position = text.partition("@")
    (kilograms,) = _quantities(text, [mass], 1, _MASS, option, f"{LOAD_FORM} with a mass in kg")
    center = _quantities(text, position.split(","), 3, _LENGTH, option, LOAD_FORM) if at else (0.0, 0.0, 0.0)
    try:
        return Payload(mass=kilograms, center_of_mass=center)  # pyright: ignore[reportArgumentType]  # Converted.
    except InvalidValueError as error:
        raise _named(error, option) from error


def parse_box(text: str, option: str = "--box") -> SafetyBox:
    """Parses a safety box, such as `1,1,1@0.4,0,0.5`.

    Raises:
        InvalidValueError: The text is not valid.
    """
    from rcilab.core.safety_box import SafetyBox

    edges, at, pose = text.partition("@")
    if not at:
        raise _invalid(text, option, f"{BOX_FORM} with its centre after @")
    size = _quantities(text, edges.split(","), 3, _LENGTH, option, BOX_FORM)
    T_base_box = _pose(text, pose, option, BOX_FORM)
    try:
        return SafetyBox(size=size, T_base_box=T_base_box)
    except InvalidValueError as error:
        raise _named(error, option) from error


def read_cell(file: str | Path | None, *others: object) -> Cell | None:
    """Returns the cell in the file of `--cell`; None without one.

    Args:
        file: Its name.
        others: The values of `--tool` and `--load`, which are not given with a cell.

    Raises:
        UsageError: One of them is given.
        InvalidValueError: The file does not exist, or its cell is not valid; the message names the line.
        VersionMismatchError: It has another version of this format.
    """
    from rcilab.cell.cell import Cell

    if file is None:
        return None
    if any(value is not None for value in others):
        raise UsageError("--cell has the tool and the load of the arm: leave out --tool and --load")
    return Cell.load(file)


def parse_soft_limits(text: str, count: int, option: str = "--soft-limits") -> SoftJointLimits:
    """Parses soft joint limits, such as `-160:160,-110:110,...,-350:350deg`.

    Args:
        text: A range for each joint.
        count: Number of joints.
        option: Name of the option in errors.

    Raises:
        InvalidValueError: The text is not valid, or a range is empty.
    """
    from rcilab.makers.configuration import SoftJointLimits

    form = f"{SOFT_LIMITS_FORM} with {count} ranges"
    ranges = [part.split(":") for part in text.split(",")]
    if len(ranges) != count or any(len(pair) != 2 for pair in ranges):
        raise _invalid(text, option, form)
    bounds = _quantities(text, [bound for pair in ranges for bound in pair], 2 * count, _ANGLE, option, form)
    lower, upper = bounds[::2], bounds[1::2]
    for joint, (low, high) in enumerate(zip(lower, upper, strict=True), 1):
        if low >= high:
            pair = ":".join(ranges[joint - 1])
            raise InvalidValueError(
                option, text, f"has an empty range {pair} for joint {joint}; the lower bound is first"
            )
    return SoftJointLimits(lower=lower, upper=upper)


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(f"{number:.6g}" for number in numbers)


def _pose(text: str, part: str, option: str, form: str) -> Pose:
    from rcilab.core.spatial import Pose

    numbers = part.split(",")
    if len(numbers) not in (3, 6):
        raise _invalid(text, option, form)
    position = _quantities(text, numbers[:3], 3, _LENGTH, option, form)
    turns = _quantities(text, numbers[3:], 3, _ANGLE, option, form) if numbers[3:] else (0.0, 0.0, 0.0)
    return Pose.from_rpy(position, require_turns(turns, option))


def require_turns(turns: tuple[float, ...], name: str) -> tuple[float, ...]:
    """Returns turns about three axes, [rad], if none is more than a full one.

    Raises:
        InvalidValueError: One is: degrees without their unit.
    """
    if max(map(abs, turns)) > math.tau:
        raise InvalidValueError(name, list(turns), "turns by more than 2 pi; angles without a unit are in rad")
    return turns


def _quantities(
    text: str, parts: list[str], count: int, units: dict[str, float], option: str, form: str
) -> tuple[float, ...]:
    """Returns the numbers of a group in SI units; `text` is the whole value, for errors."""
    found = [_NUMBER.fullmatch(part.strip()) for part in parts]
    if len(parts) != count or not all(found):
        raise _invalid(text, option, form)
    values = [(float(match[1]), match[2].lower()) for match in found if match]
    for _, unit in values:
        if unit not in units:
            known = " or ".join(name for name in units if name)
            raise InvalidValueError(option, text, f"has the unit {unit!r} where {known} is expected")
    with_unit = [bool(unit) for _, unit in values]
    if any(with_unit[:-1]) and not all(with_unit):
        raise InvalidValueError(
            option, text, "has units at some numbers of a group only: write one after the last, or one after each"
        )
    common = values[-1][1]
    scaled = tuple(value * units[unit or common] for value, unit in values)
    if not all(map(math.isfinite, scaled)):
        raise InvalidValueError(option, text, "has a number that is not finite")
    return scaled


def _invalid(text: str, option: str, form: str) -> InvalidValueError:
    return InvalidValueError(option, text, f"is not of the form {form}")


def _named(error: InvalidValueError, option: str) -> InvalidValueError:
    """Returns the error of a value with the name of the option before that of the value."""
    return InvalidValueError(f"{option}: {error.name}", error.value, error.requirement)
