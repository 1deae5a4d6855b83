"""The requests of a user interface to the application: frozen values that each feature declares with its handlers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """A request of a page."""

    page: int | None = None
    """Client id of the page; None for requests of the application itself."""
    needs_control: ClassVar[bool] = True
    """Whether only the page with the controls may send it."""
    is_silent: ClassVar[bool] = False
    """Whether a page sends it without an action of the operator: it is then refused without an answer."""

    @property
    def replaces(self) -> str | None:
        """Key of the waiting requests that this one replaces: those of one drag or slider. None: none."""
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Moving(Request):
    """A request that may set the robot in motion. An earlier stop cancels it."""

    stops: int | None = None
    """Number of stops that the robot had received when the page sent it; None: as many as when it is carried out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeField(Request):
    """The text of a number field; the part of its name before the first dot names the feature."""

    field: str
    """joint.0 ..., pose.x ..., psi, speed, program.KEY.speed ..., setup.PART.NAME (see `setup/setup_fields.py`),
    cell.INDEX.NAME (see `cell/cell_actions.py`), path.blend."""
    text: str


Handlers: TypeAlias = Mapping[type[Request], Callable[[Any], None]]
"""The handlers of a feature's requests."""
