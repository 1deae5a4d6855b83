"""The root of the errors and the two for wrong use: what the files of `errors.py`'s own imports raise."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Self

_UNSHOWN = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""What would act on a terminal, break a line, turn the direction of writing, or is half a character."""
_LONGEST = 2000  # Characters of what an error says of a value; tuning value: the longest of ours have some 600.


def plain_text(text: str, most: int = _LONGEST) -> str:
    """Returns a text in one line that anybody may print: with the escapes of what is not to be seen, and not too long.

    Args:
        text: From anywhere.
        most: Characters; of a longer text the end is left out.
    """
    if len(text) > most:
        text = text[: most - 1] + "…"
    return _UNSHOWN.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


class RcilabError(Exception):
    """The root of everything this package raises on purpose.

    Attributes:
        code: Names what went wrong, for faces that say it in their own words and language; "" where nothing does.
        facts: What fills these words, by name: numbers in SI, text, or errors.
    """

    code: str = ""
    facts: Mapping[str, object] = MappingProxyType({})

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles sentence and attributes: a constructor takes facts, not the sentence that it made of them."""
        return _restore, (type(self), self.args, self.__dict__)

    def coded(self, code: str, **facts: object) -> Self:
        """Returns this error with a name for what went wrong; its words are `error.CODE` of the catalogues of words."""
        self.code, self.facts = code, facts
        return self


def _restore(kind: type[RcilabError], args: tuple[object, ...], attributes: Mapping[str, object]) -> RcilabError:
    error: RcilabError = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    return error


class UsageError(RcilabError, RuntimeError):
    """A call in the wrong order or the wrong way."""


class InvalidValueError(UsageError, ValueError):
    """A value that cannot be used: wrong shape, not finite, out of range.

    Attributes:
        name: What the value is called.
        value: The value as it came in.
        requirement: What it has to be, and what it is not.
    """

    def __init__(self, name: str, value: object, requirement: str) -> None:
        name, requirement = plain_text(name), plain_text(requirement)
        is_array = type(value).__module__ == "numpy" and hasattr(value, "tolist")
        text = plain_text(repr(value.tolist() if is_array else value))  # type: ignore[attr-defined]
        said = text if len(text) < 120 else text[:117] + "..."
        is_missing = text in ("None", "nothing") and requirement.startswith("is missing")
        super().__init__(f"{name} {requirement}" if is_missing else f"{name}: {said} {requirement}")
        self.name = name
        self.value = value
        self.requirement = requirement
