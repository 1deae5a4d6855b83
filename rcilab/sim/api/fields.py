"""Checks of the fields of a request: every invalid value raises one error that names it."""

from __future__ import annotations

from math import inf, isfinite
from typing import Any, TypeVar, cast

import numpy as np

from rcilab.core.errors import InvalidValueError

_T = TypeVar("_T", bound=str)
_MOST_JOINTS = 7


def as_float(value: object, name: str, unit: str, low: float = -inf, high: float = inf) -> float:
    """Returns a finite number in a range.

    Args:
        value: A number; text and booleans are refused.
        name: Its name in an error message.
        unit: Its unit, such as "s".
        low: Smallest value.
        high: Largest value.

    Raises:
        InvalidValueError: It is not such a number.
    """
    value = _plain(value)
    if not isinstance(value, int | float) or isinstance(value, bool) or not -1e300 <= value <= 1e300:
        raise InvalidValueError(name, value, f"must be a finite number{_in(unit)}")
    if not low <= value <= high:
        raise InvalidValueError(name, value, f"needs {_range(low, high)}{_in(unit)}")
    return float(value)


def as_floats(value: object, count: int, name: str, unit: str) -> tuple[float, ...]:
    """Returns `count` finite numbers.

    Raises:
        InvalidValueError: It is something else.
    """
    items = _plain(value)
    if not isinstance(items, list | tuple) or len(items) != count:  # pyright: ignore[reportUnknownArgumentType]
        raise InvalidValueError(name, value, f"needs {count} numbers{_in(unit)}")
    return tuple(as_float(item, f"{name}[{k}]", unit) for k, item in enumerate(cast("list[object]", items)))


def as_joints(value: object, name: str, unit: str) -> tuple[float, ...]:
    """Returns a finite number for each joint; the arm determines how many.

    Raises:
        InvalidValueError: It is not a list of numbers.
    """
    items = _plain(value)
    if not isinstance(items, list | tuple) or not 1 <= len(items) <= _MOST_JOINTS:  # pyright: ignore[reportUnknownArgumentType]
        raise InvalidValueError(name, value, f"needs a number for each joint{_in(unit)}")
    return as_floats(value, len(items), name, unit)  # pyright: ignore[reportUnknownArgumentType]


def as_integer(value: object, name: str, low: int, high: int) -> int:
    """Returns a whole number in a range.

    Raises:
        InvalidValueError: It is something else.
    """
    value = _plain(value)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise InvalidValueError(name, value, f"needs a whole number, {low} to {high}")
    return int(value)


def as_flag(value: object, name: str) -> bool:
    """Returns a truth value.

    Raises:
        InvalidValueError: It is something else.
    """
    value = _plain(value)
    if not isinstance(value, bool):
        raise InvalidValueError(name, value, "needs true or false")
    return value


def as_word(value: object, name: str, known: tuple[_T, ...]) -> _T:
    """Returns one of the known words.

    Raises:
        InvalidValueError: It is not one of them; the message lists them.
    """
    for word in known:
        if isinstance(value, str) and value == word:
            return word
    raise InvalidValueError(name, value, f"is unknown; known: {', '.join(known)}")


def as_name(value: object, name: str) -> str:
    """Returns a short name of letters, digits, `_` and `-`.

    Raises:
        InvalidValueError: It is something else.
    """
    if not isinstance(value, str) or not 1 <= len(value) <= 64:
        raise InvalidValueError(name, value, "needs 1 to 64 characters")
    if not value.isascii() or not value.replace("_", "").replace("-", "").isalnum():
        raise InvalidValueError(name, value, "may hold letters, digits, _ and - only")
    return value


def _plain(value: Any) -> Any:
    """Returns a value from numpy as the corresponding Python value."""
    return cast("Any", value).tolist() if isinstance(value, np.generic | np.ndarray) else value


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _range(low: float, high: float) -> str:
    if isfinite(low) and isfinite(high):
        return f"{low:g} to {high:g}"
    return f"{low:g} or more" if isfinite(low) else f"{high:g} or less"
