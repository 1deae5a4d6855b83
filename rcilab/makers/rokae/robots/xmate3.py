"""The xMate3: 6 axes, 3.0 kg, with a spherical wrist."""

from __future__ import annotations

from math import pi

from rcilab.makers.rokae.robots.xmate import MANUAL, ROS2, build_xmate, tabled_link
from rcilab.robots.description import DhRow

_SHOULDER = 0.3415  # [m] d1
_ELBOW = _SHOULDER + 0.3940  # [m] + a2
_WRIST = _ELBOW + 0.3660  # [m] + d4
_FLANGE = _WRIST + 0.2503  # [m] + d6

DESCRIPTION = build_xmate(
    name="xMate3",
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.3415),
        DhRow(a=0.3940, alpha=0.0, d=0.0, theta_offset=-pi / 2),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0, theta_offset=+pi / 2),
        DhRow(a=0.0, alpha=-pi / 2, d=0.3660),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=0.0, d=0.2503),
    ),
    dh_source=(
        f"{MANUAL}, 4.5, xMate3; the manual prints Theta = 0 for every joint, which would lay the upper arm flat at "
        f"zero: the offsets of joints 2 and 3 are added here because the real arm stands upright ({ROS2})"
    ),
    base=tabled_link(5.48267, (-0.0183, 0.0, 0.067), (0.0256, 0.0266, 0.0235), 0.0, f"{ROS2}, xMatePro3"),
    links=(
        tabled_link(3.256, (-0.000104, -0.012728, 0.27899), (0.023256, 0.021940, 0.005579, -0.002323), 0.0, ROS2),
        tabled_link(4.868, (-0.000275, 0.004232, 0.217328), (0.143301, 0.138437, 0.012252, -0.019206), _SHOULDER, ROS2),
        tabled_link(2.825, (0.000053, 0.020743, 0.081129), (0.025869, 0.023972, 0.005041, -0.004187), _ELBOW, ROS2),
        tabled_link(2.173, (0.000076, -0.020415, -0.053465), (0.013157, 0.011708, 0.003528, -0.002169), _WRIST, ROS2),
        tabled_link(2.150, (-0.000072, 0.00994, 0.089188), (0.014409, 0.013858, 0.002604, -0.001650), _WRIST, ROS2),
        tabled_link(1.067, (0.000057, 0.011981, -0.048), (0.002007, 0.001376, 0.001541, -0.000169), _FLANGE, ROS2),
    ),
    home_deg=(0, 30, 60, 0, 90, 0),
    rated_payload=3.0,
)
