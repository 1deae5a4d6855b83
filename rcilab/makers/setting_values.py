"""Checks of the numbers of a setting before they are sent, with the joint or axis in the error."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, as_number, described
from rcilab.core.errors import InvalidValueError

_NO_NUMBERS = "bcSU"
"""Kinds of numpy's types that it converts to numbers, but that are booleans, complex, or text."""


def bounded_vector(
    name: str, values: ArrayLike, axes: Sequence[str], unit: str, least: ArrayLike | None = None,
    largest: ArrayLike | None = None,
) -> Array:  # fmt: skip
    """Returns a vector, one number per axis, each finite and inside its bounds.

    Args:
        name: Name of the setting in an error.
        values: The numbers.
        axes: Names of the elements in an error, one per number; "" for none.
        unit: Their unit.
        least: Smallest values, or one for all; None is no bound.
        largest: Largest values, or one for all; None is no bound.

    Raises:
        InvalidValueError: It is not such a vector; the message names the first element that is wrong.
    """
    try:
        if np.asarray(values).dtype.kind in _NO_NUMBERS:
            raise TypeError
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        if len(axes) == 1:
            as_number(values[0], name, unit)  # type: ignore[index]  # A single number was put into a list.
            raise InvalidValueError(name, values[0], f"must be a number [{unit}]") from error  # type: ignore[index]
        raise InvalidValueError(name, described(values), f"is not {len(axes)} numbers [{unit}]") from error
    if array.shape != (len(axes),):
        raise InvalidValueError(name, described(values), f"has shape {array.shape}, needs ({len(axes)},) [{unit}]")
    low = np.broadcast_to(-np.inf if least is None else least, array.shape)
    high = np.broadcast_to(np.inf if largest is None else largest, array.shape)
    for axis, value, lowest, highest in zip(axes, array.tolist(), low.tolist(), high.tolist(), strict=True):
        place = f"{name}, {axis}" if axis else name
        if not math.isfinite(value):
            raise InvalidValueError(place, value, f"must be finite [{unit}]")
        if not lowest <= value <= highest:
            span = f"is outside {lowest:.9g} to {highest:.9g}"
            bounds = f"must not be below {lowest:g}" if highest == math.inf else span
            raise InvalidValueError(place, value, f"{bounds} [{unit}]")
    return array
