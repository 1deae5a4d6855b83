"""Widgets that cost a browser little: what looks alike shares one layout and one style.

Each layout and each style is a model of its own, sent to the browser in a message of its own; with one of each for
every label and button, two thirds of what a cell sends would say nothing new.
"""

from __future__ import annotations

from typing import Any

import ipywidgets

_shared: dict[object, Any] = {}


def lean(kind: type[Any], *content: Any, classes: tuple[str, ...] = (), **traits: Any) -> Any:
    """Returns a widget. A layout or a style that is a dictionary, or none, is shared with all that have the same.

    Give a widget whose layout changes a `Layout` of its own.

    Args:
        kind: Class of the widget.
        content: As its class takes it: the children of a box, say.
        classes: Of style sheets.
        traits: Likewise; `layout` and `style` may be dictionaries.
    """
    traits["layout"] = _look(ipywidgets.Layout, traits.get("layout"))
    style = kind.class_traits().get("style")
    if style is not None:
        traits["style"] = _look(style.klass, traits.get("style"))
    return kind(*content, **traits, **({"_dom_classes": classes} if classes else {}))


def once(name: str, make: Any) -> Any:
    """Returns a widget that is made once and shown in many places.

    Args:
        name: Which.
        make: Makes it.
    """
    known = _shared.get(name)
    if known is None or known.comm is None:  # Every widget of the kernel was closed.
        known = _shared[name] = make()
    return known


def is_shared(widget: Any) -> bool:
    """Returns whether a layout, a style or a widget belongs to others too."""
    return any(widget is known for known in _shared.values())


def _look(kind: type[Any], traits: Any) -> Any:
    if traits is not None and not isinstance(traits, dict):
        return traits
    name = (kind, *sorted((traits or {}).items()))
    return once(name, lambda: kind(**(traits or {})))  # type: ignore[arg-type]
