"""How a request is handled: what a setter does and how it is answered, and what a getter returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple, TypeAlias

from rcilab.makers.realman.controller.realman_controller import RealManController
from rcilab.makers.realman.wire.line import Request
from rcilab.sim.channels import Peer

MOTION_FIELD: Final = "receive_state"
"""Of the answer to a motion command, whose end is an event."""

Getter: TypeAlias = Callable[[RealManController, Request], Mapping[str, Any]]
"""Returns a whole answer."""


class Setter(NamedTuple):
    """A request that is answered with true or false."""

    field: str
    """Of the answer."""
    run: Callable[[RealManController, Request, Peer], None]
    """Raises an InvalidValueError for a request that is refused."""


def setter(field: str, run: Callable[[RealManController, Request], object]) -> Setter:
    """Returns a setter that does not need its client."""
    return Setter(field, lambda controller, request, peer: _drop(run(controller, request)))


def _drop(value: object) -> None:
    del value
