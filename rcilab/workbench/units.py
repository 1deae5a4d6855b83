"""The units of a page: `rcilab.words.units`, under the name that the page's own files use."""

from __future__ import annotations

from rcilab.words.units import ANGLES, LENGTHS, USUAL, AngleUnit, LengthUnit, Unit, Units

__all__ = ["ANGLES", "LENGTHS", "USUAL", "AngleUnit", "LengthUnit", "Unit", "Units"]
