"""Numbers as people type them. Every answer is a value or a sentence, never an exception.

Why not viser's own number boxes: they turn a typed "-0.25" into "+0.25" and send every key.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from rcilab.words.text import Message, message

_TWO_WAYS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A comma that is a decimal comma to some and groups thousands for others, such as 1,000."""
_LONGEST = 40  # Characters; nobody types a longer number on purpose.


@dataclass(frozen=True)
class Parsed:
    """A number, or why there is none."""

    value: float | None
    problem: Message | None = None


def parse_number(typed: str, low: float, high: float, unit: str) -> Parsed:
    """Returns the number that somebody typed.

    Accepts a decimal comma, a typographic minus and the unit behind the number; where a comma may as well group
    thousands, the answer asks which is meant.

    Args:
        typed: As it stands in the field.
        low: Smallest number allowed, in the unit of the field.
        high: Largest number allowed.
        unit: The unit of the field, such as "deg".
    """
    shown = typed.strip()
    shown = shown if len(shown) <= _LONGEST else shown[: _LONGEST - 1] + "…"
    plain = (
        typed.strip()[: 10 * _LONGEST].replace("−", "-").replace("–", "-").removesuffix("°").removesuffix(unit).strip()
    )
    if not plain:
        return Parsed(None, message("parse.empty", low=_short(low), high=_short(high), unit=unit))
    if _TWO_WAYS.fullmatch(plain):
        return Parsed(
            None, message("parse.two_ways", typed=shown, point=plain.replace(",", "."), whole=plain.replace(",", ""))
        )
    if plain.count(",") == 1 and "." not in plain:
        plain = plain.replace(",", ".")
    try:
        if "_" in plain:
            raise ValueError
        value = float(plain)
    except ValueError:
        return Parsed(None, message("parse.garbage", typed=shown, unit=unit))
    if not math.isfinite(value):
        return Parsed(None, message("parse.not_finite", typed=shown, unit=unit))
    if not low <= value <= high:
        return Parsed(None, message("parse.range", typed=shown, low=_short(low), high=_short(high), unit=unit))
    return Parsed(value)


def _short(number: float) -> str:
    return f"{number:.3f}".rstrip("0").rstrip(".")
