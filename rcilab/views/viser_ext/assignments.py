"""Cached property types, so that setting a property of a viser handle to its current value is cheap.

A page sets hundreds of properties many times per second, nearly all of them to their current values. viser 1.1 builds
four types for each assignment, to check whether the value is an array of one of them, and reads the property types
again for every handle. That took a fifth of the page process's time.

Unnecessary once viser caches the types of the properties of a handle.
"""

from __future__ import annotations

from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

_CONVERTED = (npt.NDArray[np.float16], npt.NDArray[np.float32], npt.NDArray[np.float64], npt.NDArray[np.uint8])
"""Property types to which viser converts values. It also converts the elements of tuples of any length."""


def install() -> None:
    """Patches viser; values, conversions and messages are unchanged. May be called again."""
    from viser._assignable_props_api import AssignablePropsBase

    base: Any = AssignablePropsBase
    if isinstance(base._prop_hints, property):
        return
    convert = base._cast_value_recursive

    def cast(self: Any, hint: Any, value: Any, name: str) -> Any:
        return convert(self, hint, value, name) if name in converted_properties(type(self._impl.props)) else value

    base._cast_value_recursive = cast
    base._prop_hints = property(lambda self: _hints(type(self._impl.props)))


@cache
def converted_properties(props: type) -> frozenset[str]:
    """Returns the names of a handle's properties whose values viser may convert."""
    return frozenset(name for name, hint in _hints(props).items() if _is_converted(hint))


def _is_converted(hint: Any) -> bool:
    return hint in _CONVERTED or (get_origin(hint) is tuple and get_args(hint)[1:] == (...,))


@cache
def _hints(props: type) -> dict[str, Any]:
    return get_type_hints(props)
