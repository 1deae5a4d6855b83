"""What the ECO arms share: 6 axes, of which 2 to 4 are parallel, and no spherical wrist."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from rcilab.makers.realman.robots.arm import ALGO, Figures, build_realman, chain_rods, realman_limits
from rcilab.robots.description import CraigRow, RobotDescription, rows_from_craig

_BACK = -0.086  # [m] Axes 2 to 4 ahead of the base axis.
_SHOULDER = 0.1625  # [m]


def build_eco(
    *,
    name: str,
    upper_arm: float,
    forearm: float,
    aside: float,
    lower_deg: Sequence[float],
    upper_deg: Sequence[float],
    torque_source: str,
    bodies: Sequence[Figures],
    rated_payload: float,
) -> RobotDescription:
    """Returns an ECO arm.

    Args:
        name: Name of the arm.
        upper_arm: Distance of axes 2 and 3, [m].
        forearm: Distance of axes 3 and 4, [m].
        aside: Distance of axis 5 from the plane of the arm, [m].
        lower_deg: Smallest joint angles, [deg].
        upper_deg: Largest joint angles, [deg].
        torque_source: Source of the largest torques.
        bodies: Base and links.
        rated_payload: [kg].
    """
    elbow = _SHOULDER + upper_arm
    wrist = elbow + forearm
    hand = wrist + 0.11
    flange = aside + 0.0795
    origins = (
        (0.0, 0.0, 0.0),
        (_BACK, 0.0, _SHOULDER),
        (_BACK, 0.0, elbow),
        (_BACK, aside, wrist),
        (_BACK, aside, hand),
        (_BACK, flange, hand),
    )
    return build_realman(
        name=name,
        dh=rows_from_craig(
            (
                CraigRow(a=0.0, alpha=0.0, d=_SHOULDER),
                CraigRow(a=_BACK, alpha=-pi / 2, d=0.0, theta_offset=-pi / 2),
                CraigRow(a=upper_arm, alpha=0.0, d=0.0),
                CraigRow(a=forearm, alpha=0.0, d=aside, theta_offset=+pi / 2),
                CraigRow(a=0.0, alpha=+pi / 2, d=0.11),
                CraigRow(a=0.0, alpha=-pi / 2, d=0.0795),
                CraigRow(a=0.0, alpha=0.0, d=0.0),
            )
        ),
        dh_source=f"{ALGO}, rm_algo_get_dh (Craig's convention), written as standard rows",
        limits=realman_limits(
            lower_deg=lower_deg,
            upper_deg=upper_deg,
            speed_deg=(180, 180, 225, 225, 225, 225),
            torque=(60, 60, 30, 10, 10, 10),
            torque_source=torque_source,
        ),
        bodies=bodies,
        origins=origins,
        rods=chain_rods(
            [
                (0.0, 0.0, 0.045),
                (0.0, 0.0, 0.08),
                (0.0, 0.0, _SHOULDER),
                (_BACK, 0.0, _SHOULDER),
                (_BACK, -0.075, _SHOULDER),
                (_BACK, -0.075, elbow),
                (_BACK, 0.01, elbow + 0.01),
                (_BACK, 0.01, wrist),
                (_BACK, aside, wrist),
                (_BACK, aside, hand - 0.03),
                (_BACK, aside, hand),
                (_BACK, flange - 0.05, hand),
            ],
            ((0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (10, 11)),
            (0.050, 0.050, 0.045, 0.038, 0.036, 0.038),
            origins,
            direction=(0, 1, 0),
        ),
        home_deg=(0, 20, 70, 0, 90, 0),
        rated_payload=rated_payload,
    )
