"""The RML63-III: 6 axes, 3 kg, with offsets at shoulder and elbow and a spherical wrist."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, PACKAGE, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, rows_from_craig

_BACK, _AXIS = -0.086, -0.017  # [m] Axes 2 and 3, and axis 4, ahead of the base axis.
_SHOULDER = 0.1625  # [m]
_ELBOW = _SHOULDER + 0.38  # [m]
_WRIST = _ELBOW + 0.405  # [m]
_FLANGE = _WRIST + 0.1151  # [m]
_ORIGINS = (
    (0.0, 0.0, 0.0),
    (_BACK, 0.0, _SHOULDER),
    (_BACK, 0.0, _ELBOW),
    (_AXIS, 0.0, _WRIST),
    (_AXIS, 0.0, _WRIST),
    (_AXIS, 0.0, _FLANGE),
)

_BODIES = (  # Mass, centre of mass, tensor.
    (
        1.862,
        (0.0014213, -0.0001016, 0.050087),
        (0.00099641, -3.2815e-06, 1.0053e-05, 0.0010164, -1.2859e-06, 0.00067934),
    ),
    (
        1.837,
        (-0.068442, -0.023913, 0.155562),
        (0.00232334, -0.000758998, 0.000825985, 0.00395038, 0.000254693, 0.003922),
    ),
    (2.006, (-2e-06, -0.09259, 0.1667), (0.0306185, 4e-08, -1.176e-06, 0.0309719, -0.000161533, 0.00146551)),
    (
        1.961,
        (0.033399, -0.017697, 0.029498),
        (0.00411277, -0.00114124, -0.00193824, 0.00536396, -0.00100289, 0.0042931),
    ),
    (1.201, (0.0, -0.035177, -0.1844), (0.0106971, -3.6e-08, 1.11e-07, 0.00992945, 0.00269811, 0.00138899)),
    (1.026, (3.1e-05, -0.012341, 0.030146), (0.00164389, -7.64e-07, 3.076e-06, 0.001452, -0.000383963, 0.000673543)),
    (0.107, (-0.000481, 0.000365, -0.010605), (4.146e-05, -3.111e-06, -1.13e-07, 3.8008e-05, 9.7e-08, 6.4288e-05)),
)


DESCRIPTION = build_realman(
    name="RML63-III",
    dh=rows_from_craig(
        (
            CraigRow(a=0.0, alpha=0.0, d=0.1625),
            CraigRow(a=-0.086, alpha=-pi / 2, d=0.0, theta_offset=-pi / 2),
            CraigRow(a=0.38, alpha=0.0, d=0.0, theta_offset=+pi / 2),
            CraigRow(a=0.069, alpha=+pi / 2, d=0.405),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.0, theta_offset=pi),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.1151, theta_offset=pi),
            CraigRow(a=0.0, alpha=0.0, d=0.0),
        )
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
    limits=realman_limits(
        lower_deg=(-178, -178, -178, -178, -178, -360),
        upper_deg=(178, 178, 145, 178, 178, 360),
        speed_deg=(180, 180, 225, 225, 225, 225),
        torque=(60, 60, 30, 10, 10, 10),
        torque_source="limits of effort of the RM65; the maker's file has a placeholder of 100 N m",
    ),
    bodies=_BODIES,
    origins=_ORIGINS,
    body_source=f"{PACKAGE}: that of the RML63",
    rods=chain_rods(
        [
            (0.0, 0.0, 0.05),
            (0.0, 0.0, 0.08),
            (0.0, 0.0, _SHOULDER),
            (_BACK, 0.0, _SHOULDER),
            (_BACK, -0.09, _SHOULDER),
            (_BACK, -0.09, _ELBOW),
            (_BACK, 0.0, _ELBOW),
            (_AXIS, 0.0, _ELBOW + 0.06),
            (_AXIS, 0.0, _ELBOW + 0.13),
            (_AXIS, 0.0, _WRIST),
            (_AXIS, 0.0, _FLANGE - 0.05),
        ],
        ((0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (9, 10)),
        (0.055, 0.055, 0.048, 0.045, 0.038, 0.038),
        _ORIGINS,
    ),
    home_deg=(0, 20, 70, 0, 90, 0),
    rated_payload=3.0,
)
