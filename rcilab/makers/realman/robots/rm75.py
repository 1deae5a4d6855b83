"""The RM75: 7 axes, 5 kg, without offsets."""

from __future__ import annotations

from math import pi

from rcilab.makers.realman.robots.arm import ALGO, PACKAGE, build_realman, chain_rods, realman_limits
from rcilab.robots.description import DhRow

_SHOULDER = 0.2405  # [m]
_ELBOW = _SHOULDER + 0.256  # [m]
_WRIST = _ELBOW + 0.21  # [m]
_FLANGE = _WRIST + 0.144  # [m]
_ORIGINS = (
    (0.0, 0.0, _SHOULDER),
    (0.0, 0.0, _SHOULDER),
    (0.0, 0.0, _ELBOW),
    (0.0, 0.0, _ELBOW),
    (0.0, 0.0, _WRIST),
    (0.0, 0.0, _WRIST),
    (0.0, 0.0, _FLANGE),
)

_BODIES = (  # Mass, centre of mass, tensor.
    (1.862, (0.0004999, 5.27e-05, 0.060019), (0.0017232, -3.1058e-06, -3.7924e-05, 0.0017051, 1.3691e-06, 0.00090158)),
    (1.574, (0.000241, -0.013273, 0.23055), (0.00248757, 9.663e-06, -7.909e-06, 0.00232104, 0.000179393, 0.00145055)),
    (
        1.217,
        (-0.000357, 0.005329, 0.106789),
        (0.00349412, -5.613e-06, -2.921e-06, 0.00344408, 0.000583884, 0.000892721),
    ),
    (1.11, (3e-06, -0.01398, -0.011324), (0.00183666, 2.259e-06, -4.216e-06, 0.00149887, 3.7167e-05, 0.00106255)),
    (0.685, (-5e-06, 0.004747, 0.084658), (0.00128244, -6.3e-07, 5.51e-07, 0.00125618, 0.000232084, 0.000373013)),
    (0.619, (7.8e-05, -0.012937, -0.008781), (0.000627336, 1.636e-06, -1.345e-06, 0.000542455, 3.497e-05, 0.000370291)),
    (0.602, (-1.4e-05, 0.002819, 0.078524), (0.000780774, -4.69e-07, 1.21e-07, 0.000763955, 0.000120513, 0.000289973)),
    (0.107, (0.001094, -7.7e-05, -0.010119), (4.4123e-05, -6.4e-08, 3e-07, 3.5078e-05, -2.9e-08, 6.5445e-05)),
)


DESCRIPTION = build_realman(
    name="RM75",
    dh=(
        DhRow(a=0.0, alpha=-pi / 2, d=0.2405),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.256),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=-pi / 2, d=0.21),
        DhRow(a=0.0, alpha=+pi / 2, d=0.0),
        DhRow(a=0.0, alpha=0.0, d=0.144),
    ),
    dh_source=f"{ALGO}, rm_algo_get_dh, of this arm in the standard convention",
    limits=realman_limits(
        lower_deg=(-178, -130, -178, -135, -178, -128, -360),
        upper_deg=(178, 130, 178, 135, 178, 128, 360),
        speed_deg=(180, 180, 225, 225, 225, 225, 225),
        torque=(60, 60, 30, 30, 10, 10, 10),
        torque_source="limits of effort in the maker's public ROS 2 description package",
    ),
    bodies=_BODIES,
    origins=_ORIGINS,
    body_source=f"{PACKAGE}; those of the file are in frames of Craig's convention, unlike its joints",
    rods=chain_rods(
        [
            (0.0, 0.0, 0.05),
            (0.0, 0.0, 0.12),
            (0.0, 0.0, 0.17),
            (0.0, 0.0, _SHOULDER),
            (0.0, 0.0, _SHOULDER + 0.13),
            (0.0, 0.0, _ELBOW),
            (0.0, 0.0, _ELBOW + 0.09),
            (0.0, 0.0, _WRIST),
            (0.0, 0.0, _FLANGE - 0.05),
        ],
        ((0, 1), (2, 3), (3, 4), (4, 5), (5, 6), (6, 7), (7, 8)),
        (0.050, 0.048, 0.045, 0.042, 0.040, 0.036, 0.036),
        _ORIGINS,
    ),
    home_deg=(0, 20, 0, 70, 0, 90, 0),
    rated_payload=5.0,
)
