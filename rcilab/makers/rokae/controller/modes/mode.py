"""What a pair of modes runs."""

from __future__ import annotations

from typing import NamedTuple

from rcilab.makers.rokae.controller.actuator import ControlLaw


class Mode(NamedTuple):
    """A law of the drives, and what the client commands."""

    law: ControlLaw
    is_cartesian: bool
    """Whether tool poses are commanded, so that the tool's motion is judged and a singular start is refused."""
