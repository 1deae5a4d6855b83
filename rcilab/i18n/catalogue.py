"""Catalogues of texts: one gettext file per package, with the English text and its translation side by side.

`catalogues/zh.po` of a package has one entry per text: `msgctxt` is the key, `msgid` the English text, `msgstr` the
Chinese one. Variables are written `{name}` and filled in by `str.format`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from rcilab.i18n.locale import Language

SHARED = "rcilab.i18n"
"""The package whose catalogue every user interface loads."""
MAKERS = tuple(
    f"rcilab.makers.{file.parents[1].name}"
    for file in sorted(Path(__file__).parents[1].glob("makers/*/catalogues/zh.po"))
)
"""The packages of the makers, with names of faults, parameters and conditions. Found by folder, because this package
does not import them."""


@lru_cache
def load_catalogue(package: str, language: Language) -> Mapping[str, str]:
    """Returns all texts of a package in one language, by key.

    Args:
        package: Name of the package, such as rcilab.app; its folder `catalogues` holds the file.
        language: "en" or "zh".
    """
    column = 0 if language == "en" else 1
    return MappingProxyType({key: texts[column] for key, texts in _read(package).items()})


@lru_cache
def load_ui_catalogue(package: str, language: Language, maker: str = "") -> Mapping[str, str]:
    """Returns all texts of a user interface in one language: the shared ones, those of the makers and its own.

    Args:
        package: Package of the user interface, such as rcilab.app.
        language: "en" or "zh".
        maker: Maker of the arm, such as "franka": where there is a text KEY.franka, it takes the place of KEY.
    """
    texts = merge_catalogues((SHARED, *MAKERS, package), language)
    end = f".{maker}"
    own = {key.removesuffix(end): text for key, text in texts.items() if maker and key.endswith(end)}
    return MappingProxyType({**texts, **own})


@lru_cache
def merge_catalogues(packages: tuple[str, ...], language: Language) -> Mapping[str, str]:
    """Returns all texts of several packages; of two with the same key, the later one."""
    return MappingProxyType({k: text for package in packages for k, text in load_catalogue(package, language).items()})


@lru_cache
def _read(package: str) -> Mapping[str, tuple[str, str]]:
    """Returns English text and translation, by key."""
    from babel.messages.pofile import read_po  # Takes 30 ms; many processes show no text.

    with (files(package) / "catalogues" / "zh.po").open("rb") as file:
        return {
            str(entry.context): (str(entry.id), str(entry.string)) for entry in read_po(file, locale="zh") if entry.id
        }
