"""The name of an arm as its controller reports it, such as "RML63III-B"."""

from __future__ import annotations

from rcilab.makers.realman.robots import ROBOTS


def product_version(name: str) -> str:
    """Returns the model as a client reads it, without a force sensor, such as "RML63III-B"."""
    return f"{_product(name)}-B"


def arm_of_product(version: str) -> str | None:
    """Returns the name of the arm that a controller reports, whatever its force sensor; None for an unknown one."""
    product = version.partition("-")[0].upper()
    return next((name for name in ROBOTS if _product(name).upper() == product), None)


def _product(name: str) -> str:
    return name.replace("-", "")
