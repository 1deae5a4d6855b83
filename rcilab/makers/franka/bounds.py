"""Ranges and initial values of the settings of a client."""

from __future__ import annotations

from typing import Final

from rcilab.core.errors import InvalidValueError
from rcilab.robots.description import RobotDescription

CLIENT_PORT: Final = 1337
"""TCP port that every client connects to."""
SINGLE_PRECISION: Final = 3e-7  # [rad] or [m] Half a unit in the last place of a float below 8 is at most 2.4e-7.
"""Rounding in the states of version 10."""
LONGEST_TOOL: Final = 2.0  # [m] Distance of a frame, or of a centre of mass, from the flange; rcilab's own bound.
LARGEST_JOINT_STIFFNESS: Final = 14250.0  # [N m/rad] Comments of libfranka's robot.h, as the two below.
CARTESIAN_STIFFNESS: Final = ((10.0, 3000.0), (1.0, 300.0))
"""Smallest and largest, along an axis and about it, [N/m], [N m/rad]."""
JOINT_STIFFNESS: Final = (3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0)  # [N m/rad] After power-up.
DEFAULT_CARTESIAN_STIFFNESS: Final = (2000.0, 2000.0, 2000.0, 100.0, 100.0, 100.0)  # [N/m], [N m/rad] The same.
DEFAULT_THRESHOLD: Final = 20.0  # [N m], [N] Of every contact and collision after power-up; rcilab's own choice.
LARGEST_THRESHOLD: Final = 1000.0  # [N m], [N] Of user interfaces; rcilab's own bound, the interface has none.


def require_payload(mass: float, mounted: float, arm: RobotDescription) -> None:
    """Raises an error if a load and the end effector, both in [kg], are heavier than the rated payload.

    Raises:
        InvalidValueError: They are too heavy.
    """
    most = arm.rated_payload
    if mass + mounted <= most:
        return
    what = f"kg and {mounted:g} kg of the end effector are" if mounted else "kg is"
    error = InvalidValueError("mass", float(f"{mass:.9g}"), f"{what} above {most:g} kg, the rated payload")
    facts = {"mass": f"{mass:g}", "most": f"{most:g}", "model": arm.name}
    if mounted:
        raise error.coded("load_heavy_mounted", mounted=f"{mounted:g}", **facts)
    raise error.coded("load_heavy", **facts)
