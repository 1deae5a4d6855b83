"""How far under the limits our planners stay."""

from __future__ import annotations

LIMIT_MARGIN = 0.999
"""Part of each velocity, acceleration and jerk limit that a planned motion uses.

A choice. The manual's conditions are strict, and a time-optimal curve sits on its bounds: its backward differences at
1 ms are means of the derivative, so they reach the bound itself. Angles as doubles add rounding of 4e-6 rad/s^3 to a
third difference. A part in a thousand covers both, and a start that is 1 nrad off, for 0.1 % of the time. It is not a
margin for lost packets: that one belongs to whoever streams.
"""
