"""The Franka Panda: 7 axes, 3 kg. Its controllers have version 5 of the FCI.

`IDENTIFIED` are figures that were identified on a real arm, because the maker does not publish them.
"""

from __future__ import annotations

from rcilab.makers.franka.conditions import fci_conditions
from rcilab.makers.franka.limit_tables import PANDA_SDK_TRANSLATION
from rcilab.makers.franka.robots.arm import PANDA_PAGE, build_franka, craig_link, franka_limits

IDENTIFIED = (
    "identified on a real arm by Gaz et al., IEEE Robotics and Automation Letters 4(4), 2019, in the form of the "
    "maker's public description package; together they give the arm's torques, single figures need not be a body's"
)

_TABLE = {
    "lower": [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
    "upper": [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
    "velocity": [2.175, 2.175, 2.175, 2.175, 2.610, 2.610, 2.610],
    "acceleration": [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
    "jerk": [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
    "torque": [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
}

_BODIES = (  # Mass, centre, tensor.
    (0.629769, (-0.041018, -0.00014, 0.049974), (0.00315, 8.2904e-7, 0.00015, 0.00388, 8.2299e-6, 0.004285)),
    (4.970684, (0.003875, 0.002081, -0.04762), (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117)),
    (0.646926, (-0.003141, -0.02872, 0.003495), (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995)),
    (3.228604, (0.027518, 0.039252, -0.066502), (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083)),
    (3.587895, (-0.05317, 0.104419, 0.027454), (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323)),
    (1.225946, (-0.011953, 0.041065, -0.038437), (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627)),
    (1.666555, (0.060149, -0.014117, -0.010517), (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433)),
    (0.735522, (0.010517, -0.004252, 0.061597), (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815)),
)

DESCRIPTION = build_franka(
    name="Panda",
    limits=franka_limits(
        _TABLE,
        translation=(PANDA_SDK_TRANSLATION, 13.0, 6500.0),
        rotation=(2.5, 25.0, 12500.0),
        elbow=(2.175, 10.0, 5000.0),
        sources={
            "joint": f"{PANDA_PAGE}, joint space limits",
            "translation": f"{PANDA_PAGE}, Cartesian limits, Translation; velocity: rate limiter of the client "
            "library, where the page has 1.7 m/s",
            "rotation": f"{PANDA_PAGE}, Cartesian limits, Rotation",
            "elbow": f"{PANDA_PAGE}, Cartesian limits, Elbow",
        },
    ),
    conditions=fci_conditions,
    bodies=[craig_link(number, *figures, IDENTIFIED) for number, figures in enumerate(_BODIES)],
    dh_source=f"{PANDA_PAGE}, Denavit-Hartenberg parameters (Craig's convention), written as standard rows",
    rated_payload_source="maker's data sheet of the Panda",
)
