"""Words of a face of the program: one catalogue a language, found by key, filled with values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import Language, require_language
from rcilab.i18n.units import SI, USUAL, Units

_STOPS = (".", "。")


@runtime_checkable
class Explains(Protocol):
    """What can be among the values of a message and has words of its own: a violation, an exhibit's line."""

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns itself in words."""
        ...


@dataclass(frozen=True)
class Finished:
    """An English sentence of the library that has no text in the catalogues; it stays as it is."""

    sentence: str

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns the sentence."""
        return self.sentence


@dataclass(frozen=True)
class Amount:
    """A value of a condition beside the one it is compared with, both of an SI unit."""

    value: float
    other: float
    unit: str

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns it with its unit and as few digits as show that it differs from the other; without units in SI."""
        shown = units or SI
        return shown.with_unit(shown.numbers(self.unit, self.value, self.other)[0], self.unit)


class Remark(str):
    """An English sentence that faces can also say in their own words.

    Args:
        sentence: In English.
        code: Names what it says; its words are `remark.CODE` of the catalogues.
        facts: What fills them: numbers in SI, with a "unit" for "value" and "bound"; text; or remarks.
    """

    code: str
    facts: Mapping[str, object]

    @classmethod
    def all(cls, remarks: Iterable[str]) -> Remark:
        """Returns several in one line."""
        parts: list[Remark] = []
        for remark in remarks:
            parts += remark.parts if isinstance(remark, Remark) else (cls(remark),)
        if len(parts) < 2:
            return parts[0] if parts else cls("")
        return cls("; ".join(parts), "all", **{str(number): remark for number, remark in enumerate(parts, 1)})

    @property
    def parts(self) -> tuple[Remark, ...]:
        """Those that stand in one line here; itself when it is a single one."""
        if self.code != "all":
            return (self,)
        return tuple(fact for fact in self.facts.values() if isinstance(fact, Remark))

    def as_dict(self) -> dict[str, object]:
        """Returns it as JSON has it; `from_dict` makes it anew."""
        facts = {name: _as_json(fact) for name, fact in self.facts.items()}
        return {"said": str(self), "code": self.code, "facts": facts}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Remark:
        """Returns what `as_dict` has written.

        Raises:
            LookupError: It is something else.
            TypeError: It is something else.
        """
        facts = {
            name: cls.from_dict(fact) if isinstance(fact, dict) else fact for name, fact in content["facts"].items()
        }
        return cls(str(content["said"]), str(content["code"]), **facts)

    def __new__(cls, sentence: str, code: str = "", **facts: object) -> Remark:  # noqa: D102  # The class says it.
        remark = super().__new__(cls, sentence)
        remark.code, remark.facts = code, facts
        return remark


@dataclass(frozen=True)
class Message:
    """Something to say, before it is known in which language."""

    code: str
    """Key in the catalogues."""
    values: Mapping[str, object] = field(default_factory=dict)
    """What the sentence is filled with."""


def follow(lead: str, rest: str) -> tuple[str, str]:
    """Returns a lead and what follows it, with a space between them where the lead's script has one."""
    return lead, rest if lead[-1:] >= "\u3000" else f" {rest}"


def message(code: str, **values: object) -> Message:
    """Returns a message by its key and the values that fill it."""
    return Message(code, MappingProxyType(values))


def _as_json(fact: object) -> object:
    """Returns a fact as JSON has it, which knows neither infinity nor nan."""
    if isinstance(fact, Remark):
        return fact.as_dict()
    return str(fact) if isinstance(fact, float) and not math.isfinite(fact) else fact


class Text:
    """The catalogue of one language, called with a key.

    Attributes:
        language: Which.
        units: What angles and lengths are shown in.

    Args:
        language: "en" or "zh".
        package: The package with the texts of this user interface beside the shared ones, such as rcilab.app.
        units: What angles and lengths are shown in.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str, package: str, units: Units = USUAL) -> None:
        self.language: Language = require_language(language)
        self.units = units
        self._entries = load_ui_catalogue(package, self.language)

    def __call__(self, code: str, **values: object) -> str:
        """Returns the words for a key; the key itself when the catalogue lacks it (a test keeps it complete)."""
        entry = self._entries.get(code)
        return code if entry is None else self.units.fill(entry, self._embedded(entry, values))

    def has(self, code: str) -> bool:
        """Returns whether the catalogue knows a key."""
        return code in self._entries

    def say(self, said: Message) -> str:
        """Returns a message in this language; what has words of its own among its values is translated first."""
        return self(said.code, **{name: self._put(value) for name, value in said.values.items()})

    def tell(self, said: Message | Explains) -> str:
        """Returns what `rcilab.i18n.error_messages` makes of an error or a remark, in this language."""
        return self.say(said) if isinstance(said, Message) else self._explain(said)

    @staticmethod
    def _embedded(entry: str, values: Mapping[str, object]) -> Mapping[str, object]:
        """Returns values as an entry takes them: a finished sentence gives up its full stop where another follows."""
        ends = {name: value for name, value in values.items() if isinstance(value, str) and value[-1:] in _STOPS}
        followed = {name: value for name, value in ends.items() if any(f"{{{name}}}{stop}" in entry for stop in _STOPS)}
        return {**values, **{name: value[:-1] for name, value in followed.items()}} if followed else values

    def _put(self, value: object) -> object:
        if isinstance(value, Message):
            return self.say(value)
        return self._explain(value) if isinstance(value, Explains) else value

    def _explain(self, said: Explains) -> str:
        return said.explain(self.language)
