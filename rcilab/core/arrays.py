"""Array types by role, and the checks that validate array arguments."""

from __future__ import annotations

import math
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.errors import InvalidValueError

Array: TypeAlias = NDArray[np.float64]

JointVector: TypeAlias = Array
"""One number per joint, shape (n,)."""

JointPath: TypeAlias = Array
"""One row per sample, shape (N, n)."""

Vector3: TypeAlias = Array
"""Shape (3,)."""

Matrix: TypeAlias = Array
"""Two-dimensional."""

MAX_ANGLE = 4.0 * math.pi
"""[rad] Largest accepted joint or arm angle: two turns. Larger values are usually degrees by mistake."""


def scalar(value: float) -> Array:
    """Returns a number as a read-only array of shape (), which numpy need not convert in every product."""
    return readonly_copy(value)


def readonly_copy(value: ArrayLike) -> Array:
    """Returns a read-only float64 copy of `value`, or `value` itself if it already is one."""
    if isinstance(value, np.ndarray):
        array = cast("Array", value)
        if array.base is None and array.dtype == np.float64 and not array.flags.writeable:
            return array
    return make_readonly(np.array(value, dtype=np.float64))


def make_readonly(array: Array) -> Array:
    """Makes an array read-only in place and returns it; `readonly_copy` then does not copy it."""
    # Positional, which numpy's stubs do not declare: by keyword the call takes twice as long.
    array.setflags(False)  # pyright: ignore[reportCallIssue]
    return array


class Unquoted(str):
    """Text that an error message shows without quotes instead of a value."""

    __slots__ = ()

    __repr__ = str.__str__


def described(value: object) -> object:
    """Returns a value as an error message shows it, in one line: of a table only its shape."""
    if getattr(value, "ndim", 0) > 1:
        return Unquoted(f"an array of shape {getattr(value, 'shape', '')}")
    return value.tolist() if isinstance(value, np.ndarray) else value


def as_number(value: object, name: str, unit: str = "") -> float:
    """Returns a number as a plain float; NaN and infinities are accepted.

    Args:
        value: A number; text is rejected.
        name: Name of the value in an error.
        unit: Unit to name in an error, such as "rad".

    Raises:
        InvalidValueError: It is not a number.
    """
    if isinstance(value, float):
        return float(value)
    if not isinstance(value, str | bytes) and getattr(value, "ndim", 0) == 0:
        try:
            return float(value)  # type: ignore[arg-type]  # What float() rejects is rejected below.
        except (TypeError, ValueError, OverflowError):
            pass
    raise InvalidValueError(name, described(value), f"must be a number{_in(unit)}").coded("no_number")


def as_vector(value: ArrayLike, size: int, name: str, unit: str = "") -> Array:
    """Returns a checked, read-only copy of a vector.

    Args:
        value: Anything array-like.
        size: Number of elements it must have.
        name: Name of the value in an error.
        unit: Unit to name in an error, such as "rad".

    Raises:
        InvalidValueError: It is not a vector of `size` finite numbers.
    """
    try:
        if getattr(getattr(value, "dtype", None), "kind", "") == "c":
            raise TypeError("complex")  # numpy would drop the imaginary part.
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValueError(name, value, f"must be {size} numbers{_in(unit)}").coded(
            "numbers", count=size
        ) from error
    if array.shape != (size,):
        problem = f"has shape {array.shape}, needs ({size},){_in(unit)}"
        raise InvalidValueError(name, value, problem).coded("numbers", count=size)
    if not all(map(math.isfinite, array.tolist())):  # Faster than numpy for a few numbers, above all in the first call.
        raise InvalidValueError(name, value, f"must be finite in every element{_in(unit)}").coded("not_finite")
    array.flags.writeable = False
    return array


def as_path(value: ArrayLike, columns: int | None, name: str, unit: str = "") -> Array:
    """Returns a checked, read-only copy of a table with one row per sample and one column per joint.

    Args:
        value: Anything array-like.
        columns: Number of columns it must have; None accepts any number above 0.
        name: Name of the value in an error.
        unit: Unit to name in an error, such as "rad".

    Raises:
        InvalidValueError: It is not a finite table of at least one row and exactly `columns` columns.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidValueError(name, described(value), f"must be a table of numbers{_in(unit)}") from error
    if array.ndim != 2 or 0 in array.shape or columns not in (None, array.shape[1]):
        needed = f"needs shape (N, {'n' if columns is None else columns}){_in(unit)}"
        shown = described(array) if array.ndim else value
        raise InvalidValueError(name, shown, needed)
    if not np.isfinite(array).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(array))[0])
        where = f"{name} at row {row} (from 0), joint {column + 1}"
        raise InvalidValueError(where, float(array[row, column]), f"must be finite{_in(unit)}").coded("not_finite")
    array.flags.writeable = False
    return array


def require_radians(q: Array, name: str) -> Array:
    """Returns joint angles, shape (n,) or (N, n), [rad], if none is more than two turns.

    Args:
        q: The angles.
        name: Their name in an error.

    Raises:
        InvalidValueError: An angle exceeds two turns; the values are probably degrees.
    """
    turned = np.abs(q)
    if float(turned.max()) <= MAX_ANGLE:
        return q
    *rows, joint = (int(i) for i in np.unravel_index(turned.argmax(), q.shape))
    where = f"{name} of joint {joint + 1}" + "".join(f" at row {row} (from 0)" for row in rows)
    problem = f"rad is more than two turns; the unit is rad, use np.radians({name}) for degrees"
    raise InvalidValueError(where, float(q[*rows, joint]), problem)


def as_rows(value: ArrayLike, columns: int, name: str, unit: str = "", like: Array | None = None) -> Array:
    """Returns a checked, read-only copy of one vector, or of a table with one row per sample.

    Args:
        value: Anything array-like, shape (columns,) or (N, columns).
        columns: Number of columns it must have.
        name: Name of the value in an error.
        unit: Unit to name in an error, such as "rad".
        like: Array whose number of rows it must have.

    Raises:
        InvalidValueError: It is neither, has another number of rows, or is not finite.
    """
    try:
        is_table = np.ndim(value) > 1
    except ValueError:  # Rows of different lengths: as_vector raises the error for them.
        is_table = False
    array = as_path(value, columns, name, unit) if is_table else as_vector(value, columns, name, unit)
    if like is not None and array.shape[:-1] != like.shape[:-1]:
        needed = f"needs one row for each of the {len(like)}" if like.ndim > 1 else "needs a single row"
        raise InvalidValueError(name, Unquoted(f"an array of shape {array.shape}"), needed + _in(unit))
    return array


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""
