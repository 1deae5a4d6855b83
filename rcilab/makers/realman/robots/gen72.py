"""The GEN72: 7 axes, 2 kg, with offsets at elbow and wrist."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, rows_from_craig

_AXIS = 0.021  # [m] Axis 5 ahead of the base axis.
_FLANGE = _AXIS + 0.0905  # [m]
_SHOULDER = 0.218  # [m]
_ELBOW = _SHOULDER + 0.28  # [m]
_WRIST = _ELBOW + 0.2525  # [m]
_HAND = _WRIST + 0.067  # [m]
_ORIGINS = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, _SHOULDER),
    (0.0, 0.0, _ELBOW),
    (0.04, 0.0, _ELBOW),
    (_AXIS, 0.0, _WRIST),
    (_AXIS, 0.0, _WRIST),
    (_FLANGE, 0.0, _HAND),
)

_BODIES = (  # Mass, centre of mass, tensor.
    (
        0.7257323,
        (0.0006086, 0.0001014, 0.0500536),
        (0.00116526, 3.86985e-06, 3.61599e-05, 0.00114388, -1.6916e-06, 0.000799621),
    ),
    (
        0.5112316,
        (4e-07, -6.04e-05, 0.170544),
        (0.000959441, -1.90968e-09, -7.95752e-09, 0.00102039, 1.46571e-06, 0.000388715),
    ),
    (
        0.551907,
        (-7e-07, -3.88e-05, 0.0576246),
        (0.0014214, 1.36373e-08, 1.11762e-08, 0.00127235, -1.30499e-06, 0.000525714),
    ),
    (
        0.7741305,
        (0.0089744, 2.63e-05, -0.0738285),
        (0.00242102, -6.22596e-07, -0.000489521, 0.00248694, -1.48543e-06, 0.000900997),
    ),
    (
        0.4371302,
        (-0.0096244, -0.0001746, 0.0352034),
        (0.000866914, 7.42554e-07, 0.000148762, 0.000952324, -2.68058e-06, 0.000267753),
    ),
    (
        0.4242768,
        (-5e-07, -3.85e-05, -0.0669555),
        (0.00112445, 7.56623e-09, -1.71276e-08, 0.00103382, 8.24694e-07, 0.00027464),
    ),
    (
        0.302793,
        (0.0018422, 9.21e-05, 0.0379763),
        (0.000140115, 4.58155e-10, -3.00205e-06, 0.000155721, -7.01345e-10, 0.000132631),
    ),
    (0.1766127, (-0.0292499, 0.0, 0.0001999), (8.48643e-05, 0.0, 0.0, 6.24281e-05, 0.0, 6.24281e-05)),
)


DESCRIPTION = build_realman(
    name="GEN72",
    dh=rows_from_craig(
        (
            CraigRow(a=0.0, alpha=0.0, d=0.218),
            CraigRow(a=0.0, alpha=-pi / 2, d=0.0),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.28),
            CraigRow(a=0.04, alpha=+pi / 2, d=0.0),
            CraigRow(a=-0.019, alpha=-pi / 2, d=0.2525),
            CraigRow(a=0.0, alpha=+pi / 2, d=0.0, theta_offset=+pi / 2),
            CraigRow(a=0.067, alpha=+pi / 2, d=0.0905),
            CraigRow(a=0.0, alpha=0.0, d=0.0),
        )
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
    limits=realman_limits(
        lower_deg=(-172, -105, -172, -170, -172, -90, -172),
        upper_deg=(172, 105, 172, 55, 172, 120, 172),
        speed_deg=(180, 180, 180, 180, 225, 225, 225),
        torque=(25, 25, 25, 25, 5, 5, 5),
        torque_source="limits of effort in the maker's public ROS 2 description package",
    ),
    bodies=_BODIES,
    origins=_ORIGINS,
    rods=chain_rods(
        [
            (0.0, 0.0, 0.05),
            (0.0, 0.0, 0.11),
            (0.0, 0.0, 0.16),
            (0.0, 0.0, _SHOULDER),
            (0.0, 0.0, _SHOULDER + 0.13),
            (0.0, 0.0, _SHOULDER + 0.16),
            (0.04, 0.0, _ELBOW),
            (_AXIS, 0.0, _ELBOW + 0.10),
            (_AXIS, 0.0, _ELBOW + 0.12),
            (_AXIS, 0.0, _WRIST - 0.03),
            (_AXIS, 0.0, _WRIST),
            (_AXIS, 0.0, _HAND),
        ],
        ((0, 1), (2, 3), (3, 4), (5, 6), (6, 7), (8, 9), (10, 11)),
        (0.048, 0.045, 0.043, 0.040, 0.038, 0.036, 0.038),
        _ORIGINS,
        direction=(1, 0, 0),
    ),
    home_deg=(0, 20, 0, -90, 0, 0, 0),
    rated_payload=2.0,
)
