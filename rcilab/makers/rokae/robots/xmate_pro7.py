"""The xMatePro7: 7 axes, 7.0 kg. Shoulder, elbow and wrist without offsets."""

from __future__ import annotations

from math import pi

from rcilab.makers.rokae.robots.xmate import MANUAL, ROS2, build_xmate, pro_heights, solid_link, tabled_link
from rcilab.robots.description import DhRow

_HEIGHTS = pro_heights(d1=0.4040, d3=0.4375, d5=0.4125, d7=0.2755)

DESCRIPTION = build_xmate(
    name="xMatePro7",
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.4040),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.4375),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.4125),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=0.0, d=0.2755),
    ),
    dh_source=f"{MANUAL}, 4.5, xMatePro7",
    base=tabled_link(5.48267, (-0.0183, 0.0, 0.067), (0.026, 0.0266, 0.0235), 0.0, ROS2),
    links=(
        solid_link(5.96204, (0.0, -0.017, 0.320), 0.080, 0.30, _HEIGHTS[0]),
        solid_link(5.40302, (0.0, 0.032, 0.093), 0.075, 0.35, _HEIGHTS[1]),
        solid_link(3.95735, (0.0, -0.013, -0.067), 0.070, 0.29, _HEIGHTS[2]),
        solid_link(2.91217, (0.0, 0.026, 0.068), 0.065, 0.33, _HEIGHTS[3]),
        solid_link(2.47056, (0.0, -0.014, -0.079), 0.060, 0.28, _HEIGHTS[4]),
        solid_link(2.16053, (0.0, 0.020, 0.085), 0.060, 0.26, _HEIGHTS[5]),
        solid_link(1.26834, (0.0, 0.012, -0.052), 0.055, 0.12, _HEIGHTS[6]),
    ),
    home_deg=(0, 30, 0, 60, 0, 90, 0),
    rated_payload=7.0,
)
