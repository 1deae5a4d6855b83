"""What a maker's arms can be set to: groups of numbers with unit, range, default and name, drawn by user interfaces."""

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
    """Its name; the key is of the shared catalogue or of the maker's."""
    low: float
    high: float
    default: float
    """What the controller has after its start."""
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterGroup:
    """Numbers that are sent together."""

    name: str
    """In `ControllerParameters`; catalogues call the group `control.NAME`."""
    parameters: tuple[Parameter, ...]
    modes: tuple[Mode, ...]
    """In which modes it has an effect."""
    is_first: bool = False
    """Whether it is what the mode is chosen for: user interfaces show it unfolded."""

    @property
    def defaults(self) -> tuple[float, ...]:
        """The default of every number."""
        return tuple(parameter.default for parameter in self.parameters)


def default_parameters(groups: Iterable[ParameterGroup]) -> ControllerParameters:
    """Returns what a controller has after its start."""
    return ControllerParameters(**{group.name: group.defaults for group in groups})
