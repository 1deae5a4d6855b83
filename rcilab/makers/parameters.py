"""The parameters of a maker's arms: groups of numbers with unit, range, default and name, for user interfaces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rcilab.core.state import Mode
from rcilab.i18n.translator import Message
from rcilab.makers.configuration import ControllerParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number."""

    label: Message
    """Key of its name, in the shared catalogue or the maker's."""
    low: float
    high: float
    default: float
    """The controller's value after its start."""
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterGroup:
    """Numbers that are sent together."""

    name: str
    """Name in `ControllerParameters`; its text is `control.NAME`."""
    parameters: tuple[Parameter, ...]
    modes: tuple[Mode, ...]
    """The modes in which it has an effect."""
    is_first: bool = False
    """Whether it is the main parameter of the mode: user interfaces show it unfolded."""

    @property
    def defaults(self) -> tuple[float, ...]:
        """The default of every number."""
        return tuple(parameter.default for parameter in self.parameters)


def default_parameters(groups: Iterable[ParameterGroup]) -> ControllerParameters:
    """Returns a controller's parameters after its start."""
    return ControllerParameters(**{group.name: group.defaults for group in groups})
