"""The RM65: 6 axes, 5 kg, with a spherical wrist."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, rows_from_craig

_SHOULDER = 0.2405  # [m]
_ELBOW = _SHOULDER + 0.256  # [m]
_WRIST = _ELBOW + 0.21  # [m]
_FLANGE = _WRIST + 0.144  # [m]
_ORIGINS = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, _SHOULDER),
    (0.0, 0.0, _ELBOW),
    (0.0, 0.0, _WRIST),
    (0.0, 0.0, _WRIST),
    (0.0, 0.0, _FLANGE),
)

_BODIES = (  # Mass, centre of mass, tensor.
    (
        1.862,
        (-0.0004999, -5.27e-05, 0.060019),
        (0.0017232, -3.1058e-06, 3.7924e-05, 0.0017051, -1.3691e-06, 0.00090158),
    ),
    (1.51, (0.000941, 0.007803, 0.13306), (0.00266222, -2.6849e-05, -1.3775e-05, 0.00233169, -7.8667e-05, 0.00166371)),
    (1.653, (-0.000103, 0.001665, 0.183722), (0.0147138, 6.223e-06, 6.995e-06, 0.0142398, -0.00180925, 0.00170695)),
    (0.726, (-2.9e-05, -0.004039, 0.090105), (0.00135087, -2.28e-07, 1.069e-06, 0.0013316, -0.000219904, 0.000360021)),
    (0.671, (-7e-06, 0.009486, -0.008041), (0.000690221, -8.65e-07, 6.92e-07, 0.000552834, -1.6411e-05, 0.000425835)),
    (0.647, (-3.2e-05, -0.002326, 0.083769), (0.000834052, -2.57e-07, 9.52e-07, 0.000821714, -0.00011175, 0.000281767)),
    (0.104, (0.000569, -0.00029, -0.010569), (3.043e-05, 2.622e-09, -2.199e-08, 3.604e-05, -1.195e-08, 5.52e-05)),
)


DESCRIPTION = build_realman(
    name="RM65",
    dh=rows_from_craig(
        (
            CraigRow(a=0.0, alpha=0.0, d=0.2405),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.0, theta_offset=+pi / 2),
            CraigRow(a=0.256, alpha=0.0, d=0.0, theta_offset=+pi / 2),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.21),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.0),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.144),
            CraigRow(a=0.0, alpha=0.0, d=0.0),
        )
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
    limits=realman_limits(
        lower_deg=(-178, -130, -135, -178, -128, -360),
        upper_deg=(178, 130, 135, 178, 128, 360),
        speed_deg=(180, 180, 225, 225, 225, 225),
        torque=(60, 60, 30, 10, 10, 10),
        torque_source="limits of effort in the maker's public ROS 2 description package",
    ),
    bodies=_BODIES,
    origins=_ORIGINS,
    rods=chain_rods(
        [
            (0.0, 0.0, 0.05),
            (0.0, 0.0, 0.12),
            (0.0, 0.0, 0.17),
            (0.0, 0.0, _SHOULDER),
            (0.0, 0.0, _ELBOW),
            (0.0, 0.0, _ELBOW + 0.09),
            (0.0, 0.0, _WRIST),
            (0.0, 0.0, _FLANGE - 0.05),
        ],
        ((0, 1), (2, 3), (3, 4), (4, 5), (5, 6), (6, 7)),
        (0.050, 0.048, 0.045, 0.040, 0.036, 0.036),
        _ORIGINS,
    ),
    home_deg=(0, -20, -70, 0, -90, 0),
    rated_payload=5.0,
)
