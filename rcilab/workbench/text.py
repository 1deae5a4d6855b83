"""Words of the page: one catalogue a language, found by key, filled with values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from rcilab.language import LANGUAGES, Language, load_words, require_language
from rcilab.workbench.units import USUAL, Unit, Units

__all__ = ["LANGUAGES", "Message", "Text", "load_catalogue", "message"]


@dataclass(frozen=True)
class Message:
    """Something to say, before it is known in which language."""

    code: str
    """Key in the catalogues."""
    values: Mapping[str, object] = field(default_factory=dict)
    """What the sentence is filled with."""


def message(code: str, **values: object) -> Message:
    """Returns a message by its key and the values that fill it."""
    return Message(code, MappingProxyType(values))


class Text:
    """The catalogue of one language, called with a key.

    A value that stands before °, deg or mm in the catalogue is given in degrees or millimetres and shown in the units
    of the page, as is the name {in_deg} or {in_mm}.

    Args:
        language: Which.
        units: What angles and lengths are shown in.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str, units: Units = USUAL) -> None:
        self.language = require_language(language)
        self.units = units
        self._entries = {code: units.adapt(entry) for code, entry in load_catalogue(self.language).items()}

    def __call__(self, code: str, **values: object) -> str:
        """Returns the words for a key; the key itself when the catalogue lacks it (a test keeps it complete)."""
        entry = self._entries.get(code)
        return code if entry is None else entry.format(**self.units.values(values)) if values else entry

    def unit(self, usual: str) -> Unit:
        """Returns the unit that numbers of a field are shown and typed in, for "deg" or "mm"."""
        return self.units.unit(usual)

    def has(self, code: str) -> bool:
        """Returns whether the catalogue knows a key."""
        return code in self._entries

    def say(self, said: Message) -> str:
        """Returns a message in this language; messages among its values are translated first."""
        values = {k: self.say(v) if isinstance(v, Message) else v for k, v in said.values.items()}
        return self(said.code, **values)


def load_catalogue(language: Language) -> Mapping[str, str]:
    """Returns all entries of one language."""
    return load_words("rcilab.workbench", language)
