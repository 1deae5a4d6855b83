"""Fonts of matplotlib figures: those of matplotlib have no Chinese characters."""

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
"""Parts of the names of fonts with Chinese characters on Linux, Windows and macOS."""


@contextmanager
def select_font(language: Language) -> Iterator[Language]:
    """Selects fonts that contain the characters of a language, for text that is created inside the context.

    Yields:
        The language to use: English if no font with Chinese characters is installed.
    """
    family = chinese_font() if language == "zh" else None
    if family is None:
        yield "en"
        return
    from matplotlib import rc_context, rcParams

    with rc_context(
        {"font.family": [*rcParams["font.family"], family]}
    ):  # The usual font is used for all characters that it has.
        yield "zh"


@cache
def chinese_font() -> str | None:
    """Returns the name of a font with Chinese characters that matplotlib finds on this machine, or None."""
    from matplotlib.font_manager import fontManager

    names = sorted({font.name for font in fontManager.ttflist})
    return next((name for mark in _CHINESE for name in names if mark in name), None)
