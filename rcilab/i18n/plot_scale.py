"""Unit and smallest range of a plotted quantity, the same on the page and in an exported file."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rcilab.i18n.units import USUAL, Units

_SI = {
    "q": "rad", "dq": "rad/s", "ddq": "rad/s^2", "jerk": "rad/s^3", "tau": "N m", "speed": "m/s",
    "acceleration": "m/s^2", "psi": "rad", "error": "rad", "tool": "m",
}  # fmt: skip
ERRORS = ("error", "tool")
"""Tracking errors of the joints and of the tool: measured minus planned."""
_MIN_RANGE = {"q": math.radians(1.0), "dq": math.radians(1.0), "tau": 0.5, "error": math.radians(0.02), "tool": 2e-5}
"""In SI. Tuning values: errors below 0.02 degrees or 0.02 mm are to look like zero."""
_RESOLUTION = 100.0  # A value is rounded to this fraction of the smallest range: finer digits are noise.


@dataclass(frozen=True, slots=True, kw_only=True)
class PlotScale:
    """Unit and rounding of a plotted quantity."""

    unit: str
    """Name of the unit, such as °/s."""
    factor: float
    """One SI unit in this unit."""
    least: float
    """Smallest range of an axis that adapts to its curves, to each side of zero; 0: the axis does not adapt."""

    @property
    def digits(self) -> int:
        """Decimals of a single value."""
        return max(0, math.ceil(math.log10(_RESOLUTION / self.least))) if self.least else 3

    def with_unit(self, number: str) -> str:
        """Returns a single value with its unit."""
        return f"{number}·{self.unit}" if self.unit[0].isdigit() else f"{number} {self.unit}"


def plot_scale(name: str, units: Units = USUAL) -> PlotScale:
    """Returns the scale for a quantity.

    Args:
        name: q, dq, ddq, jerk, tau; speed, acceleration, psi of the tool; or one of `ERRORS`.
        units: Units of the page.
    """
    factor, unit = units.from_si(_SI[name])
    if name in ERRORS and factor == 1.0:  # Errors are small, and the numbers of a plot have at most three decimals.
        factor, unit = 1e3, "10⁻³ m" if unit == "m" else f"m{unit}"  # No mm for a user who chose metres.
    return PlotScale(unit=unit, factor=factor, least=factor * _MIN_RANGE.get(name, 0.0))
