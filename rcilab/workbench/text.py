"""Words of the page: its own catalogue and the one it shares with the notebook."""

from __future__ import annotations

from collections.abc import Mapping

from rcilab.language import LANGUAGES, Language
from rcilab.words import text
from rcilab.words.text import Message, load_face, message

__all__ = ["LANGUAGES", "Message", "Text", "load_catalogue", "message"]

_PAGE = "rcilab.workbench"


class Text(text.Text):
    """The catalogue of the page in one language.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str) -> None:
        super().__init__(language, _PAGE)


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all entries of one language that the page has."""
    return load_face(_PAGE, language)
