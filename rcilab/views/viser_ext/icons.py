"""Icons of buttons from an archive that is opened once, with the hints of the buttons in them.

viser 1.1 caches 32 icons and opens its archive of 6000 icons for every other one, which takes 30 ms. A page with more
than 32 icons took one and a half seconds to build.

viser accepts a hint for every control, but its page shows none for a button. Here the hint is an attribute of the icon,
which `names.js` reads.

Unnecessary once viser caches all icons and shows the hints of buttons.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from functools import cache, wraps
from html import escape
from io import BytesIO
from typing import Any
from zipfile import ZipFile

HINT = "data-rl-hint"
"""Attribute of an icon with the hint of its button."""

_hint: ContextVar[str | None] = ContextVar("hint", default=None)  # Of the button that is being added.


def install() -> None:
    """Patches viser's buttons to use these icons. May be called again."""
    from viser import _gui_api, _gui_handles

    users: tuple[Any, ...] = (_gui_api, _gui_handles)  # The modules that import the function in viser 1.1.
    if users[0].svg_from_icon is _hinting_svg_of:
        return
    for module in users:
        module.svg_from_icon = _hinting_svg_of
    gui: Any = _gui_api.GuiApi
    for name in ("add_button", "add_upload_button"):
        setattr(gui, name, _hinting(getattr(gui, name)))


def _hinting(add: Callable[..., Any]) -> Callable[..., Any]:
    """Wraps a method that adds a button, to pass its hint to `_hinting_svg_of`."""

    @wraps(add)
    def add_hinted(self: Any, *args: Any, **options: Any) -> Any:
        token = _hint.set(options.get("hint"))
        try:
            return add(self, *args, **options)
        finally:
            _hint.reset(token)

    return add_hinted


@cache
def svg_of(icon: str) -> str:
    """Returns an icon as an <svg> element.

    Args:
        icon: Name of the icon, such as "player-play".

    Raises:
        KeyError: No icon has this name.
    """
    return _archive().read(f"{icon}.svg").decode()


def _hinting_svg_of(icon: str) -> str:
    """Returns an icon with the hint of the button that is being added."""
    hint, svg = _hint.get(), svg_of(icon)
    return svg if hint is None else svg.replace("<svg", f'<svg {HINT}="{escape(hint)}"', 1)


@cache
def _archive() -> ZipFile:
    from viser import _icons

    # In memory, so that no file stays open.
    return ZipFile(BytesIO((_icons.ICONS_DIR / "tabler-icons.zip").read_bytes()))
