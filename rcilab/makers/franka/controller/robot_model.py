"""The URDF text that a controller of version 10 answers to GetRobotModel.

A client computes kinematics and dynamics from it, and the velocity bounds of its rate limiter from an element that is
not part of the format. It requires joints joint1 to joint7, and the flange as link8.
"""

from __future__ import annotations

from rcilab.core.limits import JointLimits
from rcilab.makers.franka.controller.craig_bodies import CraigBody, craig_bodies, craig_placement
from rcilab.makers.franka.robots.arm import CRAIG
from rcilab.robots.description import CraigRow, RobotDescription
from rcilab.robots.urdf import number_text, vector_text

_FLANGE = "link8"
_NO_DECELERATION_LIMIT = 1e9  # [rad/s^2] Bounds the velocity nowhere.


def build_robot_model(description: RobotDescription) -> str:
    """Returns the URDF of an arm with Franka's geometry: seven joints by Craig's convention, without shapes.

    Args:
        description: The arm. Its name, in lower case, is that of the URDF.
    """
    bodies = craig_bodies(description)
    lines = ['<?xml version="1.0" ?>', f'<robot name="{description.name.lower()}">']
    for number, body in enumerate(bodies):
        lines += _link(f"link{number}", body)
        if number:
            lines += _joint(number, CRAIG[number - 1], description.limits.joint)
    lines += [f'  <link name="{_FLANGE}"/>', *_fixed(len(bodies), CRAIG[-1])]
    return "\n".join([*lines, "</robot>", ""])


def _link(name: str, body: CraigBody) -> list[str]:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia.tolist()
    moments = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
    attributes = " ".join(f'{key}="{number_text(value)}"' for key, value in moments.items())
    return [
        f'  <link name="{name}">',
        "    <inertial>",
        f'      <origin rpy="0 0 0" xyz="{vector_text(body.center_of_mass)}"/>',
        f'      <mass value="{number_text(body.mass)}"/>',
        f"      <inertia {attributes}/>",
        "    </inertial>",
        "  </link>",
    ]


def _joint(number: int, row: CraigRow, limits: JointLimits) -> list[str]:
    i, ends = number - 1, limits.near_ends
    offset = 0.0 if ends is None else ends.offset[i]
    deceleration = _NO_DECELERATION_LIMIT if ends is None else ends.deceleration[i]
    return [
        f'  <joint name="joint{number}" type="revolute">',
        *_placement(number, row),
        '    <axis xyz="0 0 1"/>',
        f'    <limit lower="{number_text(limits.lower[i])}" upper="{number_text(limits.upper[i])}"'
        f' velocity="{number_text(limits.velocity[i])}" effort="{number_text(limits.torque[i])}"/>',
        f'    <position_based_velocity_limits velocity_offset="{number_text(offset)}"'
        f' deceleration_limit="{number_text(deceleration)}"/>',
        "  </joint>",
    ]


def _fixed(number: int, row: CraigRow) -> list[str]:
    return [f'  <joint name="joint{number}" type="fixed">', *_placement(number, row), "  </joint>"]


def _placement(number: int, row: CraigRow) -> list[str]:
    position = craig_placement(row)[:3, 3].tolist()
    return [
        f'    <parent link="link{number - 1}"/>',
        f'    <child link="link{number}"/>',
        f'    <origin rpy="{number_text(row.alpha)} 0 0" xyz="{vector_text(position)}"/>',
    ]
