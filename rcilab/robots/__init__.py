"""Descriptions of arms as data. The data files are in the makers' folders, `rcilab/makers/*/robots`.

This package finds them by folder and imports one when its arm is requested, so that the layers below `rcilab.makers`
can load an arm by name without importing a maker. A maker lists its arms in `ROBOTS` of its folder `robots`: name to
module.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from types import MappingProxyType

from rcilab.core.errors import ModelError, plain_text
from rcilab.robots.description import DhRow, Link, RobotDescription

__all__ = ["ROBOTS_BY_MAKER", "ROBOT_NAMES", "DhRow", "Link", "RobotDescription", "describe_robot"]

_MAKERS = Path(__file__).parents[1] / "makers"


def _find_robots() -> dict[str, Mapping[str, str]]:
    found = sorted(file.parents[1].name for file in _MAKERS.glob("*/robots/__init__.py"))
    return {maker: import_module(f"rcilab.makers.{maker}.robots").ROBOTS for maker in found}


ROBOTS_BY_MAKER: Mapping[str, Mapping[str, str]] = MappingProxyType(_find_robots())
"""Modules of the data files, by the maker's folder and the arm's name."""
ROBOT_NAMES = tuple(name for robots in ROBOTS_BY_MAKER.values() for name in robots)
"""Names of all arms."""


def describe_robot(name: str) -> RobotDescription:
    """Returns the description of a robot by name, in any case.

    Raises:
        ModelError: No robot has this name; the message lists those that exist.
    """
    for maker, robots in ROBOTS_BY_MAKER.items():
        for known, module in robots.items():
            if known.lower() == str(name).lower():
                return import_module(f"rcilab.makers.{maker}.robots.{module}").DESCRIPTION
    if name.lower().endswith(".json"):
        raise ModelError(f"{plain_text(repr(name), 60)} is a file; this takes the name of an arm, such as xMatePro7")
    if "/" in name or "." in name:
        raise ModelError(f"{plain_text(repr(name), 60)} is not the file of an arm, which ends in .json")
    raise ModelError(f"unknown robot {plain_text(repr(name), 60)}; {_suggest(name)}")


def _suggest(name: str) -> str:
    """Returns which name may be meant: a maker's, one with other punctuation, or a similar one."""
    if own := ROBOTS_BY_MAKER.get(name.lower()):
        return f"that is a maker, its robots: {', '.join(own)}"
    plain = {"".join(filter(str.isalnum, known)).lower(): known for known in ROBOT_NAMES}
    close = get_close_matches("".join(filter(str.isalnum, name)).lower(), plain, n=1, cutoff=0.75)
    hint = f"did you mean {plain[close[0]]}? " if close else ""
    return f"{hint}known robots: {', '.join(ROBOT_NAMES)}"
