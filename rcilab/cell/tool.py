"""What an arm carries: a tool, its jaws, and the parts that it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.cell.shapes import Plane, Solid
from rcilab.core.arrays import as_number
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, as_pose
from rcilab.model.dynamics.payload import NO_LOAD, Payload

WIDEST = 2.0  # [m]
"""Largest width of jaws; a larger one is probably in millimetres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Jaws:
    """Two fingers that move along the y axis of the tool frame, in opposite directions.

    Raises:
        InvalidValueError: A width is not valid.
    """

    open: float
    """Distance of the fingers when open, [m]."""
    closed: float = 0.0
    """Distance when closed, [m]."""
    finger: tuple[Solid, ...] = ()
    """The finger on the side of positive y with the jaws closed to 0, in the tool frame; the other is its mirror."""
    signal: str = ""
    """Name of the output that closes them; empty without one."""

    def __post_init__(self) -> None:
        for name in ("open", "closed"):
            object.__setattr__(self, name, as_number(getattr(self, name), name, "m"))
        if not 0.0 <= self.closed < self.open <= WIDEST:
            problem = f"must be above the closed width, {self.closed:g} m, and at most {WIDEST:g} m"
            raise InvalidValueError("open", self.open, problem)
        object.__setattr__(self, "finger", require_solids(self.finger, "finger"))
        if self.signal:
            object.__setattr__(self, "signal", require_name(self.signal, "signal"))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Tool:
    """A tool at the flange.

    Raises:
        InvalidValueError: A value is not valid.
    """

    name: str = "tool"
    T_flange_tool: Pose = IDENTITY
    """Pose of its tip, the tool centre point (TCP)."""
    payload: Payload = NO_LOAD
    """Its mass properties, in the flange frame."""
    solids: tuple[Solid, ...] = ()
    """Its body, in the flange frame."""
    jaws: Jaws | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", require_name(self.name, "tool"))
        object.__setattr__(self, "T_flange_tool", as_pose(self.T_flange_tool, "T_flange_tool"))
        object.__setattr__(self, "solids", require_solids(self.solids, "solids"))
        require_payload(self.payload)

    def solids_at(self, width: float | None = None) -> tuple[Solid, ...]:
        """Returns its body with the fingers, in the flange frame.

        Args:
            width: Distance of the fingers, [m]; None for open jaws.
        """
        if self.jaws is None:
            return self.solids
        half = (self.jaws.open if width is None else width) / 2.0
        sides: list[Solid] = []
        for turn in (0.0, np.pi):  # The other finger is turned about the tool's axis.
            T_tool_side = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, turn)) @ Pose((0.0, half, 0.0))
            sides += [Solid(shape=s.shape, pose=self.T_flange_tool @ T_tool_side @ s.pose) for s in self.jaws.finger]
        return (*self.solids, *sides)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Part:
    """A part that the tool can hold: its mass properties, its shape, and where the tool holds it.

    Raises:
        InvalidValueError: A value is not valid.
    """

    name: str
    payload: Payload = NO_LOAD
    """Its mass properties, in its own frame."""
    T_tool_part: Pose = IDENTITY
    """Pose of its frame in the tool frame while it is held."""
    solids: tuple[Solid, ...] = ()
    """Its body, in its own frame."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", require_name(self.name, "part"))
        object.__setattr__(self, "T_tool_part", as_pose(self.T_tool_part, "T_tool_part"))
        object.__setattr__(self, "solids", require_solids(self.solids, "solids"))
        require_payload(self.payload)

    def at_flange(self, T_flange_tool: Pose) -> tuple[Payload, tuple[Solid, ...]]:
        """Returns the mass properties and the body of the held part in the flange frame."""
        T = T_flange_tool @ self.T_tool_part
        R, own = T.rotation, self.payload
        center = R @ own.center_of_mass + T.position if own.mass else np.zeros(3)
        load = Payload(mass=own.mass, center_of_mass=center, inertia=R @ own.inertia @ R.T)
        return load, tuple(Solid(shape=s.shape, pose=T @ s.pose) for s in self.solids)


def require_name(name: object, what: str) -> str:
    """Returns a name: one line of text that is not empty.

    Raises:
        InvalidValueError: It is not.
    """
    if isinstance(name, str) and name.strip() and name.isprintable() and len(name) <= _LONGEST_NAME:
        return name.strip()
    raise InvalidValueError(f"{what} name", name, f"must be one line of 1 to {_LONGEST_NAME} characters")


def require_solids(solids: object, name: str) -> tuple[Solid, ...]:
    """Returns solids that can be carried: a wall cannot.

    Raises:
        InvalidValueError: One of them is something else.
    """
    found: list[Solid] = []
    for number, solid in enumerate(solids if isinstance(solids, tuple | list) else (solids,), 1):
        if not isinstance(solid, Solid):
            raise InvalidValueError(
                f"{name}, entry {number}", type(solid).__name__, "must be a Solid(shape=..., pose=...)"
            )
        if isinstance(solid.shape, Plane):
            raise InvalidValueError(f"{name}, entry {number}", "plane", "cannot be carried; use a box")
        found.append(solid)
    return tuple(found)


def require_payload(payload: object) -> None:
    """Requires mass properties.

    Raises:
        InvalidValueError: It is something else.
    """
    if not isinstance(payload, Payload):
        raise InvalidValueError("payload", type(payload).__name__, "must be a Payload(mass=..., center_of_mass=...)")


_LONGEST_NAME = 60  # [characters]
