"""Giving a control of viser the value that it has: nothing happens, as before, but without a hundred steps to find out.

A panel says what its controls show whenever it is drawn, and mostly they show it already. viser 1.1 finds that out only
after it has compared the type of the property with four types of arrays that it makes anew each time: about 0.1 ms.
"""

from __future__ import annotations

from typing import Any

_PLAIN = (bool, str, type(None))


def install() -> None:
    """Has every control and node that viser makes leave a property alone that has the very value. May be called again.

    Properties that viser sets by a function of its own, and those of a control that was removed, are left to viser.
    """
    from viser import _assignable_props_api as module

    viser_set = module.props_setattr
    base: Any = module.AssignablePropsBase
    if base.__setattr__ is not viser_set:
        return

    def set_unless_same(self: Any, name: str, value: object) -> None:
        if type(value) in _PLAIN and name != "_impl" and _is_same(self, name, value):
            return
        viser_set(self, name, value)

    base.__setattr__ = set_unless_same


def _is_same(handle: Any, name: str, value: object) -> bool:
    impl = handle._impl
    current = vars(impl.props).get(name, handle)  # What is no property is never equal to the handle itself.
    if type(current) is not type(value) or current != value or impl.removed:
        return False
    return not isinstance(getattr(type(handle), name, None), property)
