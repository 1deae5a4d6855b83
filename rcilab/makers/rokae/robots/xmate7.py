"""The xMate7: 6 axes, 7.0 kg, with a spherical wrist."""

from __future__ import annotations

from math import pi

from rcilab.makers.rokae.robots.xmate import MANUAL, ROS2, build_xmate, tabled_link
from rcilab.robots.description import DhRow

_SHOULDER = 0.4040  # [m] d1
_ELBOW = _SHOULDER + 0.4375  # [m] + a2
_WRIST = _ELBOW + 0.4125  # [m] + d4
_FLANGE = _WRIST + 0.2755  # [m] + d6

DESCRIPTION = build_xmate(
    name="xMate7",
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.4040),
        DhRow(a=0.4375, alpha=0.0, d=0.0, theta_offset=-pi / 2),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0, theta_offset=+pi / 2),
        DhRow(a=0.0, alpha=-pi / 2, d=0.4125),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=0.0, d=0.2755),
    ),
    dh_source=(
        f"{MANUAL}, 4.5, xMate7; the manual prints Theta = 0 for every joint, which would lay the upper arm flat at "
        f"zero: the offsets of joints 2 and 3 are added here because the real arm stands upright ({ROS2})"
    ),
    base=tabled_link(5.48267, (-0.0183, 0.0, 0.067), (0.0256, 0.0266, 0.0235), 0.0, f"{ROS2}, xMatePro3"),
    links=(
        tabled_link(5.179, (-0.000042, -0.013288, 0.327892), (0.053973, 0.051289, 0.013774, -0.004639), 0.0, ROS2),
        tabled_link(6.069, (-0.000065, 0.015028, 0.199989), (0.226388, 0.219363, 0.018138, -0.032301), _SHOULDER, ROS2),
        tabled_link(2.990, (-0.000278, 0.019667, 0.088966), (0.029060, 0.027099, 0.005269, -0.004639), _ELBOW, ROS2),
        tabled_link(2.501, (0.000178, -0.012921, -0.057504), (0.019661, 0.017808, 0.004578, -0.001552), _WRIST, ROS2),
        tabled_link(2.192, (-0.000062, 0.013079, 0.114262), (0.017043, 0.016075, 0.003122, -0.002965), _WRIST, ROS2),
        tabled_link(0.961, (0.000574, 0.016762, -0.051921), (0.002276, 0.001504, 0.001555, -0.000282), _FLANGE, ROS2),
    ),
    home_deg=(0, 30, 60, 0, 90, 0),
    rated_payload=7.0,
)
