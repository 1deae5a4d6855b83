"""Texts of the page: its own catalogue and the shared one."""

from __future__ import annotations

from rcilab.i18n import translator
from rcilab.i18n.translator import Explainable
from rcilab.i18n.units import USUAL, Unit, Units


class Text(translator.Text):
    """The catalogue of the page in one language.

    Args:
        language: Language.
        units: Units in which angles and lengths are shown.
        maker: Maker of the arm, whose wording replaces the usual one; "" for none.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str, units: Units = USUAL, maker: str = "") -> None:
        super().__init__(language, "rcilab.app", units, maker)

    def _explain(self, item: Explainable) -> str:
        return item.explain(self.language, self.units)

    def unit(self, usual: str) -> Unit:
        """Returns the unit in which numbers of a field are shown and typed, for "deg", "mm" or a rate."""
        return self.units.unit(usual)
