"""The parameters of a mode: as set, as the controller has them, and as text."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

from rcilab.core.state import Mode
from rcilab.i18n.translator import Message, message
from rcilab.i18n.units import USUAL, Units, plain_number
from rcilab.makers.configuration import ControllerParameters
from rcilab.makers.parameters import Parameter, ParameterGroup

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus
    from rcilab.i18n.translator import Text

_DECIMALS = 6  # Of a converted range, so that its ends can be typed.
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
    return f"{text(f'control.{group.name}')} {units_of(group, text.units)}".rstrip()


def units_of(group: ParameterGroup, units: Units) -> str:
    """Returns the units of a group in brackets, with its ranges if there are few; "" if each parameter has its own."""
    if is_mixed(group):
        return ""
    unit = units.from_si(group.parameters[0].unit)[1]
    return f"[{unit}]" if has_own_ranges(group) else format_ranges(group, units)


def is_mixed(group: ParameterGroup) -> bool:
    """Returns whether the numbers of a group are different quantities: each is shown with its name and unit."""
    return 1 < len(group.parameters) == len({item.unit for item in group.parameters})


def has_own_ranges(group: ParameterGroup) -> bool:
    """Returns whether the ranges of a group are too many for its name: each stands beside its parameter."""
    return len({item.unit for item in group.parameters}) == 1 and len({item.high for item in group.parameters}) > 2


def name_parameter(text: Text, group: ParameterGroup, index: int) -> str:
    """Returns the label of a parameter, with its range if that is not in the name of the group."""
    item = group.parameters[index]
    label = text.render(item.label)
    if not (has_own_ranges(group) or is_mixed(group)):
        return label
    low, high = _plain(item.low, item, text.units), _plain(item.high, item, text.units)
    unit = f" {text.units.from_si(item.unit)[1]}" if is_mixed(group) else ""
    return f"{label} [{low}…{high}{unit}]"


def format_ranges(group: ParameterGroup, units: Units = USUAL) -> str:
    """Returns ranges and units in brackets, each once: "[0…75, 60, 45 N·m]" where only the upper ends differ."""
    bounds: dict[tuple[str, str], dict[str, None]] = {}
    for item in group.parameters:
        bounds.setdefault((_plain(item.low, item, units), item.unit), {})[_plain(item.high, item, units)] = None
    named: dict[str, list[str]] = {}
    for (low, unit), highs in bounds.items():
        named.setdefault(f"{low}…{', '.join(highs)}", []).append(units.from_si(unit)[1])
    shown = (f"{ends} {', '.join(names)}".rstrip() for ends, names in named.items())
    return f"[{', '.join(shown)}]"


def typed_scale(item: Parameter) -> tuple[float, str]:
    """Returns factor and name of the unit in which a parameter is typed: 57.3 and °/s for rad/s."""
    return USUAL.from_si(item.unit)


def typed_range(item: Parameter) -> tuple[float, float]:
    """Returns the range of a parameter in the unit in which it is typed."""
    factor = typed_scale(item)[0]
    return round(factor * item.low, _DECIMALS), round(factor * item.high, _DECIMALS)


def typed_value(item: Parameter, number: float) -> float:
    """Returns a typed number in the unit of the parameter, inside its range."""
    return min(max(number / typed_scale(item)[0], item.low), item.high)


def held_rows(
    groups: tuple[ParameterGroup, ...],
    mode: Mode | None,
    status: SupervisorStatus,
    text: Text,
    *,
    is_known: bool,
) -> list[tuple[str, str]]:
    """Returns the controller's parameters of a mode, or of all (None), name and numbers.

    Args:
        groups: Parameter groups of the arm.
        mode: The mode, or None.
        status: With the parameters that the controller has acknowledged, or reported.
        text: The catalogue.
        is_known: Whether the others have their defaults: the controller is ours.
    """
    held = {**(status.setup.control or {}), **(status.reported.control or {})}
    rows: list[tuple[str, str]] = []
    for group in groups:
        if mode is None or mode in group.modes:
            numbers = held.get(group.name, group.defaults if is_known else None)
            shown = text("control.own") if numbers is None else _shown(group, numbers, text)
            rows.append((text(f"control.{group.name}"), shown))
    return rows


def _shown(group: ParameterGroup, numbers: tuple[float, ...], text: Text) -> str:
    units = text.units
    shown = [_plain(number, item, units) for number, item in zip(numbers, group.parameters, strict=True)]
    if is_mixed(group):
        named = (
            f"{text.render(item.label)} {units.with_unit(number, item.unit)}"
            for number, item in zip(shown, group.parameters, strict=True)
        )
        return reduce(lambda first, second: text("joined", first=first, second=second), named)
    return shown[0] if len(set(shown)) == 1 else " / ".join(shown)


def _plain(number: float, item: Parameter, units: Units) -> str:
    return plain_number(units.from_si(item.unit)[0] * number, 5)
