"""The buttons' icons, out of an archive that is opened once.

viser 1.1 remembers 32 icons and opens its archive of 6000 anew for every other one, which takes 30 ms; a page like
ours has more than 32, so each time it was built that was a second and a half.
"""

from __future__ import annotations

from functools import cache
from io import BytesIO
from typing import Any
from zipfile import ZipFile


def install() -> None:
    """Makes viser's buttons take their icons from here; may be called again."""
    from viser import _gui_api, _gui_handles

    users: tuple[Any, ...] = (_gui_api, _gui_handles)  # Where viser 1.1 looks the function up.
    for module in users:
        module.svg_from_icon = svg_of


@cache
def svg_of(icon: str) -> str:
    """Returns an icon as an <svg> element.

    Args:
        icon: Its name, such as "player-play".

    Raises:
        KeyError: There is none of this name.
    """
    return _archive().read(f"{icon}.svg").decode()


@cache
def _archive() -> ZipFile:
    from viser import _icons

    # In memory, so that no file stays open as long as the program lives.
    return ZipFile(BytesIO((_icons.ICONS_DIR / "tabler-icons.zip").read_bytes()))
