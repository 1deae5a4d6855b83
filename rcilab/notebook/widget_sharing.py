"""Widgets that cost a browser little: equal layouts and styles are shared.

Each layout and each style is a separate model with a message of its own; with one of each for every label and button,
two thirds of a cell's messages would be redundant.
"""

from __future__ import annotations

from typing import Any

import ipywidgets

_shared: dict[object, Any] = {}


def lean(kind: type[Any], *content: Any, classes: tuple[str, ...] = (), **traits: Any) -> Any:
    """Returns a widget. A layout or style that is a dictionary, or absent, is shared with all that have the same.

    For a widget whose layout changes, pass a `Layout` object.

    Args:
        kind: Class of the widget.
        content: Positional arguments of its class, such as the children of a box.
        classes: Classes of style sheets.
        traits: Keyword arguments of its class; `layout` and `style` may be dictionaries.
    """
    traits["layout"] = _look(ipywidgets.Layout, traits.get("layout"))
    style = kind.class_traits().get("style")
    if style is not None:
        traits["style"] = _look(style.klass, traits.get("style"))
    return kind(*content, **traits, **({"_dom_classes": classes} if classes else {}))


def once(name: str, make: Any) -> Any:
    """Returns a widget that is created once and shown in many places.

    Args:
        name: Its key.
        make: Creates it.
    """
    known = _shared.get(name)
    if known is None or known.comm is None:  # Every widget of the kernel was closed.
        known = _shared[name] = make()
    return known


def is_shared(widget: Any) -> bool:
    """Returns whether a layout, a style or a widget is shared."""
    return any(widget is known for known in _shared.values())


def _look(kind: type[Any], traits: Any) -> Any:
    if traits is not None and not isinstance(traits, dict):
        return traits
    name = (kind, *sorted((traits or {}).items()))
    return once(name, lambda: kind(**(traits or {})))  # type: ignore[arg-type]
