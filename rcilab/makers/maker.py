"""What a maker of robots has to bring, and the registry of all makers.

A maker is a folder in `rcilab/makers` with a module `maker.py` that has a `MAKER`, and a folder `robots` with the data
files of its arms. Nothing outside its folder names it. `MAKER` is cheap to import: what needs sockets, physics or the
conditions of the interface is behind methods.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Protocol

from rcilab.core.condition import ConditionTable
from rcilab.core.errors import ModelError
from rcilab.core.fault import FaultCode
from rcilab.model.robot_model import RobotModel
from rcilab.robots import ROBOTS_BY_MAKER


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What rcilab can do with the arms of a maker beyond planning, checking and drawing."""

    simulates: bool = False
    """Whether there is a virtual controller."""
    drives: bool = False
    """Whether there is a driver for the real controller."""


class Maker(Protocol):
    """A maker of robots, as its folder describes it."""

    @property
    def name(self) -> str:
        """Name of its folder, such as "rokae"; a robot's description has it as `maker`."""
        ...

    @property
    def title(self) -> str:
        """Name as people write it, such as "ROKAE"."""
        ...

    @property
    def interface(self) -> str:
        """Name of its control interface in a sentence, such as "the RCI"."""
        ...

    @property
    def scheme(self) -> str:
        """URL scheme of its controllers, such as "rci" in rci://192.168.0.160:1337."""
        ...

    @property
    def robots(self) -> Mapping[str, str]:
        """Its arms: by name, the module of the data file in its folder `robots`."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What can be done with its arms."""
        ...

    def conditions(self) -> ConditionTable:
        """Returns the conditions that its interface has for a motion."""
        ...

    def faults(self) -> type[FaultCode]:
        """Returns the faults that its controllers report: number, name, cause, remedy."""
        ...


@cache
def all_makers() -> tuple[Maker, ...]:
    """Returns every maker, by name of the folder."""
    return tuple(import_module(f"rcilab.makers.{name}.maker").MAKER for name in ROBOTS_BY_MAKER)


def maker_of(model: RobotModel) -> Maker | None:
    """Returns the maker of an arm; None for an arm without a maker."""
    return next((maker for maker in all_makers() if maker.name == model.description.maker), None)


def find_scheme(scheme: str) -> Maker | None:
    """Returns the maker whose controllers have addresses with a URL scheme; None for an unknown scheme."""
    return next((maker for maker in all_makers() if maker.scheme == scheme.lower()), None)


def simulated_robots() -> tuple[str, ...]:
    """Returns the names of the arms that have a virtual controller."""
    return _robots_of(maker for maker in all_makers() if maker.capabilities.simulates)


def driven_robots() -> tuple[str, ...]:
    """Returns the names of the arms that have a driver."""
    return _robots_of(maker for maker in all_makers() if maker.capabilities.drives)


def require_simulator(model: RobotModel) -> RobotModel:
    """Returns `model` if its arm has a virtual controller.

    Raises:
        ModelError: It has no virtual controller; the message says what can be done with it.
    """
    return _require(model, simulated_robots())


def require_driver(model: RobotModel) -> RobotModel:
    """Returns `model` if its arm can be driven.

    Raises:
        ModelError: It cannot; the message says what can be done with it.
    """
    return _require(model, driven_robots())


def _robots_of(makers: Iterable[Maker]) -> tuple[str, ...]:
    return tuple(name for maker in makers for name in maker.robots)


def _require(model: RobotModel, possible: tuple[str, ...]) -> RobotModel:
    if model.name in possible:
        return model
    maker = maker_of(model)
    reason = "no maker's interface" if maker is None else f"{maker.interface}, which rcilab does not implement"
    raise ModelError(
        f"{model.name} is driven by {reason}: plan for it, check and draw its motions, but simulate and drive one of "
        f"{', '.join(possible)}"
    )
