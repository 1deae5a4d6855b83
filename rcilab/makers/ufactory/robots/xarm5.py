"""The xArm5: 5 axes, 3 kg. Its tool can be turned about its own axis and in the plane of the arm only."""

from __future__ import annotations

from math import atan2, hypot, pi

from rcilab.makers.ufactory.robots.arm import build_ufactory, rod, ufactory_base, ufactory_limits
from rcilab.makers.ufactory.robots.xarm6 import HAND_ROD, UPPER_ARM, UPPER_ARM_RODS, WRIST_RODS, XARM_RODS
from rcilab.robots.description import DhRow

_LEAN, _FORE_LEAN = atan2(*UPPER_ARM), atan2(0.3425, 0.0775)

DESCRIPTION = build_ufactory(
    name="xArm5",
    limits=ufactory_limits(
        [-2 * pi, -2.059488, -3.92699, -1.692969, -2 * pi],
        [2 * pi, 2.094395, 0.191986, pi, 2 * pi],
        [50.0, 50.0, 30.0, 20.0, 20.0],
        tool_velocity=1.0,
    ),
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.267),
        DhRow(a=hypot(*UPPER_ARM), alpha=0.0, d=0.0, theta_offset=-_LEAN),
        DhRow(a=hypot(0.0775, 0.3425), alpha=0.0, d=0.0, theta_offset=_LEAN + _FORE_LEAN),
        DhRow(a=0.076, alpha=-pi / 2, d=0.0, theta_offset=-_FORE_LEAN),
        DhRow(a=0.0, alpha=0.0, d=0.097),
    ),
    origins=(
        ((0.0, 0.0, 0.267), (0, 0, 0)),
        ((0.0, 0.0, 0.0), (-1, 0, 0)),
        ((0.0535, -0.2845, 0.0), (0, 0, 0)),
        ((0.0775, 0.3425, 0.0), (0, 0, 0)),
        ((0.076, 0.097, 0.0), (-1, 0, 0)),
    ),
    base=ufactory_base(
        (1.95, (-0.00218, -0.00023, 0.08604), (0.004805, -8.33e-06, 0.00026847, 0.0050349, 7.23e-06, 0.0025418))
    ),
    bodies=(
        (2.3849, (0.00013, 0.0294, -0.01239), (0.005705, 1.056e-05, -2.642e-05, 0.00489488, -0.000890795, 0.00334846)),
        (2.164, (0.03788, -0.2254, 0.03447), (0.0278053, 0.0048865, 0.000656695, 0.00551739, -0.00466808, 0.02692536)),
        (2.121, (0.06883, 0.22985, 0.00102), (0.0373639, -0.00417385, 0.00143647, 0.0058447, 0.0075398, 0.0359236)),
        (
            1.3169,
            (0.06489, 0.03122, 0.00319),
            (0.00144315, -0.000455133, 0.000291878, 0.0018275, 0.000132545, 0.00231563),
        ),
        (0.17, (0.0, -0.00677, -0.01098), (9.3e-05, 0.0, 0.0, 5.87e-05, -3.6e-06, 0.000132)),
    ),
    body_source="xarm5_type5_HT_BR2",
    rods=(
        *XARM_RODS,
        UPPER_ARM_RODS,
        (
            rod((0.005, 0.019, -0.003), (0.005, 0.065, -0.003), 0.043),
            rod((0.055, 0.055, -0.060), (0.0775, 0.0, -0.115), 0.047),
            rod((0.0775, 0.0, -0.150), (0.0775, -0.030, -0.270), 0.043),
            rod((0.0775, -0.040, -0.275), (0.0775, -0.046, -0.341), 0.041),
        ),
        WRIST_RODS,
        (HAND_ROD,),
    ),
    home_deg=(0, -30, -60, 90, 0),
    rated_payload=3.0,
)
