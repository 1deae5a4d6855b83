"""Widgets that share equal layouts and styles, which saves messages to the browser.

Each layout and each style is a separate model with its own message; with one of each for every label and button,
two thirds of a cell's messages would be redundant.
"""

from __future__ import annotations

from typing import Any

import ipywidgets

_cache: dict[object, Any] = {}


def shared_style_widget(kind: type[Any], *content: Any, classes: tuple[str, ...] = (), **traits: Any) -> Any:
    """Returns a widget. A layout or style that is a dictionary, or absent, is shared with all that have the same.

    For a widget whose layout changes, pass a `Layout` object.

    Args:
        kind: Class of the widget.
        content: Positional arguments of its class, such as the children of a box.
        classes: Classes of style sheets.
        traits: Keyword arguments of its class; `layout` and `style` may be dictionaries.
    """
    traits["layout"] = _shared_traits(ipywidgets.Layout, traits.get("layout"))
    style = kind.class_traits().get("style")
    if style is not None:
        traits["style"] = _shared_traits(style.klass, traits.get("style"))
    return kind(*content, **traits, **({"_dom_classes": classes} if classes else {}))


def cached_widget(name: str, make: Any) -> Any:
    """Returns a widget that is created once and shown in many places.

    Args:
        name: Key of the widget.
        make: Creates the widget.
    """
    known = _cache.get(name)
    if known is None or known.comm is None:  # Every widget of the kernel was closed.
        known = _cache[name] = make()
    return known


def is_shared(widget: Any) -> bool:
    """Returns whether a layout, a style or a widget is shared."""
    return any(widget is known for known in _cache.values())


def _shared_traits(kind: type[Any], traits: Any) -> Any:
    if traits is not None and not isinstance(traits, dict):
        return traits
    name = (kind, *sorted((traits or {}).items()))
    return cached_widget(name, lambda: kind(**(traits or {})))  # type: ignore[arg-type]
