"""How an arm is to follow: the five modes, the parameters that have an effect in each, and what is said of them."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

from rcilab.core.state import Mode
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import ControllerParameters, ControlPart
from rcilab.makers.rokae.driver.controller_parameters import Range, standard_control

if TYPE_CHECKING:
    from rcilab.core.limits import Limits
    from rcilab.i18n.translator import Text

PARTS_OF_MODE: dict[Mode, tuple[ControlPart, ...]] = {
    "joint_position": ("collision_thresholds", "filters", "report_filter"),
    "cartesian_position": ("collision_thresholds", "filters", "report_filter"),
    "joint_impedance": ("joint_stiffness", "collision_thresholds", "filters", "report_filter"),
    "cartesian_impedance": (
        "cartesian_stiffness",
        "desired_wrench",
        "collision_thresholds",
        "filters",
        "report_filter",
    ),
    "torque": ("collision_thresholds", "filters", "report_filter"),
}
"""What of the parameters has an effect in a mode."""
SECOND_THOUGHT = 10.0  # [s] A choice: a second press that comes later asks anew.

_AXES = ("x", "y", "z", "a", "b", "c")
_FILTERS = ("joint", "cartesian", "torque")


def shown_numbers(control: ControllerParameters | None, part: ControlPart, limits: Limits) -> tuple[float, ...]:
    """Returns the numbers of a part that stand in its fields: those wanted, or what a controller wakes up with."""
    numbers = None if control is None else getattr(control, part)
    return getattr(standard_control(limits), part) if numbers is None else numbers


def with_number(
    control: ControllerParameters | None, part: ControlPart, place: int, value: float, limits: Limits
) -> ControllerParameters:
    """Returns the parameters with another number among them."""
    numbers = list(shown_numbers(control, part, limits))
    numbers[place] = value
    return replace(control or ControllerParameters(), **{part: tuple(numbers)})


def is_control_pending(wanted: ControllerParameters | None, held: ControllerParameters | None) -> bool:
    """Returns whether a controller has not taken the parameters yet.

    Args:
        wanted: What it is to have; what is None is left as it is.
        held: What it has acknowledged.
    """
    if wanted is None:
        return False
    given = [(item.name, getattr(wanted, item.name)) for item in fields(wanted)]
    return any(value is not None and getattr(held, name, None) != value for name, value in given)


def control_obstacle(
    wanted: ControllerParameters | None, held: ControllerParameters | None, refusal: Message | None, address: str | None
) -> Message | None:
    """Returns why nothing may run with these parameters, or None when the controller has them.

    Args:
        wanted: What it is to have.
        held: What it has acknowledged.
        refusal: Why it did not take them; None: it did, or was not told yet.
        address: Of a controller that is not ours, which is told only when somebody says so; None: it is ours.
    """
    if not is_control_pending(wanted, held):
        return None
    if refusal is not None:
        return message("ready.control_refused", error=refusal)
    return message("ready.control_pending") if address is None else message("ready.control_unsent", address=address)


def ask_to_send(address: str) -> Message:
    """Returns the question before a controller that is not ours is told other parameters."""
    return message("control.sure", address=address, seconds=f"{SECOND_THOUGHT:.0f}")


def name_part(text: Text, part: ControlPart, ranges: tuple[Range, ...]) -> str:
    """Returns what a part is called, with units and ranges."""
    return f"{text(f'control.{part}')} {said_ranges(ranges)}"


def name_number(text: Text, part: ControlPart, place: int) -> str:
    """Returns what one number of a part is called."""
    if part in ("joint_stiffness", "collision_thresholds"):
        return text("control.joint", number=place + 1)
    if part == "filters":
        return text(f"control.filter.{_FILTERS[place]}")
    return text("control.filter.report") if part == "report_filter" else text(f"control.axis.{_AXES[place]}")


def said_ranges(ranges: tuple[Range, ...]) -> str:
    """Returns ranges and units in brackets, each once: "[0…75, 60, 45 N·m]" where only the upper ends differ."""
    ends: dict[tuple[float, str], dict[str, None]] = {}
    for item in ranges:
        ends.setdefault((item.low, item.unit), {})[f"{item.high:g}"] = None
    said = (f"{low:g}…{', '.join(highs)} {unit}" for (low, unit), highs in ends.items())
    return f"[{', '.join(said)}]"


def held_rows(
    mode: Mode, held: ControllerParameters | None, own: ControllerParameters, text: Text
) -> list[tuple[str, str]]:
    """Returns the parameters of a mode as the controller has acknowledged them, name and numbers.

    Args:
        mode: How the arm is to follow.
        held: What the controller has acknowledged.
        own: What it is known to have of its own.
        text: Words.
    """
    rows: list[tuple[str, str]] = []
    for part in PARTS_OF_MODE[mode]:
        given = None if held is None else getattr(held, part)
        numbers = getattr(own, part) if given is None else given
        rows.append((text(f"control.{part}"), text("control.own") if numbers is None else _shown(numbers)))
    return rows


def _shown(numbers: tuple[float, ...]) -> str:
    return f"{numbers[0]:g}" if len(set(numbers)) == 1 else " / ".join(f"{number:g}" for number in numbers)
