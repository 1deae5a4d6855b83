"""Which fonts a matplotlib figure is written in: its own have no Chinese characters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from rcilab.i18n.locale import Language

_CHINESE = (
    "CJK",
    "Source Han",
    "WenQuanYi",
    "YaHei",
    "SimHei",
    "SimSun",
    "PingFang",
    "Heiti",
    "Songti",
    "Droid Sans Fallback",
)
"""What a font with Chinese characters has in its name, as far as they are common on Linux, Windows and macOS."""


@contextmanager
def writing(language: Language) -> Iterator[Language]:
    """Has text that is made inside drawn in fonts that can write a language.

    Yields:
        The language that can be written here: English where there is no font for Chinese, because rows of empty boxes
        are of no use to a reader.
    """
    family = chinese_font() if language == "zh" else None
    if family is None:
        yield "en"
        return
    from matplotlib import rc_context, rcParams

    with rc_context({"font.family": [*rcParams["font.family"], family]}):  # The usual one writes what it can.
        yield "zh"


@cache
def chinese_font() -> str | None:
    """Returns the name of a font with Chinese characters that matplotlib finds on this machine, or None."""
    from matplotlib.font_manager import fontManager

    names = sorted({font.name for font in fontManager.ttflist})
    return next((name for mark in _CHINESE for name in names if mark in name), None)
