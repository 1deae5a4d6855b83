"""The parameters of a mode: as set, as the controller has them, and as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.state import Mode
from rcilab.i18n.translator import Message, message
from rcilab.makers.configuration import ControllerParameters
from rcilab.makers.parameters import ParameterGroup

if TYPE_CHECKING:
    from rcilab.i18n.translator import Text

CONFIRM_TIMEOUT = 10.0  # [s] Tuning value: time to read the question; a later press asks again.


def find_group(groups: tuple[ParameterGroup, ...], name: str) -> ParameterGroup | None:
    """Returns the group of a name; None: there is no such group."""
    return next((group for group in groups if group.name == name), None)


def shown_numbers(control: ControllerParameters | None, group: ParameterGroup) -> tuple[float, ...]:
    """Returns the numbers of a group for its fields: those set, or the controller's defaults."""
    return group.defaults if control is None else control.get(group.name, group.defaults)


def with_number(
    control: ControllerParameters | None, group: ParameterGroup, index: int, value: float
) -> ControllerParameters:
    """Returns the parameters with one number changed."""
    numbers = list(shown_numbers(control, group))
    numbers[index] = value
    return ControllerParameters(**{**(control or {}), group.name: tuple(numbers)})


def is_control_pending(wanted: ControllerParameters | None, held: ControllerParameters | None) -> bool:
    """Returns whether a controller has not accepted the parameters yet.

    Args:
        wanted: The parameters as set; missing groups are left unchanged.
        held: The acknowledged parameters.
    """
    return any((held or {}).get(name) != values for name, values in (wanted or {}).items())


def control_obstacle(
    wanted: ControllerParameters | None, held: ControllerParameters | None, refusal: Message | None, address: str | None
) -> Message | None:
    """Returns why no motion may run with these parameters, or None if the controller has them.

    Args:
        wanted: The parameters as set.
        held: The acknowledged parameters.
        refusal: Why it refused them; None: it accepted them, or has not received them yet.
        address: Address of a real controller, which gets them only after a confirmation; None: a virtual one.
    """
    if not is_control_pending(wanted, held):
        return None
    if refusal is not None:
        return message("ready.control_refused", error=refusal)
    return message("ready.control_pending") if address is None else message("ready.control_unsent", address=address)


def ask_to_send(address: str) -> Message:
    """Returns the question before other parameters are sent to a real controller."""
    return message("control.sure", address=address, seconds=f"{CONFIRM_TIMEOUT:.0f}")


def name_group(text: Text, group: ParameterGroup) -> str:
    """Returns the name of a group, with units, and with its ranges if there are few."""
    return f"{text(f'control.{group.name}')} {units_of(group)}"


def units_of(group: ParameterGroup) -> str:
    """Returns the units of a group in brackets, with its ranges if there are few."""
    return f"[{group.parameters[0].unit}]" if has_own_ranges(group) else format_ranges(group)


def has_own_ranges(group: ParameterGroup) -> bool:
    """Returns whether the ranges of a group are too many for its name: each stands beside its parameter."""
    return len({item.unit for item in group.parameters}) == 1 and len({item.high for item in group.parameters}) > 2


def name_parameter(text: Text, group: ParameterGroup, index: int) -> str:
    """Returns the label of a parameter, with its range if that is not in the name of the group."""
    item = group.parameters[index]
    label = text.render(item.label)
    return f"{label} [{item.low:g}…{item.high:g}]" if has_own_ranges(group) else label


def format_ranges(group: ParameterGroup) -> str:
    """Returns ranges and units in brackets, each once: "[0…75, 60, 45 N·m]" where only the upper ends differ."""
    bounds: dict[tuple[float, str], dict[str, None]] = {}
    for item in group.parameters:
        bounds.setdefault((item.low, item.unit), {})[f"{item.high:g}"] = None
    units: dict[str, list[str]] = {}
    for (low, unit), highs in bounds.items():
        units.setdefault(f"{low:g}…{', '.join(highs)}", []).append(unit)
    shown = (f"{ends} {', '.join(names)}".rstrip() for ends, names in units.items())
    return f"[{', '.join(shown)}]"


def held_rows(
    groups: tuple[ParameterGroup, ...],
    mode: Mode | None,
    held: ControllerParameters | None,
    text: Text,
    *,
    is_known: bool,
) -> list[tuple[str, str]]:
    """Returns the acknowledged parameters of a mode, or of all (None), name and numbers.

    Args:
        groups: Parameter groups of the arm.
        mode: The mode, or None.
        held: The acknowledged parameters.
        text: The catalogue.
        is_known: Whether the others have their defaults: the controller is ours.
    """
    rows: list[tuple[str, str]] = []
    for group in groups:
        if mode is None or mode in group.modes:
            numbers = (held or {}).get(group.name, group.defaults if is_known else None)
            rows.append((text(f"control.{group.name}"), text("control.own") if numbers is None else _shown(numbers)))
    return rows


def _shown(numbers: tuple[float, ...]) -> str:
    return f"{numbers[0]:g}" if len(set(numbers)) == 1 else " / ".join(f"{number:g}" for number in numbers)
