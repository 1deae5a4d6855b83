"""Words of the page: its own catalogue and the one it shares with the notebook."""

from __future__ import annotations

from collections.abc import Mapping

from rcilab.i18n import translator as text
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES, Language
from rcilab.i18n.translator import Explainable, Message, message
from rcilab.i18n.units import USUAL, Unit, Units

__all__ = ["LANGUAGES", "Message", "Text", "load_catalogue", "message"]

_PAGE = "rcilab.app"


class Text(text.Text):
    """The catalogue of the page in one language.

    Args:
        language: Which.
        units: What angles and lengths are shown in.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str, units: Units = USUAL) -> None:
        super().__init__(language, _PAGE, units)

    def _explain(self, item: Explainable) -> str:
        return item.explain(self.language, self.units)

    def unit(self, usual: str) -> Unit:
        """Returns the unit that numbers of a field are shown and typed in, for "deg" or "mm"."""
        return self.units.unit(usual)


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all entries of one language that the page has."""
    return load_ui_catalogue(_PAGE, language)
