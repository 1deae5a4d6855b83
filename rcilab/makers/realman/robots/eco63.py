"""The ECO63: 6 axes, 3 kg; the ECO65 with longer links."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, rows_from_craig

_BACK = -0.086  # [m] Axes 2 to 4 ahead of the base axis.
_ASIDE = -0.0589  # [m] Distance of axis 5 from the plane of the arm.
_FLANGE = _ASIDE + 0.0795  # [m]
_SHOULDER = 0.1625  # [m]
_ELBOW = _SHOULDER + 0.41  # [m]
_WRIST = _ELBOW + 0.38  # [m]
_HAND = _WRIST + 0.11  # [m]
_ORIGINS = (
    (0.0, 0.0, 0.0),
    (_BACK, 0.0, _SHOULDER),
    (_BACK, 0.0, _ELBOW),
    (_BACK, _ASIDE, _WRIST),
    (_BACK, _ASIDE, _HAND),
    (_BACK, _FLANGE, _HAND),
)

_BODIES = (  # Mass, centre of mass, tensor.
    (1.0, (0.0002053, -8.25e-05, 0.042566), (0.00082414, -2.9336e-06, 2.8699e-05, 0.0008206, -2.2123e-06, 0.00068569)),
    (1.6026, (-0.0122, -0.0001, 0.1279), (0.00200784, -4.3739e-05, -0.00066637, 0.00338062, -1.14927e-05, 0.00251578)),
    (2.8169, (0.0001, 0.0551, 0.1236), (0.0596358, -4.7509e-06, 2.4724e-06, 0.0596329, 0.00369152, 0.00305138)),
    (2.6857, (-0.0001, 0.0054, 0.1603), (0.0669638, -7.8642e-06, -7.1564e-06, 0.0660581, -0.00349884, 0.00296862)),
    (0.625, (0.0, 0.0037, 0.0359), (0.000545634, -1.203e-07, 1.19e-07, 0.000516969, 8.13961e-05, 0.000317335)),
    (0.6743, (0.0, 0.0246, -0.0066), (0.000685066, -5.787e-07, -1.03e-08, 0.000387337, -0.000113521, 0.000617892)),
    (0.248, (0.001, -0.0101, 0.0), (4.41232e-05, -2.997e-07, 6.36e-08, 6.54409e-05, 2.89e-08, 3.50778e-05)),
)


DESCRIPTION = build_realman(
    name="ECO63",
    dh=rows_from_craig(
        (
            CraigRow(a=0.0, alpha=0.0, d=0.1625),
            CraigRow(a=-0.086, alpha=-pi / 2, d=0.0, theta_offset=-pi / 2),
            CraigRow(a=0.41, alpha=0.0, d=0.0),
            CraigRow(a=0.38, alpha=0.0, d=-0.0589, theta_offset=+pi / 2),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.11),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.0795),
            CraigRow(a=0.0, alpha=0.0, d=0.0),
        )
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
    limits=realman_limits(
        lower_deg=(-178, -178, -168, -178, -178, -360),
        upper_deg=(178, 135, 158, 178, 178, 360),
        speed_deg=(180, 180, 225, 225, 225, 225),
        torque=(60, 60, 30, 10, 10, 10),
        torque_source="limits of effort in the maker's public ROS 2 description package",
    ),
    bodies=_BODIES,
    origins=_ORIGINS,
    rods=chain_rods(
        [
            (0.0, 0.0, 0.045),
            (0.0, 0.0, 0.08),
            (0.0, 0.0, _SHOULDER),
            (_BACK, 0.0, _SHOULDER),
            (_BACK, -0.075, _SHOULDER),
            (_BACK, -0.075, _ELBOW),
            (_BACK, 0.01, _ELBOW + 0.01),
            (_BACK, 0.01, _WRIST),
            (_BACK, _ASIDE, _WRIST),
            (_BACK, _ASIDE, _HAND - 0.03),
            (_BACK, _ASIDE, _HAND),
            (_BACK, _FLANGE - 0.05, _HAND),
        ],
        ((0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (10, 11)),
        (0.050, 0.050, 0.045, 0.038, 0.036, 0.038),
        _ORIGINS,
        direction=(0, 1, 0),
    ),
    home_deg=(0, 20, 70, 0, 90, 0),
    rated_payload=3.0,
)
