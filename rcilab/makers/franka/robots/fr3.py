"""The Franka Research 3 (FR3): the Panda's geometry with other limits. Its controllers have version 10 of the FCI.

The maker publishes masses, centres and tensors in its description package. The URDF files that the package generates
have them unchanged as inertials of the links: the tensor is about the centre of mass, in the axes of the link's frame,
which is Craig's frame of its joint. They were identified on arms: single figures need not be those of a body.
"""

from __future__ import annotations

from rcilab.core.arrays import readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import EndVelocity
from rcilab.makers.franka.conditions import fr3_conditions
from rcilab.makers.franka.robots.arm import build_franka, craig_link, franka_limits
from rcilab.makers.franka.state_rounding import ANGLE_ROUNDING

LIMITS = "Franka's page Control parameters, limits for Franka Research 3"
URDF = "URDF of the FR3 in the tests of the maker's client library"
PACKAGE = "maker's public description package 1.0.1, inertials of the FR3"

_TABLE = {
    "lower": [-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196],
    "upper": [2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196],
    "velocity": [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
    "acceleration": [10.0] * 7,
    "jerk": [5000.0] * 7,
    "torque": [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
}
_NEAR_ENDS = EndVelocity(
    offset=readonly_copy([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35]),
    deceleration=readonly_copy([6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0]),
    rounding=readonly_copy(ANGLE_ROUNDING / CYCLE_TIME),
)

_BODIES = (  # Mass, centre, tensor.
    (2.3966, (-0.0172, 0.0004, 0.0745), (0.009, 0.0, 0.002, 0.0115, 0.0, 0.0085)),
    (
        2.9274653454,
        (4.128e-07, -0.0181251324, -0.038603597),
        (
            0.023927316485107913,
            1.3317903455714081e-05,
            -0.00011404774918616684,
            0.0224821613275756,
            -0.0019950320628240115,
            0.006350098258530016,
        ),
    ),
    (
        2.9355370338,
        (0.0031828864, -0.0743221644, 0.0088146084),
        (
            0.041938946257609425,
            0.00020257331521090626,
            0.004077784227179924,
            0.02514514885014724,
            -0.0042252158006570156,
            0.06170214472888839,
        ),
    ),
    (
        2.2449013699,
        (0.0407015686, -0.0048200565, -0.0289730823),
        (
            0.02410142547240885,
            0.002404694559042109,
            -0.002856269270114313,
            0.01974053266708178,
            -0.002104212683891874,
            0.019044494482244823,
        ),
    ),
    (
        2.6155955791,
        (-0.0459100965, 0.063049296, -0.0085187868),
        (
            0.03452998321913202,
            0.01322552265982813,
            0.01015142998484113,
            0.028881621933049058,
            -0.0009762833870704552,
            0.04125471171146641,
        ),
    ),
    (
        2.3271207594,
        (-0.0016039605, 0.0292536262, -0.097296599),
        (
            0.051610278463662895,
            -0.005715173387783472,
            -0.0035673167625872135,
            0.04787729713371481,
            0.010673985108535986,
            0.016423625579357254,
        ),
    ),
    (
        1.8170376524,
        (0.0597131221, -0.0410294666, -0.0101692726),
        (
            0.005412333594383447,
            0.006193456360285834,
            0.0014219289306117652,
            0.014058329545509979,
            -0.0013140753741120031,
            0.016080817924212554,
        ),
    ),
    (
        0.6271432862,
        (0.0045225817, 0.0086261921, -0.0161633251),
        (
            0.00021092389150104718,
            -2.433299114461931e-05,
            4.564480393778983e-05,
            0.00017718568002411474,
            8.744070223226438e-05,
            5.993190599659971e-05,
        ),
    ),
)

DESCRIPTION = build_franka(
    name="FR3",
    limits=franka_limits(
        _TABLE,
        translation=(3.0, 9.0, 4500.0),
        rotation=(2.5, 17.0, 8500.0),
        elbow=(1.5, 10.0, 5000.0),
        near_ends=_NEAR_ENDS,
        sources={
            "joint": f"{LIMITS}, joint space",
            **dict.fromkeys(("joint.lower", "joint.upper", "joint.velocity", "joint.torque"), URDF),
            "near_ends": URDF,
            "translation": f"{LIMITS}, Cartesian space, Translation",
            "rotation": f"{LIMITS}, Cartesian space, Rotation",
            "elbow": f"{LIMITS}, Cartesian space, Elbow",
        },
    ),
    conditions=fr3_conditions,
    bodies=[craig_link(number, *figures, PACKAGE) for number, figures in enumerate(_BODIES)],
    dh_source="the Panda's Denavit-Hartenberg parameters (Craig's convention), written as standard rows",
    rated_payload_source="maker's data sheet of the FR3",
)
