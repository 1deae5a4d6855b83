"""What a user interface can ask the application for: frozen values that each feature declares next to its handlers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Anything a page asks for."""

    page: int | None = None
    """Client id of the page; None for requests of the application itself."""
    needs_control: ClassVar[bool] = True
    """Whether only the page that holds the controls may ask for it."""
    is_silent: ClassVar[bool] = False
    """Whether a page sends it without a press of the operator: it is not answered where it may not be asked for."""

    @property
    def replaces(self) -> str | None:
        """Names the waiting requests that this one replaces: those of one drag or slider. None: it replaces none."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Moving(Request):
    """A request that may set the robot in motion. A stop that comes before it has done so cancels it."""

    stops: int | None = None
    """Stops that the robot side had received when the page asked; None: as many as when it is carried out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeField(Request):
    """The text of a number field; the part of its name before the first dot names the feature that takes it."""

    field: str
    """joint.0 ..., pose.x ..., psi, speed, program.KEY.speed ..., setup.PART.NAME (see `setup.fields`)."""
    text: str


Handlers: TypeAlias = Mapping[type[Request], Callable[[Any], None]]
"""What a feature does for each of its requests."""
