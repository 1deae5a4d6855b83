"""What a client commands for one cycle, as a virtual arm takes it: plain floats, no maker's packet."""

from __future__ import annotations

from typing import NamedTuple


class ArmCommand(NamedTuple):
    """A command of any control mode; a motion generator reads the fields of its mode."""

    number: int
    """The cycle whose state it answers."""
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
