"""Messages and their rendering in the language and the units of a user."""

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
class Explainable(Protocol):
    """A value of a message that renders itself, such as a violation."""

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns the text of this value."""
        ...


@dataclass(frozen=True)
class LiteralText:
    """An English text without a catalogue entry; it is shown as it is."""

    sentence: str

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns the text."""
        return self.sentence


@dataclass(frozen=True)
class ComparedValue:
    """A value together with the one it is compared with, both in an SI unit."""

    value: float
    other: float
    unit: str

    def explain(self, language: Language, units: Units | None = None) -> str:
        """Returns the value with its unit, with the fewest digits that show whether it differs from the other.

        Args:
            language: Without effect.
            units: Units of the user; None for SI.
        """
        shown = units or SI
        return shown.with_unit(shown.format_numbers(self.unit, self.value, self.other)[0], self.unit)


class Remark(str):
    """An English sentence that user interfaces can also show from their catalogues.

    Args:
        sentence: In English.
        code: Its catalogue key is `remark.CODE`; "" without an entry.
        facts: Values of the entry: numbers in SI, with a "unit" for "value" and "bound"; text; or remarks.
    """

    code: str
    facts: Mapping[str, object]

    @classmethod
    def all(cls, remarks: Iterable[str]) -> Remark:
        """Returns several remarks as one, in one line."""
        parts: list[Remark] = []
        for remark in remarks:
            parts += remark.parts if isinstance(remark, Remark) else (cls(remark),)
        if len(parts) < 2:
            return parts[0] if parts else cls("")
        return cls("; ".join(parts), "all", **{str(number): remark for number, remark in enumerate(parts, 1)})

    @property
    def parts(self) -> tuple[Remark, ...]:
        """The remarks joined here; the remark itself if it is a single one."""
        if self.code != "all":
            return (self,)
        return tuple(fact for fact in self.facts.values() if isinstance(fact, Remark))

    def as_dict(self) -> dict[str, object]:
        """Returns the remark as JSON data, for `from_dict`."""
        facts = {name: _as_json(fact) for name, fact in self.facts.items()}
        return {"said": str(self), "code": self.code, "facts": facts}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Remark:
        """Returns the remark from the data of `as_dict`.

        Raises:
            LookupError: The data are not valid.
            TypeError: The data are not valid.
        """
        facts = {
            name: cls.from_dict(fact) if isinstance(fact, dict) else fact for name, fact in content["facts"].items()
        }
        return cls(str(content["said"]), str(content["code"]), **facts)

    def __new__(cls, sentence: str, code: str = "", **facts: object) -> Remark:  # noqa: D102  # See the class.
        remark = super().__new__(cls, sentence)
        remark.code, remark.facts = code, facts
        return remark


@dataclass(frozen=True)
class Message:
    """A text for a user, before it is rendered in a language."""

    code: str
    """Key in the catalogues."""
    values: Mapping[str, object] = field(default_factory=dict)
    """Values of the variables in the text."""


def with_space(lead: str, rest: str) -> tuple[str, str]:
    """Returns two texts to be joined, with a space before the second unless the first ends in Chinese."""
    return lead, rest if lead[-1:] >= "\u3000" else f" {rest}"


def message(code: str, **values: object) -> Message:
    """Returns a message from its key and the values of its variables."""
    return Message(code, MappingProxyType(values))


def _as_json(fact: object) -> object:
    """Returns a fact as JSON data; infinity and NaN, which JSON does not have, as text."""
    if isinstance(fact, Remark):
        return fact.as_dict()
    return str(fact) if isinstance(fact, float) and not math.isfinite(fact) else fact


class Text:
    """The texts of a user interface in one language; call it with a key.

    Attributes:
        language: "en" or "zh".
        units: Units of angles and lengths.

    Args:
        language: "en" or "zh".
        package: Package with the texts of this user interface, such as rcilab.app; shared texts are added.
        units: Units of angles and lengths.
        maker: Maker of the arm, whose wording replaces the usual one; "" for none.

    Raises:
        InvalidValueError: There is no catalogue for this language.
    """

    def __init__(self, language: str, package: str, units: Units = USUAL, maker: str = "") -> None:
        self.language: Language = require_language(language)
        self.units = units
        self._entries = load_ui_catalogue(package, self.language, maker)

    def __call__(self, code: str, **values: object) -> str:
        """Returns the text for a key; the key itself if it is missing (a test keeps the catalogues complete)."""
        entry = self._entries.get(code)
        return code if entry is None else self.units.fill(entry, self._embedded(entry, values))

    def has(self, code: str) -> bool:
        """Returns whether the catalogue has a key."""
        return code in self._entries

    def render(self, item: Message | Explainable) -> str:
        """Returns a message or an explainable value as text; such values inside a message are rendered first."""
        if not isinstance(item, Message):
            return self._explain(item)
        return self(item.code, **{name: self._render_value(value) for name, value in item.values.items()})

    @staticmethod
    def _embedded(entry: str, values: Mapping[str, object]) -> Mapping[str, object]:
        """Returns the values for an entry; a value that ends in a full stop loses it where the entry has one."""
        ends = {name: value for name, value in values.items() if isinstance(value, str) and value[-1:] in _STOPS}
        followed = {name: value for name, value in ends.items() if any(f"{{{name}}}{stop}" in entry for stop in _STOPS)}
        return {**values, **{name: value[:-1] for name, value in followed.items()}} if followed else values

    def _render_value(self, value: object) -> object:
        return self.render(value) if isinstance(value, Message | Explainable) else value

    def _explain(self, item: Explainable) -> str:
        return item.explain(self.language)
