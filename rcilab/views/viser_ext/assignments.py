"""Setting a property of a viser handle to what it is already costs next to nothing.

A page sets hundreds of properties many times a second, nearly all of them to what they are. viser 1.1 builds four
types anew at each, to see whether the value is an array of one of them, and reads the types of a handle's properties
anew for every handle. That was a fifth of what the page's process did.

Unnecessary once viser caches the types of the properties of a handle.
"""

from __future__ import annotations

from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

_CONVERTED = (npt.NDArray[np.float16], npt.NDArray[np.float32], npt.NDArray[np.float64], npt.NDArray[np.uint8])
"""Types of properties that viser converts a value to. It also looks into tuples of any length."""


def install() -> None:
    """Has every handle look at its types once; values, conversions and messages stay viser's. May be called again."""
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
    """Returns the names of a handle's properties whose values viser may convert; all others it takes as they are."""
    return frozenset(name for name, hint in _hints(props).items() if _is_converted(hint))


def _is_converted(hint: Any) -> bool:
    return hint in _CONVERTED or (get_origin(hint) is tuple and get_args(hint)[1:] == (...,))


@cache
def _hints(props: type) -> dict[str, Any]:
    return get_type_hints(props)
