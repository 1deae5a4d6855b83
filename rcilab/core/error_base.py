"""The base class of the errors and the two errors for wrong use, for modules that `errors.py` imports."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Self

_UNSAFE = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that control a terminal, break a line or reverse the writing direction, and surrogates."""
_MAX_LENGTH = 2000  # Characters of a text in an error; the longest in normal use have about 600.


def plain_text(text: str, max_length: int = _MAX_LENGTH) -> str:
    """Returns a text that is safe to print: one line, control characters escaped, of limited length.

    Args:
        text: Text from any source.
        max_length: Largest number of characters; a longer text is cut.
    """
    if len(text) > max_length:
        text = text[: max_length - 1] + "…"
    return _UNSAFE.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


class RcilabError(Exception):
    """The base class of all exceptions of this package.

    Attributes:
        code: Key of its message `error.CODE` in the catalogues, for a UI in another language; "" without one.
        facts: Values for that message, by name: numbers in SI, text, or errors.
    """

    code: str = ""
    facts: Mapping[str, object] = MappingProxyType({})

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles message and attributes: a constructor takes facts, not the message built from them."""
        return _restore, (type(self), self.args, self.__dict__)

    def coded(self, code: str, **facts: object) -> Self:
        """Sets code and facts, and returns this error."""
        self.code, self.facts = code, facts
        return self


def _restore(kind: type[RcilabError], args: tuple[object, ...], attributes: Mapping[str, object]) -> RcilabError:
    error: RcilabError = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(attributes)
    return error


class UsageError(RcilabError, RuntimeError):
    """A call in the wrong order or with wrong arguments."""


class InvalidValueError(UsageError, ValueError):
    """An invalid value: wrong shape, not finite, out of range.

    Attributes:
        name: Name of the value.
        value: The value that was passed.
        requirement: What it must be ("must be ...", "needs ..."), or what is wrong with it; may end with "; advice".
    """

    def __init__(self, name: str, value: object, requirement: str) -> None:
        name, requirement = plain_text(name), plain_text(requirement)
        is_array = type(value).__module__ == "numpy" and hasattr(value, "tolist")
        text = plain_text(repr(value.tolist() if is_array else value))  # type: ignore[attr-defined]
        shown = text if len(text) < 120 else text[:117] + "..."
        if requirement.startswith(("must ", "needs ")):
            rule, semicolon, advice = requirement.partition("; ")
            message = f"{name} {rule}, got {shown}{semicolon}{advice}"
        elif requirement.startswith("is missing") and text in ("None", "nothing"):
            message = f"{name} {requirement}"
        else:
            message = f"{name}: {shown} {requirement}"
        super().__init__(message)
        self.name = name
        self.value = value
        self.requirement = requirement
