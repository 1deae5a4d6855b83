"""The configuration file of an arm, `rcilab controller my_arm.toml`: settings of a teach pendant, and options.

Numbers are in SI units: `start = [0, 0.52, 0, 1.05, 0, 1.57, 0]`. A text is as on the command line and may have a unit:
`start = "0,30,0,60,0,90,0deg"`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from rcilab.cli.arm_options import parse_angles, parse_lengths, parse_mass, require_turns
from rcilab.core.atomic_file import read_limited
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.sim.api.fields import as_flag, as_float, as_floats, as_integer, as_joints

_LARGEST = 10_000  # [bytes] Ten times a full configuration file; of the worst content, 40 000 bytes take 5 s to parse.
_LARGEST_NUMBER = 2**31
_Read = Callable[[Any, str], object]


@dataclass(frozen=True, slots=True)
class ArmFile:
    """Options from a file, by the names of the command line's options."""

    options: Mapping[str, object]
    """Values: a text as on the command line, or already of the type of the configuration."""
    keys: Mapping[str, str]
    """For an error, where each option is in the file, such as "my_arm.toml: [arm] start"."""


def read_arm_file(file: Path) -> ArmFile:
    """Returns the options in a configuration file.

    Raises:
        InvalidValueError: The file cannot be read or is not TOML; a section or key is unknown or has a wrong value.
    """
    content = _parse(read_limited(file, "configuration file", lambda size: _require_size(file, size)), file)
    options: dict[str, object] = {}
    keys: dict[str, str] = {}
    for section, table in content.items():
        if section not in _SECTIONS:
            raise InvalidValueError(f"{file}", f"[{section}]", f"is unknown; known: {', '.join(_SECTIONS)}")
        where = f"{file}: [{section}]"
        readers = _SECTIONS[section]
        if not isinstance(table, dict):
            raise InvalidValueError(where, table, "needs keys and values in lines of their own")
        entries = cast("dict[str, Any]", table)
        for key in entries.keys() - readers.keys():
            raise InvalidValueError(where, key, f"is unknown; known: {', '.join(readers)}")
        values = {key: readers[key](value, f"{where} {key}") for key, value in entries.items()}
        if section in _BUILDERS:
            options[section] = _build(section, values, where)
            keys[section] = where
        else:
            options |= values
            keys |= {key: f"{where} {key}" for key in values}
    return ArmFile(options, keys)


def _parse(data: bytes, file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(data.decode())
    except (ValueError, RecursionError) as error:  # Not UTF-8, or not TOML.
        raise InvalidValueError("configuration file", str(file), f"is not valid TOML: {error}") from error


def _require_size(file: Path, size: int) -> None:
    if size > _LARGEST:
        raise InvalidValueError("configuration file", str(file), f"has {size} bytes; at most {_LARGEST} are expected")


def _text(value: Any, name: str) -> str:
    if not isinstance(value, str):
        raise InvalidValueError(name, value, "needs a text in quotation marks")
    return value


def _whole(value: Any, name: str) -> int:
    return as_integer(value, name, 0, _LARGEST_NUMBER)


def _number(value: Any, name: str) -> float:
    return as_float(value, name, "")


def _angles(value: Any, name: str) -> tuple[float, ...]:
    return parse_angles(value, name) if isinstance(value, str) else as_joints(value, name, "rad")


def _lengths(value: Any, name: str) -> tuple[float, ...]:
    return parse_lengths(value, name) if isinstance(value, str) else as_floats(value, 3, name, "m")


def _turns(value: Any, name: str) -> tuple[float, ...]:
    return require_turns(_angles(value, name) if isinstance(value, str) else as_floats(value, 3, name, "rad"), name)


def _mass(value: Any, name: str) -> float:
    return parse_mass(value, name) if isinstance(value, str) else as_float(value, name, "kg")


def _inertia(value: Any, name: str) -> tuple[float, ...]:
    return as_floats(value, 9, name, "kg m^2")


def _signals(value: Any, name: str) -> tuple[int, ...]:
    if not isinstance(value, list):
        raise InvalidValueError(name, value, "needs a list of signal numbers, such as [0, 3]")
    return tuple(_whole(signal, name) for signal in cast("list[Any]", value))


_SECTIONS: dict[str, dict[str, _Read]] = {
    "arm": {"model": _text, "start": _angles, "di": _signals},
    "tool": {"position": _lengths, "rpy": _turns},
    "load": {"mass": _mass, "center_of_mass": _lengths, "inertia": _inertia},
    "box": {"size": _lengths, "center": _lengths, "rpy": _turns},
    "soft_limits": {"lower": _angles, "upper": _angles},
    "controller": {
        "host": _text,
        "port": _whole,
        "udp_port": _whole,
        "client": _text,
        "plant": _text,
        "cell": _text,
        "realism": _text,
        "lockstep": as_flag,
        "mode_delay": _number,
        "prefill": _whole,
        "patience": _number,
        "lost_limit": _whole,
        "on_loss": _text,
        "auto_limit": as_flag,
        "loop_back": as_flag,
        "fresh": as_flag,
        "generation": _whole,
        "limits": _text,
        "force_sign": _text,
        "world_port": _whole,
        "no_world": as_flag,
        "log_format": _text,
        "record": _text,
    },
}
"""Every key of a configuration file and the reader of its value. Without a unit, numbers are in SI units."""


def _tool(position: tuple[float, ...] = (0.0, 0.0, 0.0), rpy: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Pose:
    return Pose.from_rpy(position, rpy)


def _load(
    mass: float, center_of_mass: tuple[float, ...] = (0.0, 0.0, 0.0), inertia: tuple[float, ...] = (0.0,) * 9
) -> Payload:
    return Payload(mass=mass, center_of_mass=center_of_mass, inertia=inertia)  # pyright: ignore[reportArgumentType]  # Converted.


def _box(size: tuple[float, ...], center: tuple[float, ...], rpy: tuple[float, ...] = (0.0, 0.0, 0.0)) -> SafetyBox:
    return SafetyBox(size=size, T_base_box=Pose.from_rpy(center, rpy))


def _soft_limits(lower: tuple[float, ...], upper: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return lower, upper


_BUILDERS: dict[str, tuple[Callable[..., object], tuple[str, ...]]] = {
    "tool": (_tool, ()),
    "load": (_load, ("mass",)),
    "box": (_box, ("size", "center")),
    "soft_limits": (_soft_limits, ("lower", "upper")),
}
"""Sections that are one value, with its required keys."""


def _build(section: str, values: dict[str, object], where: str) -> object:
    build, required = _BUILDERS[section]
    for key in required:
        if key not in values:
            raise InvalidValueError(f"{where} {key}", None, "is missing")
    try:
        return build(**values)
    except InvalidValueError as error:
        raise InvalidValueError(f"{where}: {error.name}", error.value, error.requirement) from error
