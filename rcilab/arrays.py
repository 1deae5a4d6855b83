"""Arrays at the border: aliases by role, and the one check that makes a value fit to be trusted inside."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.errors import InvalidValueError

Array: TypeAlias = NDArray[np.float64]

JointVector: TypeAlias = Array
"""One number a joint, shape (n,)."""

JointPath: TypeAlias = Array
"""One row a sample, shape (N, n)."""

Vector3: TypeAlias = Array
"""Shape (3,)."""

Matrix: TypeAlias = Array
"""Two-dimensional."""


def frozen(value: ArrayLike) -> Array:
    """Returns a read-only float64 copy of `value`."""
    array = np.array(value, dtype=np.float64)
    array.flags.writeable = False
    return array


def as_vector(value: ArrayLike, size: int, name: str, unit: str = "") -> Array:
    """Returns a checked, read-only copy of a vector.

    Args:
        value: Anything array-like.
        size: Number of elements it must have.
        name: What to call it in an error.
        unit: Unit to name in an error, such as "rad".

    Raises:
        InvalidValueError: It is not a vector of `size` finite numbers.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(name, value, f"is not {size} numbers{_in(unit)}") from error
    if array.shape != (size,):
        raise InvalidValueError(name, value, f"has shape {array.shape}, needs ({size},){_in(unit)}")
    if not np.isfinite(array).all():
        raise InvalidValueError(name, value, f"must be finite in every element{_in(unit)}")
    array.flags.writeable = False
    return array


def as_path(value: ArrayLike, columns: int, name: str, unit: str = "") -> Array:
    """Returns a checked, read-only copy of a table with one row a sample.

    Raises:
        InvalidValueError: It is not a finite table of at least one row and exactly `columns` columns.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(name, value, f"is not a table of numbers{_in(unit)}") from error
    if array.ndim != 2 or array.shape[1] != columns or array.shape[0] < 1:
        raise InvalidValueError(name, f"array of shape {array.shape}", f"needs shape (N, {columns})")
    if not np.isfinite(array).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidValueError(f"{name}[{row}, {column}]", array[row, column], f"must be finite{_in(unit)}")
    array.flags.writeable = False
    return array


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
