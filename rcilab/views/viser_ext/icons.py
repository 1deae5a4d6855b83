"""The buttons' icons, out of an archive that is opened once; and their hints, which travel in the icons.

viser 1.1 remembers 32 icons and opens its archive of 6000 anew for every other one, which takes 30 ms; a page like
ours has more than 32, so each time it was built that was a second and a half.

It takes a hint for every control, and its page shows none over a button. Ours finds it in the icon (`names.js`).

Unnecessary once viser keeps every icon that it has read, and shows the hint of a button.
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
"""The attribute of an icon that says what its button does."""

_hint: ContextVar[str | None] = ContextVar("hint", default=None)  # Of the button that is being made.


def install() -> None:
    """Makes viser's buttons take their icons from here; may be called again."""
    from viser import _gui_api, _gui_handles

    users: tuple[Any, ...] = (_gui_api, _gui_handles)  # Where viser 1.1 looks the function up.
    if users[0].svg_from_icon is _hinting_svg_of:
        return
    for module in users:
        module.svg_from_icon = _hinting_svg_of
    gui: Any = _gui_api.GuiApi
    for name in ("add_button", "add_upload_button"):
        setattr(gui, name, _hinting(getattr(gui, name)))


def _hinting(add: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a method that adds a button, with its hint known to who draws the icon."""

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
        icon: Its name, such as "player-play".

    Raises:
        KeyError: No icon has this name.
    """
    return _archive().read(f"{icon}.svg").decode()


def _hinting_svg_of(icon: str) -> str:
    """Returns an icon, with the hint of the button that is being made."""
    hint, svg = _hint.get(), svg_of(icon)
    return svg if hint is None else svg.replace("<svg", f'<svg {HINT}="{escape(hint)}"', 1)


@cache
def _archive() -> ZipFile:
    from viser import _icons

    # In memory, so that no file stays open as long as the program lives.
    return ZipFile(BytesIO((_icons.ICONS_DIR / "tabler-icons.zip").read_bytes()))
