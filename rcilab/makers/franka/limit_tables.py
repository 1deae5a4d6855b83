"""The Panda's largest translation velocity: that of its client library, or that of the page.

The rate limiter of the client library lets a program command up to 1.96 m/s; the page has 1.7 m/s. Both agree on all
other limits. The limits of the FR3 are the same in both tables.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits

LIMIT_TABLES = ("sdk", "manual")
DEFAULT_TABLE = "sdk"
PANDA_SDK_TRANSLATION = 2.0  # [m/s] Rate limiter of libfranka 0.9.2, of which it keeps 0.04 m/s for lost commands.
PANDA_MANUAL_TRANSLATION = 1.7  # [m/s] The page.


def require_table(table: str) -> str:
    """Returns the name of a table.

    Raises:
        InvalidValueError: There is no such table; the message lists all.
    """
    if table not in LIMIT_TABLES:
        raise InvalidValueError("limit table", table, f"is unknown; known: {', '.join(LIMIT_TABLES)}")
    return table


def cartesian_limits(limits: Limits, table: str = DEFAULT_TABLE) -> Limits:
    """Returns the limits with the Cartesian bounds of a table.

    Args:
        limits: The bounds of an arm as its model has them: those of its client library.
        table: "sdk" leaves them unchanged; "manual" is stricter for the Panda.

    Raises:
        InvalidValueError: There is no such table; the message lists all.
    """
    name = "translation_velocity"
    if require_table(table) == "sdk" or limits.cartesian.translation_velocity != PANDA_SDK_TRANSLATION:
        return limits
    sources = {**limits.sources, f"cartesian.{name}": "Franka's page Robot and interface specifications (Panda)"}
    return replace(
        limits,
        cartesian=replace(limits.cartesian, translation_velocity=PANDA_MANUAL_TRANSLATION),
        sources=MappingProxyType(sources),
    )
