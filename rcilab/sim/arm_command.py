"""A client's command for one cycle, as plain floats, independent of the maker's packets."""

from __future__ import annotations

from typing import NamedTuple


class ArmCommand(NamedTuple):
    """A command of any control mode; a motion generator reads the fields of its mode."""

    number: int
    """Number of the cycle whose state it answers."""
    q: tuple[float, ...] = ()
    """Joint angles, n numbers, [rad]."""
    T_base_tool: tuple[float, ...] = ()
    """Tool pose in base, 16 numbers, row-major, [m]."""
    has_psi: bool = False
    """Whether `psi` is valid."""
    psi: float = 0.0
    """Arm angle, [rad]."""
    finished: bool = False
    """True on the last command of a motion."""
    tau: tuple[float, ...] = ()
    """Joint torques, n numbers, [N m]."""
    dq: tuple[float, ...] = ()
    """Joint velocities, n numbers, [rad/s]."""
    twist: tuple[float, ...] = ()
    """Velocity of the tool, base axes, linear first, 6 numbers, [m/s, rad/s]."""
    elbow_side: float = 0.0
    """Side of the elbow, +1 or -1, where the maker defines one; 0: not commanded."""
