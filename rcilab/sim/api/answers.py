"""Responses of the simulation port."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeAlias, cast

from rcilab.i18n.translator import Remark
from rcilab.sim.api.faults import NetworkFaults
from rcilab.sim.api.fields import as_flag, as_float, as_floats, as_integer
from rcilab.sim.api.requests import SetBox, SetLoad, SetSoftLimits, SetTool


@dataclass(frozen=True, slots=True)
class Done:
    """The request was carried out."""


@dataclass(frozen=True, slots=True)
class Refused:
    """The request was valid but refused."""

    reason: str
    """One English sentence: what, why, what to do."""
    code: str = ""
    """Code of the error, as `RcilabError.code`; "" without one."""
    facts: Mapping[str, object] = field(default_factory=dict[str, object])
    """Values of the placeholders: numbers and text."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldStatus:
    """Status of the virtual controller beyond its RCI state."""

    model: str
    """Name of the arm."""
    plant: str
    """Kind of plant: ideal or mujoco."""
    cycle: int
    """Number of the newest cycle; the message id of its state."""
    phase: str
    """Phase of the controller."""
    faults: tuple[str, ...] = ()
    """Names of the error bits that are set."""
    reason: str = ""
    """Reason for the last fault; a `Remark` if user interfaces can translate it."""
    button: str = "none"
    """Which safety stop is pressed: none, estop, gstop, switch."""
    q: tuple[float, ...] = ()
    """Measured joint angles, [rad]."""
    lost: int = 0
    """Cycles of the last motion without a command; it may have come late, or never."""
    lost_in_row: int = 0
    """Most of them in a row. A motion ends after `lost_limit`, and 30 more where commands are held (not torques)."""
    success_rate: float = 1.0
    """As in the state, 0 to 1."""
    missed: int = 0
    """Cycles that were skipped because the controller's process was late."""
    bad_datagrams: int = 0
    """Datagrams of the client that did not have the size of a command."""
    unknown_senders: int = 0
    """Datagrams from other senders than the client."""
    ignored: int = 0
    """Commands that arrived while none was expected."""
    pushed: bool = False
    """Whether an external force acts on the arm."""
    stalls: int = 0
    """Number of simulated stalls of the clock."""
    auto_limit: bool | None = None
    """Whether commands are stopped inside the soft limits; None: an older controller does not report it."""
    commands: NetworkFaults = field(default_factory=NetworkFaults)
    """Faults of the network towards the controller."""
    states: NetworkFaults = field(default_factory=NetworkFaults)
    """Faults of the network towards the client, TCP included."""
    pid: int = 0
    """Id of the controller's process; 0: unknown."""
    record: int = -1
    """Its descriptor of the record of all cycles, see `rcilab.core.cycle_ring`; -1: it keeps none."""

    tool: SetTool | None = None
    """The configuration in force, each as the request that sets it; None: an older controller does not report it."""
    load: SetLoad | None = None
    box: SetBox | None = None
    """None: there is no safety box."""
    soft_limits: SetSoftLimits | None = None
    inputs: tuple[int, ...] | None = None
    """Numbers of the digital inputs that are high."""
    on_loss: str = ""
    """What the arm does while commands are missing, from the next motion on; "": an older controller."""


WorldAnswer: TypeAlias = Done | Refused | WorldStatus

_COUNTS = ("cycle", "lost", "lost_in_row", "missed", "bad_datagrams", "unknown_senders", "ignored", "stalls", "pid")
_LARGEST_COUNT = 2**63
_SETUP = {"tool": SetTool, "load": SetLoad, "box": SetBox, "soft_limits": SetSoftLimits}
_MOST_INPUTS = 32


def status_as_dict(status: WorldStatus) -> dict[str, Any]:
    """Returns a status as a JSON object."""
    content = _values(status)
    content |= {name: _values(content[name]) for name in _SETUP if content[name] is not None}
    if isinstance(status.reason, Remark) and status.reason.code:
        content["remark"] = status.reason.as_dict()
    return content | {"commands": status.commands.as_dict(), "states": status.states.as_dict()}


def _values(item: WorldStatus | SetTool | SetLoad | SetBox | SetSoftLimits) -> dict[str, Any]:
    return {each.name: getattr(item, each.name) for each in fields(item)}


def status_from_dict(content: dict[str, Any]) -> WorldStatus:
    """Returns the status in a JSON object.

    Raises:
        InvalidValueError: A value is of the wrong kind.
        TypeError: A name is unknown or missing.
    """
    checked = dict(content)
    known, needed = {item.name for item in fields(WorldStatus)} | {"remark"}, ("model", "plant", "cycle", "phase")
    wrong = [*(f"{name} is missing" for name in needed if name not in checked)]
    wrong += [f"{name} is unknown" for name in sorted(checked.keys() - known)]
    if wrong:
        raise TypeError(wrong[0])
    for name in _COUNTS:
        if name in checked:
            checked[name] = as_integer(checked[name], name, 0, _LARGEST_COUNT)
    if "record" in checked:
        checked["record"] = as_integer(checked["record"], "record", -1, _LARGEST_COUNT)
    checked["reason"] = _reason(checked.get("reason", ""), checked.pop("remark", None))
    for name in ("model", "plant", "phase", "button", "on_loss"):
        if name in checked:
            checked[name] = _text(checked[name])
    if "faults" in checked:
        checked["faults"] = tuple(_text(name) for name in _items(checked["faults"]))
    if "q" in checked:
        checked["q"] = as_floats(checked["q"], len(_items(checked["q"])), "q", "rad")
    if "success_rate" in checked:
        checked["success_rate"] = as_float(checked["success_rate"], "success_rate", "", 0.0, 1.0)
    if "pushed" in checked:
        checked["pushed"] = as_flag(checked["pushed"], "pushed")
    if checked.get("auto_limit") is not None:
        checked["auto_limit"] = as_flag(checked["auto_limit"], "auto_limit")
    for name, kind in _SETUP.items():
        if checked.get(name) is not None:
            checked[name] = kind(**checked[name])
    if checked.get("inputs") is not None:
        checked["inputs"] = tuple(as_integer(n, "inputs", 0, _MOST_INPUTS) for n in _items(checked["inputs"]))
    for name in ("commands", "states"):
        if name in checked:
            checked[name] = NetworkFaults(**checked[name])
    return WorldStatus(**checked)


def _reason(sentence: object, coded: object) -> str:
    try:
        return _text(sentence) if coded is None else Remark.from_dict(cast("dict[str, Any]", coded))
    except (AttributeError, LookupError, RecursionError) as error:
        raise TypeError("the remark on the last fault is not valid") from error


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is not a text")
    return value


def _items(value: object) -> list[object]:
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is not a list")
    return value  # pyright: ignore[reportUnknownVariableType]
