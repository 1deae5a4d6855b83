"""The file of one arm: the controller's description of it, in JSON, for `load_model("my_arm.json")`.

    {"format": "rcilab arm", "version": 1, "model": "xMatePro7", "source": "LoadRobotModel of rci://...",
     "dh": [[a, alpha, d, theta], ...], "links": [{"mass", "center_of_mass", "inertia"}, ...],
     "friction": {"viscous", "coulomb", "offset"} or null}

One row and one link for each joint; SI units; standard Denavit-Hartenberg rows. Frames of the links and all limits are
those of the named model.
"""

from __future__ import annotations

import json
from dataclasses import replace
from math import remainder, tau
from pathlib import Path
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, as_number, as_vector, described, readonly_copy
from rcilab.core.atomic_file import read_limited, replacing
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.robots import DhRow, RobotDescription, describe_robot

FORMAT, VERSION = "rcilab arm", 1
ENDING = ".json"
_LARGEST = 100_000  # [bytes] An arm has 3000.
_LENGTH, _ANGLE = 0.1, 0.2  # [m], [rad] Largest differences from the named arm: a calibration is some millimetres.
_MASS, _FARTHEST, _INERTIA = 1000.0, 10.0, 1000.0  # [kg], [m], [kg m^2] Of a link.
_LARGEST_FRICTION = 1e5  # [N m], [N m s/rad]


def save_arm(arm: RobotDescription, file: str | Path, source: str = "") -> None:
    """Writes an arm to a file.

    Args:
        arm: The arm.
        file: Its name ends in .json; an existing file is replaced.
        source: Where the numbers come from.

    Raises:
        InvalidValueError: The name does not end in .json, or the file cannot be written.
    """
    path = Path(file)
    if path.suffix.lower() != ENDING:
        raise InvalidValueError("arm file", str(file), "must end in .json")
    try:
        with replacing(path) as stream:
            stream.write((json.dumps(arm_facts(arm, source), indent=1) + "\n").encode())
    except OSError as error:
        raise InvalidValueError("arm file", str(file), f"cannot be written: {error.strerror}") from error


def arm_facts(arm: RobotDescription, source: str = "") -> dict[str, Any]:
    """Returns the content of the file of an arm, as JSON data."""
    links = [
        {"mass": link.mass, "center_of_mass": link.center_of_mass.tolist(), "inertia": link.inertia.tolist()}
        for link in arm.links
    ]
    return {
        "format": FORMAT,
        "version": VERSION,
        "model": arm.name,
        "source": source or arm.dh_source,
        "dh": [[row.a, row.alpha, row.d, row.theta_offset] for row in arm.dh],
        "links": links,
        "friction": None
        if arm.friction is None
        else dict(zip(_FRICTION, (values.tolist() for values in arm.friction), strict=True)),
    }


def load_arm(file: str | Path) -> RobotDescription:
    """Returns the arm in a file.

    Raises:
        InvalidValueError: The file does not exist, or is not that of an arm; the message names the part.
        ModelError: Its model is unknown.
        VersionMismatchError: It has another version of this format.
    """
    path = Path(file)
    text = read_limited(path, "arm file", lambda size: _require_size(size, path))
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidValueError("arm file", path.name, f"is not valid JSON: {error}") from error
    return build_arm(content, path.name)


def build_arm(content: Any, name: str) -> RobotDescription:
    """Returns the arm of the result of `arm_facts`.

    Args:
        content: The JSON data.
        name: Name of its file, for errors.

    Raises:
        InvalidValueError: It is not that of an arm; also the other errors of `load_arm`.
    """
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InvalidValueError("arm file", name, f'has no "format": "{FORMAT}"')
    if content.get("version") != VERSION:
        raise VersionMismatchError(f"{name}, version", content.get("version"), VERSION, "save the arm again")
    if not isinstance(content.get("model"), str):
        raise InvalidValueError("arm file", name, f'names no arm: "model" is {described(content.get("model"))}')
    nominal = describe_robot(content["model"])
    try:
        return _build_arm(nominal, content, name)
    except (LookupError, TypeError, ValueError) as error:
        if isinstance(error, InvalidValueError):
            raise
        raise InvalidValueError("arm file", name, f"lacks or has a wrong {error}") from error


_FRICTION = ("viscous", "coulomb", "offset")


def _build_arm(nominal: RobotDescription, content: dict[str, Any], name: str) -> RobotDescription:
    n, source = nominal.n, str(content.get("source", name))
    rows, links = _list(content, "dh", n, name), _list(content, "links", n, name)
    dh = tuple(
        _row(row, own, f"{name}, dh row {i}") for i, (row, own) in enumerate(zip(rows, nominal.dh, strict=True), 1)
    )
    friction = content.get("friction")
    return replace(
        nominal,
        dh=dh,
        dh_source=source,
        links=tuple(
            replace(
                own,
                mass=_mass(link["mass"], f"{name}, link {i}, mass"),
                center_of_mass=_vector(link["center_of_mass"], 3, f"{name}, link {i}, center_of_mass", "m", _FARTHEST),
                inertia=_tensor(link["inertia"], f"{name}, link {i}, inertia"),
                source=source,
            )
            for i, (own, link) in enumerate(zip(nominal.links, links, strict=True), 1)
        ),
        friction=None
        if friction is None
        else (
            _vector(friction["viscous"], n, f"{name}, friction, viscous", "N m s/rad", _LARGEST_FRICTION),
            _vector(friction["coulomb"], n, f"{name}, friction, coulomb", "N m", _LARGEST_FRICTION),
            _vector(friction["offset"], n, f"{name}, friction, offset", "N m", _LARGEST_FRICTION),
        ),
        nominal=nominal,
    )


def _list(content: dict[str, Any], key: str, count: int, name: str) -> list[Any]:
    found = content[key]
    if not isinstance(found, list) or len(found) != count:
        raise InvalidValueError(f"{name}, {key}", found, f"must be a list of {count} entries, one for each joint")
    return found


def _row(value: Any, own: DhRow, name: str) -> DhRow:
    a, alpha, d, theta = as_vector(value, 4, name, "m, rad").tolist()
    lengths, angles = (a - own.a, d - own.d), (alpha - own.alpha, theta - own.theta_offset)
    if max(map(abs, lengths)) > _LENGTH or max(abs(remainder(angle, tau)) for angle in angles) > _ANGLE:
        here = [own.a, own.alpha, own.d, own.theta_offset]
        problem = f"is not near {here} of the named arm: within {_LENGTH:g} m and {_ANGLE:g} rad"
        raise InvalidValueError(name, [a, alpha, d, theta], problem)
    return DhRow(a=a, alpha=alpha, d=d, theta_offset=theta)


def _mass(value: Any, name: str) -> float:
    mass = as_number(value, name, "kg")
    if not 0.0 <= mass <= _MASS:
        raise InvalidValueError(name, mass, f"must be in 0 to {_MASS:g} kg")
    return mass


def _vector(value: Any, n: int, name: str, unit: str, most: float) -> Array:
    found = as_vector(value, n, name, unit)
    if np.abs(found).max() > most:
        raise InvalidValueError(name, found.tolist(), f"must be within {most:g} {unit}")
    return found


def _tensor(value: Any, name: str) -> Array:
    inertia = _vector(np.ravel(value), 9, name, "kg m^2", _INERTIA).reshape(3, 3)
    if np.abs(inertia - inertia.T).max() > 1e-12 * max(1.0, float(np.abs(inertia).max())):
        raise InvalidValueError(name, inertia.tolist(), "must be symmetric")
    return readonly_copy(inertia)


def _require_size(size: int, path: Path) -> None:
    if size > _LARGEST:
        raise InvalidValueError("arm file", path.name, f"has {size} bytes, an arm at most {_LARGEST}")
