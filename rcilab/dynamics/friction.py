"""Friction of the joints, as the simulated arm has it."""

from __future__ import annotations

from rcilab.arrays import Array
from rcilab.limits import JointLimits
from rcilab.robots.mjcf import DAMPING_PER_TORQUE


def friction_torque(limits: JointLimits, dq: Array) -> Array:
    """Returns what friction takes: viscous, in proportion to the speed and to the size of the drive.

    No table gives figures for the real arms; these are a choice, and those of the MuJoCo plant, whose drives lose
    exactly this much. The vendor's library adds Coulomb friction from the figures that LoadRobotModel serves.

    Args:
        limits: Of the arm; its torque limits stand for the size of the drives.
        dq: Joint velocities, shape (n,) or (N, n), [rad/s].

    Returns:
        Torques of dq's shape, [N m], that a motor needs on top of those of the rigid arm.
    """
    return DAMPING_PER_TORQUE * limits.torque * dq
