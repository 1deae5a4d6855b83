"""The arms this package knows, one data file each."""

from __future__ import annotations

from importlib import import_module

from rcilab.core.errors import ModelError, plain_text
from rcilab.robots.description import DhRow, Link, RobotDescription

__all__ = ["RCI_ROBOT_NAMES", "ROBOT_NAMES", "DhRow", "Link", "RobotDescription", "describe_robot"]

_XMATE_FILES = {"xMatePro3": "xmate_pro3", "xMatePro7": "xmate_pro7", "xMate3": "xmate3", "xMate7": "xmate7"}
_XMATES = {name: f"rcilab.makers.rokae.robots.{module}" for name, module in _XMATE_FILES.items()}
_MODULES = {**_XMATES, "Panda": "rcilab.makers.franka.robots.panda"}

ROBOT_NAMES = tuple(_MODULES)
"""Every arm that can be computed with."""
RCI_ROBOT_NAMES = tuple(_XMATES)
"""Those that speak the RCI, and so can be simulated and driven as well."""


def describe_robot(name: str) -> RobotDescription:
    """Returns the description of a robot by name, in any case.

    Raises:
        ModelError: No robot has this name; the message lists those that exist.
    """
    for known, module in _MODULES.items():
        if known.lower() == str(name).lower():
            return import_module(module).DESCRIPTION
    raise ModelError(f"unknown robot {plain_text(repr(name), 60)}; known robots: {', '.join(ROBOT_NAMES)}")
