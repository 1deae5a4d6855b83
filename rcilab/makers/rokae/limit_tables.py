"""The Cartesian limits: those of the manual, or those of the vendor SDK's rate limiter."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits

LIMIT_TABLES = ("manual", "sdk")

SDK_TRANSLATION_VELOCITY = 1.5  # [m/s] Vendor SDK, rate limiter.
SDK_ROTATION_ACCELERATION = 25.0  # [rad/s^2] Vendor SDK, rate limiter.
SDK_ROTATION_JERK = 12500.0  # [rad/s^3] Vendor SDK, rate limiter.

_SDK = "vendor SDK, rate limiter"


def cartesian_limits(limits: Limits, table: str = "manual") -> Limits:
    """Returns the limits with the Cartesian bounds of a table.

    A program that limits its rates with the vendor's SDK may legally exceed the manual's numbers (4.4); "sdk" lets it
    run unchanged.

    Args:
        limits: The bounds of an arm as its model has them: the manual's.
        table: "manual" leaves them unchanged; "sdk" replaces them by the vendor's constants.

    Raises:
        InvalidValueError: There is no such table; the message lists all.
    """
    if require_table(table) == "manual":
        return limits
    changes = {
        "translation_velocity": SDK_TRANSLATION_VELOCITY,
        "rotation_acceleration": SDK_ROTATION_ACCELERATION,
        "rotation_jerk": SDK_ROTATION_JERK,
    }
    sources = {**limits.sources, **{f"cartesian.{name}": _SDK for name in changes}}
    return replace(limits, cartesian=replace(limits.cartesian, **changes), sources=MappingProxyType(sources))


def require_table(table: str) -> str:
    """Returns the name of a table.

    Raises:
        InvalidValueError: There is no such table; the message lists all.
    """
    if table not in LIMIT_TABLES:
        raise InvalidValueError("limit table", table, f"is unknown; known: {', '.join(LIMIT_TABLES)}")
    return table
