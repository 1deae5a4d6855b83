"""The ECO65: 6 axes, 5 kg; axes 2 to 4 are parallel."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, rows_from_craig

_BACK = -0.086  # [m] Axes 2 to 4 ahead of the base axis.
_ASIDE = -0.05888  # [m] Distance of axis 5 from the plane of the arm.
_FLANGE = _ASIDE + 0.0795  # [m]
_SHOULDER = 0.1625  # [m]
_ELBOW = _SHOULDER + 0.26  # [m]
_WRIST = _ELBOW + 0.24  # [m]
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
    (
        0.61127,
        (0.0005998, -9.29e-05, 0.043301),
        (0.00080212, 3.0281e-06, -2.8747e-05, 0.00080502, 1.9749e-06, 0.00066167),
    ),
    (0.74247, (-0.022858, -2.1e-06, 0.148842), (0.00081398, -1.9024e-05, 0.00022746, 0.001848, 2.0444e-06, 0.0015286)),
    (1.3502, (-1.6e-06, -0.067332, 0.10336), (0.012821, -1.1499e-08, -7.2979e-08, 0.012933, 0.00033755, 0.0011237)),
    (1.0422, (7e-07, 0.018599, 0.10374), (0.0094046, -3.3287e-09, -2.2514e-08, 0.0092482, -0.00068613, 0.00084115)),
    (
        0.27383,
        (-0.0069819, 0.0067416, 0.016328),
        (0.00024751, 5.4838e-10, 5.6849e-09, 0.00019295, 2.8552e-05, 0.00017648),
    ),
    (
        0.27794,
        (6e-07, 0.0066328, -0.012645),
        (0.00024751, -5.6849e-09, 5.4838e-10, 0.00017648, -2.8552e-05, 0.00019295),
    ),
    (
        0.033025,
        (0.0013607, -0.010297, 0.0011855),
        (1.2968e-05, 8.451e-08, 7.8692e-07, 2.0405e-05, 1.2002e-07, 1.1583e-05),
    ),
)


DESCRIPTION = build_realman(
    name="ECO65",
    dh=rows_from_craig(
        (
            CraigRow(a=0.0, alpha=0.0, d=0.1625),
            CraigRow(a=-0.086, alpha=-pi / 2, d=0.0, theta_offset=-pi / 2),
            CraigRow(a=0.26, alpha=0.0, d=0.0),
            CraigRow(a=0.24, alpha=0.0, d=-0.05888, theta_offset=+pi / 2),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.11),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.0795),
            CraigRow(a=0.0, alpha=0.0, d=0.0),
        )
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
    limits=realman_limits(
        lower_deg=(-178, -178, -160, -178, -178, -360),
        upper_deg=(178, 135, 145, 178, 178, 360),
        speed_deg=(180, 180, 225, 225, 225, 225),
        torque=(60, 60, 30, 10, 10, 10),
        torque_source="limits of effort of the ECO63; the maker's file has a placeholder of 100 N m",
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
    rated_payload=5.0,
)
