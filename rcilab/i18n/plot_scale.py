"""How a plot shows a quantity, on the page and in an exported file alike: its unit, and how small its range may be."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rcilab.i18n.units import USUAL, Units

_SI = {
    "q": "rad", "dq": "rad/s", "ddq": "rad/s^2", "jerk": "rad/s^3", "tau": "N m", "speed": "m/s",
    "acceleration": "m/s^2", "psi": "rad", "error": "rad", "tool": "m",
}  # fmt: skip
ERRORS = ("error", "tool")
"""Of the joints and of the tool: what a plot of measured against planned shows."""
_LEAST = {"q": math.radians(1.0), "dq": math.radians(1.0), "tau": 0.5, "error": math.radians(0.02), "tool": 2e-5}
"""In SI. Choices: errors below 0.02 degrees or 0.02 mm look like none."""
_FINEST = 100.0  # Parts of the least range to which a single value is rounded: finer digits are noise.


@dataclass(frozen=True, slots=True, kw_only=True)
class PlotScale:
    """In which unit a quantity is drawn, and how it is rounded."""

    unit: str
    """Such as °/s."""
    factor: float
    """How many of it one SI unit is."""
    least: float
    """A plot that follows its curves spans this much to each side of nothing, at least; 0: no such plot is made."""

    @property
    def digits(self) -> int:
        """Behind the point of a single value."""
        return max(0, math.ceil(math.log10(_FINEST / self.least))) if self.least else 3

    def with_unit(self, number: str) -> str:
        """Returns a single value with its unit."""
        return f"{number}·{self.unit}" if self.unit[0].isdigit() else f"{number} {self.unit}"


def plot_scale(name: str, units: Units = USUAL) -> PlotScale:
    """Returns how a quantity is drawn.

    Args:
        name: q, dq, ddq, jerk, tau; speed, acceleration, psi of the tool; or one of `ERRORS`.
        units: Those of the page.
    """
    factor, unit = units.from_si(_SI[name])
    if name in ERRORS and factor == 1.0:  # Errors are small, and a plot's numbers end three digits behind the point.
        factor, unit = 1e3, "10⁻³ m" if unit == "m" else f"m{unit}"  # A user of metres reads no mm.
    return PlotScale(unit=unit, factor=factor, least=factor * _LEAST.get(name, 0.0))
