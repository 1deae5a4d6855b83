"""The xMatePro3: 7 axes, 3.0 kg. Shoulder, elbow and wrist without offsets."""

from __future__ import annotations

from math import pi

from rcilab.makers.rokae.robots.xmate import MANUAL, ROS2, build_xmate, pro_heights, solid_link, tabled_link
from rcilab.robots.description import DhRow

_HEIGHTS = pro_heights(d1=0.3415, d3=0.3940, d5=0.3660, d7=0.2503)

DESCRIPTION = build_xmate(
    name="xMatePro3",
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.3415),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.3940),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.3660),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=0.0, d=0.2503),
    ),
    dh_source=f"{MANUAL}, 4.5, xMatePro3",
    base=tabled_link(5.48267, (-0.0183, 0.0, 0.067), (0.0256, 0.0266, 0.0235), 0.0, ROS2),
    links=(
        solid_link(3.12198, (0.0, -0.012, 0.303), 0.070, 0.26, _HEIGHTS[0]),
        solid_link(3.66021, (0.0, 0.019, 0.127), 0.065, 0.32, _HEIGHTS[1]),
        solid_link(3.38219, (0.0, -0.011, -0.046), 0.065, 0.26, _HEIGHTS[2]),
        solid_link(2.73151, (0.0, 0.025, 0.095), 0.060, 0.30, _HEIGHTS[3]),
        solid_link(2.21894, (0.0, -0.017, -0.045), 0.055, 0.25, _HEIGHTS[4]),
        solid_link(2.18056, (0.0, 0.013, 0.099), 0.055, 0.24, _HEIGHTS[5]),
        solid_link(0.94078, (0.0, 0.011, -0.038), 0.050, 0.10, _HEIGHTS[6]),
    ),
    home_deg=(0, 30, 0, 60, 0, 90, 0),
    rated_payload=3.0,
)
